"""Cables are cut and healed: a run goes on with whom it reaches, waits where it reaches nobody, loses nothing."""

import time

import pytest
from hosts import ROOT_ADDRESS, hosts
from processes import Run, wait_until
from undisturbed import SPHERE, assert_undisturbed

pytestmark = [pytest.mark.system, pytest.mark.slow]

ENDPOINT = f"tcp/{ROOT_ADDRESS}:7447"


@pytest.fixture
def network():
    with hosts(4) as made:
        yield made


@pytest.fixture
def run(start, network):
    """A run whose four workers are on hosts of their own."""
    root = start(
        *SPHERE, "--generations", 1000, "--set", "delay=0.004", "--workers", 0, "--listen", ENDPOINT,
        within=network.root,
    )  # fmt: skip
    root.wait_for_generation(0)
    for host in network.others:
        start("worker", "--connect", ENDPOINT, "--count", 1, within=host)
    root.wait_for_workers(4)
    return root


def live(run: Run) -> int:
    return len(run.workers())


def generation(run: Run) -> int:
    found = run.status().get("generation", -1)
    assert isinstance(found, int)
    return found


def goes_on(run: Run) -> None:
    now = generation(run)
    wait_until(lambda: generation(run) > now + 2, "the run to go on")


def test_cutting_one_half_and_all_workers_off_loses_nothing(network, run):
    network.cut(0)
    began = time.monotonic()
    wait_until(lambda: live(run) == 3, "the loss of one worker")
    goes_on(run)
    time.sleep(max(0.0, began + 10.0 - time.monotonic()))
    network.heal(0)
    wait_until(lambda: live(run) == 4, "the worker to come back")

    network.cut(0, 1)
    wait_until(lambda: live(run) == 2, "the loss of half of the workers")
    goes_on(run)
    network.cut(2, 3)
    wait_until(lambda: live(run) == 0, "the loss of all workers")
    wait_until(
        lambda: any("no worker" in str(e.get("text")) for e in run.events()), "the root to say so"
    )
    network.heal(0, 1, 2, 3)
    wait_until(lambda: live(run) == 4, "all workers to come back")
    goes_on(run)

    assert assert_undisturbed(run)["lost_workers"] >= 5
