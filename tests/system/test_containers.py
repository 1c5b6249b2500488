"""A run of what ``docker-compose.yml`` describes, over the addresses of machines made of namespaces.

Nothing of the services is changed: neither their commands, nor their environment, nor the name of the root in it.
"""

import json
import signal
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from containers import SERVICES, Container, Machines, health_check, namespaces
from processes import descendants, is_alive, wait_until

from tramnet_master.experiments import puma560
from tramnet_master.experiments.runner import population_hash
from tramnet_workers.node.evaluator import Evaluator

pytestmark = pytest.mark.system

POPULATION, GENERATIONS = 60, 300
SHELL = {
    "TRAMNET_POPULATION": str(POPULATION),
    "TRAMNET_GENERATIONS": str(GENERATIONS),
    "TRAMNET_PICTURES": "0",
    "TRAMNET_SNIFF": "1",
}
WORKERS = ("worker-1", "worker-2", "worker-3")


def machines(folder: Path, *names: str) -> Machines:
    """Return machines, or skip the test where none can be made."""
    made = Machines(folder)
    try:
        made.open()
    except (OSError, subprocess.CalledProcessError) as error:
        why = getattr(error, "stderr", None) or error
        pytest.skip(f"no namespaces, which need Linux, root and Debian's iproute2: {why}")
    for name in names:
        made.add(name)
    return made


@dataclass(frozen=True)
class Story:
    """What came of a run on five machines.

    Attributes:
        health: Health of each container, by its own check: (exit code, what it said).
        early: Health of a worker before there was a root.
        stopped: Exit code of the root when it was told to stop, and how long that took [s].
        checkpoints: Checkpoints that it left.
        codes: Exit codes of the containers at the end.
        result: The run's ``result.json``.
        seen: What the inspector showed.
    """

    health: dict[str, tuple[int, str]]
    early: tuple[int, str]
    stopped: tuple[int, float]
    checkpoints: list[str]
    codes: dict[str, int]
    result: dict[str, object]
    seen: str


@pytest.fixture(scope="module")
def story(tmp_path_factory) -> Iterator[Story]:
    folder = tmp_path_factory.mktemp("machines")
    with machines(folder, "root", *WORKERS, "inspector") as made:
        # So little, that the run goes on for as long as it is looked at; then the limit goes.
        for name in WORKERS:
            made.slow_down(name, "100kbit")
        workers = [made.start("worker", name, SHELL) for name in WORKERS]
        early = health(workers[0], "worker")
        root = made.start("root", "root", SHELL)
        wait_until(lambda: "3 workers" in health(root, "root")[1], "all workers")
        inspector = made.start("inspector", "inspector", SHELL)
        wait_until(lambda: "link/0/3" in inspector.output, "the inspector's view")
        checks = {"root": health(root, "root"), "inspector": health(inspector, "inspector")}
        checks |= {worker.name: health(worker, "worker") for worker in workers}

        inspector.signal(signal.SIGSTOP)
        began = time.monotonic()
        root.signal(signal.SIGTERM)
        stopped = root.finish(), time.monotonic() - began
        (run,) = (folder / "runs").iterdir()
        checkpoints = [path.name for path in run.glob("checkpoint-*")]

        for name in WORKERS:
            made.let_go(name)
        again = made.start("root", "root", SHELL, ["resume", f"runs/{run.name}"])
        codes = {"root": again.finish()}
        inspector.signal(signal.SIGCONT)
        codes |= {one.name: one.finish() for one in (inspector, *workers)}
        assert codes["root"] == 0, again.output
        result = json.loads((run / "result.json").read_text())
        yield Story(checks, early, stopped, checkpoints, codes, result, inspector.output)


def health(container: Container, service: str) -> tuple[int, str]:
    told = container.execute(health_check(service))
    return told.returncode, told.stdout + told.stderr


def in_one_process() -> tuple[str, float]:
    """Hash and best objective of the same run without any network."""
    choice = puma560.Choice(None, None, "akb", "wang-zalzala", 1, POPULATION, GENERATIONS, {}, None)
    experiment = puma560.prepare(puma560.options_of(choice))
    engine, evaluator = experiment.engine, Evaluator(experiment.setup)
    while not engine.finished:
        for work in engine.ask():
            engine.tell(work, evaluator.compute(work))
    return population_hash(engine), engine.best.objective


def test_a_run_over_real_addresses_comes_out_as_in_one_process(story):
    digest, objective = in_one_process()

    assert story.result["final_population_sha256"] == digest
    assert story.result["best"]["objective"] == objective
    assert story.result["evaluations"] == POPULATION * GENERATIONS
    assert story.result["condemned"] == []


def test_every_service_tells_that_it_is_well(story):
    assert {name: code for name, (code, _) in story.health.items()} == dict.fromkeys(
        ("root", "inspector", *WORKERS), 0
    )
    assert "1 of 1 workers are in a network" in story.health["worker-2"][1]
    assert "3 workers" in story.health["inspector"][1]


def test_a_worker_without_a_root_is_not_well(story):
    code, said = story.early

    assert code == 1
    assert "expected" in said or "look for their root" in said


def test_a_root_that_is_told_to_stop_leaves_a_checkpoint_within_its_grace(story):
    code, seconds = story.stopped

    assert code == 130
    assert seconds < float(SERVICES["root"]["stop_grace_period"].removesuffix("s"))
    assert story.checkpoints


def test_workers_wait_for_the_root_to_come_back_and_end_in_peace(story):
    assert {story.codes[name] for name in WORKERS} == {0}


def test_an_inspector_that_was_stopped_over_the_end_of_the_root_cost_the_run_nothing(story):
    assert story.result["lost_workers"] == 0
    assert story.codes["inspector"] == 0
    assert "network tramnet has ended" in story.seen


def test_nothing_of_the_machines_is_left_when_something_goes_wrong(tmp_path):
    pids: list[int] = []

    def go_wrong(made: Machines) -> None:
        root = made.start("worker", "root", {"TRAMNET_COUNT": "2"})
        pids.extend([root.process.pid, root.first])
        wait_until(lambda: len(descendants(root.first)) == 2, "its workers")
        pids.extend(descendants(root.first))
        assert set(made.namespaces) <= namespaces()
        raise ZeroDivisionError

    with machines(tmp_path, "root") as made, pytest.raises(ZeroDivisionError):
        go_wrong(made)

    assert not any(map(is_alive, pids))
    assert not set(made.namespaces) & namespaces()
