"""A worker that lies about fitness is found, expelled, and nothing it said is in the result."""

import subprocess
import sys

import pytest
from undisturbed import SPHERE, assert_undisturbed

from tramnet_master import networks

pytestmark = pytest.mark.system

LIAR = """
import sys
import numpy as np
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evaluated
from tramnet_workers.node import __main__ as node
from tramnet_workers.node.evaluator import Evaluator

how, truth = sys.argv.pop(1), Evaluator.compute

def compute(self, work):
    outcome = truth(self, work)
    objectives = outcome.objectives.unpack().copy()
    match how:
        case "slyly":  # never about what may be the best
            worse = objectives > np.median(objectives)
            objectives[worse] = objectives[worse][::-1]
        case "boldly":
            objectives -= 1000.0
    return Evaluated(work.work, Array.pack(objectives), outcome.seconds)

Evaluator.compute = compute
sys.exit(node.main())
"""


@pytest.fixture
def lie(tmp_path):
    """Starts workers that lie, slyly or boldly."""
    liars = []

    def begin(how: str) -> subprocess.Popen:
        live = networks.find()
        words = ["--connect", live.endpoint, "--network", live.network, "--supervisor", "nobody"]
        command = [sys.executable, "-c", LIAR, how, *words]
        liars.append(subprocess.Popen(command, stdin=subprocess.PIPE))
        return liars[-1]

    yield begin
    for liar in liars:
        liar.kill()
        liar.communicate()


@pytest.mark.parametrize("how", ["slyly", pytest.param("boldly", marks=pytest.mark.slow)])
def test_a_liar_is_expelled_and_the_result_is_that_of_the_others(start, lie, how):
    run = start(
        *SPHERE, "--generations", 60, "--set", "delay=0.003", "--workers", 1, "--audit", 0.03,
        "--checkpoint-seconds", 0,
    )  # fmt: skip
    run.wait_for_generation(2)

    liar = lie(how)
    status = liar.wait(60)
    result = assert_undisturbed(run)

    assert status == 100  # told to end
    (expelled,) = result["expelled"]
    assert expelled["pid"] == liar.pid
    assert any("back to generation" in str(entry.get("text")) for entry in run.events())


def test_where_nobody_lies_an_audit_changes_nothing(start):
    run = start(*SPHERE, "--generations", 10, "--workers", 2, "--audit", 1)

    assert assert_undisturbed(run)["expelled"] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "job",
    [
        ("redundant8", "--population", 80, "--subpopulations", 4),
        ("crank", "--settings", "literal", "--population", 20, "--generations", 10),
    ],
    ids=["redundant8", "crank"],
)
def test_an_audit_computes_again_whatever_the_kind_of_work(start, job):
    plain = start("run", *job, "--workers", 2, out="plain").result()
    audited = start("run", *job, "--workers", 2, "--audit", 1, out="audited").result()

    assert audited["expelled"] == []
    assert audited["final_population_sha256"] == plain["final_population_sha256"]
