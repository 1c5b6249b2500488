"""The root is killed, its disk fails, its checkpoints rot: the run ends as if nothing had been, or says why not."""

import os
import random
import resource
import shutil
import socket
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from processes import Run, wait_until
from undisturbed import SPHERE, assert_undisturbed

pytestmark = pytest.mark.system

GENERATIONS = 60
RUN = (*SPHERE, "--generations", GENERATIONS, "--checkpoint-seconds", 0, "--set", "delay=0.001")
QUIET = ("--no-pictures", "--progress", "quiet")


def go_on(start: Callable[..., Run], folder: Path) -> Run:
    """Resume a run, or begin it where it was killed before its run file was on disk."""
    if (folder / "run.toml").exists():
        return start("resume", folder, *QUIET)
    return start(*RUN, "--workers", 2)


def checkpoints(folder: Path) -> list[Path]:
    return sorted(folder.glob("checkpoint-*.tramnet"))


def damage(folder: Path, chance: random.Random) -> bool:
    """Cut the newest checkpoint short or flip a bit of it, where there are two."""
    if len(checkpoints(folder)) < 2:
        return False
    path = checkpoints(folder)[-1]
    content = bytearray(path.read_bytes())
    at = chance.randrange(len(content))
    if chance.random() < 0.5:
        del content[at:]
    else:
        content[at] ^= 1 << chance.randrange(8)
    path.write_bytes(content)
    return True


def let_live(run: Run, chance: random.Random) -> None:
    """Let a root live for a while: any time from its start, or from its first checkpoint on."""
    before = checkpoints(run.folder)
    if chance.random() < 0.5:
        wait_until(lambda: run.ended or checkpoints(run.folder) != before, "a checkpoint")
    time.sleep(chance.uniform(0.0, 1.0))  # the moment is the point here


def free_endpoint() -> str:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{free.getsockname()[1]}"


def incarnation_of(run: Run, number: int) -> list[dict]:
    """What the log says of the first (0) or a later incarnation of the root."""
    log = run.events()
    opened = [i for i, entry in enumerate(log) if entry["event"] == "open"]
    return log[opened[number] : [*opened, len(log)][number + 1]]


@pytest.mark.parametrize(
    ("kills", "seed"), [(3, 1), pytest.param(20, 2, marks=pytest.mark.slow)], ids=["3", "20"]
)
def test_a_root_killed_at_random_moments_ends_as_if_it_had_not_been(start, tmp_path, kills, seed):
    chance, folder = random.Random(seed), tmp_path / "run"
    root, damaged = start(*RUN, "--workers", 2), 0
    for _ in range(kills):
        let_live(root, chance)
        root.process.kill()
        root.finish()
        damaged += damage(folder, chance)
        root = go_on(start, folder)

    assert_undisturbed(root)
    assert damaged
    log = (folder / "log.jsonl").read_text()
    assert 1 <= log.count("the checkpoint before it is used") <= damaged


def test_a_run_killed_before_its_first_checkpoint_starts_over(start):
    run = start(*SPHERE, "--generations", 10, "--checkpoint-seconds", 60, "--set", "delay=0.01")
    run.wait_for_generation(2)

    run.process.kill()
    run.finish()
    assert not list(run.folder.glob("checkpoint-*"))

    assert_undisturbed(start("resume", run.folder, *QUIET))


def test_workers_from_elsewhere_wait_for_the_next_incarnation_of_the_root_and_join_it(start):
    endpoint = free_endpoint()
    root = start(*RUN, "--workers", 0, "--listen", endpoint)
    workers = start("worker", "--connect", endpoint, "--count", 1)
    root.wait_for_generation(5)
    (joined,) = root.workers()

    root.process.kill()
    root.finish()
    resumed = start("resume", root.folder, *QUIET)

    assert_undisturbed(resumed)
    assert workers.finish() == 0, workers.output
    second = incarnation_of(root, 1)
    (again,) = [entry for entry in second if entry["event"] == "joined"]
    assert again["pid"] == joined
    assert (
        again["elapsed_s"] - second[0]["elapsed_s"] < 10.0
    )  # 1 s on a machine that does nothing else


def stopped_and_resumable(run: Run, why: str) -> None:
    assert run.finish() == 1
    words = run.output.replace("\n", " ")
    assert f"cannot be written: {why}" in words
    assert f"tramnet resume {run.folder}" in words
    assert checkpoints(run.folder)


def test_a_full_disk_stops_the_run_leaves_what_it_had_and_lets_workers_from_elsewhere_wait(start):
    endpoint = free_endpoint()
    run = start(*RUN, "--workers", 0, "--listen", endpoint)
    workers = start("worker", "--connect", endpoint, "--count", 1)
    (remote,) = run.wait_for_workers(1)
    run.wait_for_generation(3)

    resource.prlimit(run.pid, resource.RLIMIT_FSIZE, (1500, 1500))  # bytes a file may have

    stopped_and_resumable(run, "File too large")
    assert_undisturbed(start("resume", run.folder, *QUIET))
    assert workers.finish() == 0, workers.output
    assert {e["pid"] for e in incarnation_of(run, 1) if e["event"] == "joined"} == {remote}


def test_a_folder_that_becomes_read_only_stops_the_run_and_leaves_what_it_had(start):
    within: tuple[str, ...] = ()
    if os.geteuid() == 0:
        if shutil.which("setpriv") is None:
            pytest.skip(
                "a superuser writes where it likes, and there is no setpriv to be less than one"
            )
        within = ("setpriv", "--bounding-set", "-dac_override")
    run = start(*RUN, "--workers", 2, within=within)
    run.wait_for_generation(3)

    run.folder.chmod(0o500)

    stopped_and_resumable(run, "Permission denied")
    run.folder.chmod(0o700)
    assert_undisturbed(start("resume", run.folder, *QUIET))
