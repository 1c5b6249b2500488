"""However a run is ended, it says how to go on, its checkpoint is written and no process of it is left."""

import os
import pty
import select
import signal
import threading
import time

import pytest
from processes import Run, descendants, is_alive, wait_until
from undisturbed import SPHERE, assert_undisturbed

pytestmark = pytest.mark.system

RUN = (*SPHERE, "--generations", 400, "--set", "delay=0.002", "--workers", 2)
GRACE = 2.0
"""Longest life of a worker after its root [s]."""


def assert_nobody_is_left(pids: list[int], ended: float) -> None:
    """Assert that processes end within the grace after a moment, on a machine that does much else."""
    wait_until(lambda: not any(map(is_alive, pids)), "the workers to end")
    assert time.monotonic() - ended < 3 * GRACE


def assert_ended_in_order(run: Run, pids: list[int]) -> None:
    code = run.finish()
    ended = time.monotonic()
    assert code == 130, run.output
    assert_nobody_is_left(pids, ended)
    assert list(run.folder.glob("checkpoint-*.tramnet"))


@pytest.mark.parametrize(
    "number", [signal.SIGTERM, *(pytest.param(n, marks=pytest.mark.slow) for n in (signal.SIGINT, signal.SIGHUP))]
)  # fmt: skip
def test_a_signal_ends_a_run_in_order(start, number):
    before = signal.signal(
        number, signal.SIG_DFL
    )  # tests that run under nohup hand down that it is ignored
    try:
        run = start(*RUN)
    finally:
        signal.signal(number, before)
    run.wait_for_generation(2)
    pids = descendants(run.pid)

    run.process.send_signal(number)

    assert_ended_in_order(run, pids)
    assert run.output.split()[-3:] == ["tramnet", "resume", str(run.folder)]


class Window:
    """Shows what is written to a terminal, until it is closed."""

    def __init__(self) -> None:
        self._screen, self.terminal = pty.openpty()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._show)
        self._thread.start()

    def _show(self) -> None:
        while not self._closing.is_set():
            if select.select([self._screen], [], [], 0.02)[0]:
                os.read(self._screen, 65536)
        os.close(self._screen)

    def close(self) -> None:
        self._closing.set()
        self._thread.join()


@pytest.fixture
def window():
    window = Window()
    yield window
    window.close()


def test_a_closed_terminal_ends_a_run_in_order(start, window):
    within = ("setsid", "--ctty", "--wait", "env", "COLUMNS=100")
    run = start(*RUN, within=within, terminal=window.terminal)
    os.close(window.terminal)
    run.wait_for_generation(2)
    pids = run.wait_for_workers(2)

    window.close()

    assert_ended_in_order(run, pids)


@pytest.mark.slow
def test_a_second_signal_ends_a_run_at_once(start):
    run = start(*RUN)
    run.wait_for_generation(2)
    pids = descendants(run.pid)
    for _ in range(2):
        run.process.send_signal(signal.SIGINT)
        time.sleep(0.05)

    assert run.finish() == 130
    assert_nobody_is_left(pids, time.monotonic())


@pytest.mark.slow
def test_a_signal_during_the_start_ends_a_run_too(start):
    run = start(*RUN)
    wait_until((run.folder / "run.toml").exists, "the run file")

    run.process.send_signal(signal.SIGTERM)

    assert run.finish() == 130
    assert f"tramnet resume {run.folder}" in run.output.replace("\n", " ")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_workers_from_elsewhere_end_with_their_command(start, number):
    run = start(*SPHERE, "--generations", 30, "--set", "delay=0.002", "--workers", 0)
    run.wait_for_generation(0)
    workers = start("worker", "--count", 2)
    pids = run.wait_for_workers(2)

    workers.process.send_signal(number)
    code = workers.finish()
    ended = time.monotonic()

    assert code == (0 if number == signal.SIGTERM else -number), workers.output
    assert_nobody_is_left(pids, ended)
    assert start("scale", 1).finish() == 0
    assert_undisturbed(run)
