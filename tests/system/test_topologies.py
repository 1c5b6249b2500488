"""Networks of several hops in real processes: whatever happens on the way, the result is that of any other run."""

import pytest
from processes import end, wait_until
from undisturbed import SPHERE, assert_undisturbed

pytestmark = pytest.mark.system

SLOW = (*SPHERE, "--set", "delay=0.01", "--generations", 25)

# Like `sphere`; the worker whose process id a file names hangs with the interpreter in its hands.
HANGING = """
import ctypes, os, pathlib
from tramnet_workers.problems.sphere import Sphere

VICTIM = pathlib.Path(os.environ["VICTIM"])

class Hanging(Sphere):
    def evaluate(self, genomes):
        if VICTIM.exists() and VICTIM.read_text() == str(os.getpid()):
            ctypes.PyDLL(None).sleep(600)
        return super().evaluate(genomes)

def build(parameters):
    return Hanging.from_parameters(parameters)
"""


def seats(run):
    """Process ids of the live workers by seat."""
    members = run.status().get("workers", [])
    return {member["seat"]: member["pid"] for member in members if member["live"]}


def test_a_killed_tram_in_the_middle_is_wired_out_and_nothing_is_lost(start):
    run = start(*SLOW, "--workers", 3, "--topology", "pipeline")
    run.wait_for_workers(3)
    run.wait_for_generation(2)
    epoch, victim = run.status()["epoch"], seats(run)[1]

    end(victim)
    wait_until(lambda: run.status().get("epoch", 0) > epoch, "the network to be rewired")
    result = assert_undisturbed(run)
    assert result["topology"] == "pipeline"
    assert result["lost_workers"] >= 1


def test_a_tram_that_hangs_is_found_by_its_silence_and_those_behind_it_lose_nothing(
    start, tmp_path, monkeypatch
):
    site, victim = tmp_path / "site", tmp_path / "victim"
    (site / "hanging-1.0.dist-info").mkdir(parents=True)
    (site / "hanging.py").write_text(HANGING)
    (site / "hanging-1.0.dist-info" / "METADATA").write_text("Name: hanging\nVersion: 1.0\n")
    (site / "hanging-1.0.dist-info" / "entry_points.txt").write_text(
        "[tramnet.problems]\nhanging = hanging:build\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(site), prepend=":")
    monkeypatch.setenv("VICTIM", str(victim))
    words = [word if word != "sphere" else "hanging" for word in SLOW]
    run = start(*words, "--workers", 3, "--topology", "pipeline")
    run.wait_for_workers(3)
    run.wait_for_generation(2)

    victim.write_text(str(seats(run)[1]))

    assert assert_undisturbed(run)["lost_workers"] >= 1
