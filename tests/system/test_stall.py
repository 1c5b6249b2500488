"""Workers that freeze: their chunks go elsewhere in time, nobody waits, what they say late is counted."""

import signal
import subprocess
import sys
from itertools import pairwise

import pytest
from processes import descendants, end, wait_until
from undisturbed import SPHERE, assert_undisturbed

from tramnet_master import networks
from tramnet_master.csv_tables import read_table

pytestmark = pytest.mark.system

DEADLINE = 0.5
"""Time a chunk may take [s]."""


@pytest.fixture
def unattended(tmp_path):
    """Starts workers that nobody replaces."""
    workers: list[subprocess.Popen[bytes]] = []

    def begin() -> subprocess.Popen[bytes]:
        live = networks.find()
        words = ["--connect", live.endpoint, "--network", live.network, "--supervisor", "nobody"]
        command = [sys.executable, "-m", "tramnet_workers.node", *words]
        workers.append(subprocess.Popen(command, stdin=subprocess.PIPE))
        return workers[-1]

    yield begin
    for worker in workers:
        worker.kill()
        worker.communicate()


def longest_waits(run) -> list[float]:
    """Times between the ends of consecutive generations [s], the longest first."""
    elapsed = read_table(run.folder / "history.csv")["elapsed_s"].tolist()
    return sorted((after - before for before, after in pairwise(elapsed)), reverse=True)


def test_a_frozen_worker_holds_nobody_up_and_what_it_says_late_is_counted(start, unattended):
    run = start(
        *SPHERE, "--generations", 150, "--set", "delay=0.002", "--workers", 1,
        "--deadline", DEADLINE, "--first-deadline", 2,
    )  # fmt: skip
    run.wait_for_workers(1)
    frozen = unattended()
    run.wait_for_workers(2)
    now = run.status()["generation"]
    run.wait_for_generation(now + 3)

    end(frozen.pid, signal.SIGSTOP)
    now = run.status()["generation"]
    run.wait_for_generation(now + 10)
    end(frozen.pid, signal.SIGCONT)
    wait_until(lambda: run.ended or run.status()["dropped"], "the late answer")
    dropped = run.status().get("dropped")

    assert_undisturbed(run)
    assert dropped is None or dropped["closed"] >= 1
    late, *others = longest_waits(run)
    assert 0.8 * DEADLINE < late < 10 * DEADLINE  # the chunk of the frozen one, once
    assert max(others[1:]) < 4 * DEADLINE  # from then on nobody waits: the root never blocks


@pytest.mark.slow
def test_a_frozen_worker_is_replaced_by_its_supervisor(start):
    run = start(
        *SPHERE, "--generations", 100, "--set", "delay=0.002", "--workers", 2, "--deadline", DEADLINE,
    )  # fmt: skip
    run.wait_for_generation(3)
    victim = descendants(run.pid)[0]

    end(victim, signal.SIGSTOP)
    wait_until(lambda: victim not in descendants(run.pid), "the replacement")

    assert_undisturbed(run)
    (replaced,) = [event for event in run.events() if event["event"] == "replace"]
    assert replaced["pid"] == victim
    assert replaced["cause"] == "its chunk is overdue"
