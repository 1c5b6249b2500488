"""Nothing that arrives or is read is unpickled: every process of a run is watched by an audit hook."""

import signal
import subprocess
import sys

import pytest

pytestmark = pytest.mark.system

WATCH = """
import os, sys

def watch(event, arguments):
    if event != "pickle.find_class":
        return
    frame = sys._getframe()
    while frame is not None:
        # The one exception: the private cache of compiled kernels, and the constants of kernels from it.
        if frame.f_code.co_filename.endswith(("numba/core/caching.py", "numba/core/serialize.py")):
            return
        frame = frame.f_back
    with open(os.environ["TRAMNET_TEST_UNPICKLED"], "a") as file:
        print(arguments, file=file)

sys.addaudithook(watch)
if "TRAMNET_TEST_WATCHED" in os.environ:
    with open(os.environ["TRAMNET_TEST_WATCHED"], "a") as file:
        print(os.getpid(), file=file)
"""
TASK = """
start_rad = [-0.3, 0.4, -0.18, 0.0, -0.05, 0.05]
goal_rad = [0.51, -0.42, 0.58, 0.87, 0.64, 0.84]
"""


@pytest.fixture
def watched(tmp_path, monkeypatch):
    """Has every interpreter watched; yields where the watched and the unpickled are written down."""
    site = tmp_path / "site"
    site.mkdir()
    (site / "sitecustomize.py").write_text(WATCH)
    monkeypatch.setenv("PYTHONPATH", str(site), prepend=":")
    monkeypatch.setenv("TRAMNET_TEST_WATCHED", str(tmp_path / "watched"))
    monkeypatch.setenv("TRAMNET_TEST_UNPICKLED", str(tmp_path / "unpickled"))
    return tmp_path / "watched", tmp_path / "unpickled"


def test_no_frame_checkpoint_or_task_file_is_unpickled(watched, start, tmp_path):
    processes, unpickled = watched
    (tmp_path / "task.toml").write_text(TASK)
    run = start("run", "puma560", "--task", tmp_path / "task.toml", "--population", 20,
                "--checkpoint-seconds", 0, "--generations", 1000)  # fmt: skip
    run.wait_for_generation(2)
    workers = run.workers()
    run.process.send_signal(signal.SIGINT)
    assert run.finish() == 130
    resumed = start("resume", run.folder, "--no-pictures", "--progress", "quiet")
    assert resumed.result()["generations"] == 1000

    assert {run.pid, *workers, resumed.pid} <= set(map(int, processes.read_text().split()))
    assert not unpickled.exists(), unpickled.read_text()


def test_the_hook_sees_what_is_unpickled(watched, tmp_path):

    _, unpickled = watched
    subprocess.run(
        [sys.executable, "-c", "import pickle; pickle.loads(pickle.dumps(print))"], check=True
    )

    assert "print" in unpickled.read_text()
