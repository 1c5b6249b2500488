"""What a health check learns of the workers that are kept on its machine."""

import os
import subprocess
import sys
import time

import pytest

from tramnet_master.cli import run
from tramnet_master.keeping import Kept, keeping, kept_here
from tramnet_workers.node.pulse import STALE, Pulse


@pytest.fixture(autouse=True)
def private_runtime_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("COLUMNS", "200")


def test_where_nobody_keeps_workers_there_are_none():
    assert kept_here() == Kept(wanted=0, connected=0)


def test_a_worker_counts_from_its_first_heartbeat():
    with keeping(1) as folder:
        pulse = Pulse(folder)
        assert kept_here() == Kept(wanted=1, connected=0)

        pulse.beat()

        assert kept_here() == Kept(wanted=1, connected=1)


def test_several_commands_add_up():
    with keeping(1) as first, keeping(3):
        Pulse(first).beat()

        assert kept_here() == Kept(wanted=4, connected=1)


def test_a_worker_that_has_fallen_silent_does_not_count():
    with keeping(1) as folder:
        Pulse(folder).beat()
        long_ago = time.time() - STALE
        os.utime(folder / str(os.getpid()), (long_ago, long_ago))

        assert kept_here() == Kept(wanted=1, connected=0)


def test_a_worker_that_has_died_does_not_count():
    with keeping(1) as folder:
        child = subprocess.Popen([sys.executable, "-c", ""])
        child.wait()
        (folder / str(child.pid)).touch()

        assert kept_here() == Kept(wanted=1, connected=0)


def test_nothing_is_left_when_the_workers_are_given_up(tmp_path):
    with keeping(2) as folder:
        Pulse(folder).beat()

    assert not folder.exists()
    assert kept_here() == Kept()


def test_what_a_killed_command_left_does_not_count():
    with keeping(1) as folder:
        (folder.parent / "workers-killed").mkdir()
        (folder.parent / "workers-killed" / "wanted").write_text("5")

        assert kept_here().wanted == 1


def test_a_worker_without_a_folder_leaves_no_signs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    Pulse().beat()

    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("beats", "code", "said"),
    [(True, 0, "1 of 1 workers are in a network"), (False, 1, "0 of 1 workers are in a network;")],
)
def test_status_tells_it_in_an_exit_code(beats, code, said, capsys):
    with keeping(1) as folder:
        if beats:
            Pulse(folder).beat()

        assert run(["status", "--kept"]) == code

    captured = capsys.readouterr()
    assert said in captured.out + captured.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["status"], "none is live here"),
        (["status", "--kept"], "expected one that keeps workers"),
        (["status", "--connect", "ws/127.0.0.1:9"], "nobody answers at ws/127.0.0.1:9"),
    ],
)
def test_where_nothing_runs_nothing_is_well(words, said, capsys):
    assert run(words) == 1
    assert said in capsys.readouterr().err
