"""A supervisor over processes that are none: what it does when one ends, or cannot be started."""

import errno
import itertools
import time

import pytest

from tramnet_workers.node import supervisor
from tramnet_workers.node.supervisor import GAVE_UP, TOLD_TO_END, Ended, Supervisor, new_name


class Process:
    """A process that ends when its test wants it to, or its supervisor."""

    def __init__(self, pid):
        self.pid, self.returncode, self.stdin = pid, None, None

    def poll(self):
        return self.returncode

    def wait(self, timeout=None):
        self.returncode = 0 if self.returncode is None else self.returncode
        return self.returncode

    def kill(self):
        self.returncode = -9


class Machine:
    """Starts processes, and fails to as often as it is told."""

    def __init__(self):
        self.started = []
        self.failures = 0
        self._pids = itertools.count(100)

    def start(self, *_, **__):
        if self.failures:
            self.failures -= 1
            raise BlockingIOError(errno.EAGAIN, "no more processes")
        self.started.append(Process(next(self._pids)))
        return self.started[-1]


@pytest.fixture
def machine(monkeypatch):
    machine = Machine()
    monkeypatch.setattr(supervisor.subprocess, "Popen", machine.start)
    return machine


def wait_until(condition):
    end = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_process_that_cannot_be_started_is_tried_again_and_the_others_go_on(machine, caplog):
    with Supervisor([], 1, lambda _: None) as keeper:
        wait_until(lambda: keeper.pids == {100})
        machine.failures = 2
        keeper.scale(2)
        wait_until(lambda: keeper.pids == {100, 101})

    assert caplog.text.count("no more processes") == 2


def test_a_process_that_dies_is_started_again_and_told_of(machine):
    ended = []
    with Supervisor([], 1, ended.append) as keeper:
        wait_until(lambda: keeper.pids == {100})
        machine.started[0].returncode = -9
        wait_until(lambda: keeper.pids == {101})

    assert ended == [Ended(100, -9)]


def test_those_that_are_too_many_are_ended_and_told_of_and_did_not_die(machine):
    ended = []
    with Supervisor([], 3, ended.append) as keeper:
        wait_until(lambda: len(keeper.pids) == 3)
        keeper.scale(1)
        wait_until(lambda: len(ended) == 2)

    assert [one.pid for one in ended] == [101, 102]
    assert not any(one.died for one in ended)


@pytest.mark.parametrize("status", [TOLD_TO_END, GAVE_UP])
def test_all_that_ended_by_themselves_are_not_started_again(machine, status):
    with Supervisor([], 2, lambda _: None) as keeper:
        wait_until(lambda: len(keeper.pids) == 2)
        for process in machine.started:
            process.returncode = status

        assert keeper.finished.wait(10.0)

    assert len(machine.started) == 2


def test_no_two_supervisors_have_the_same_name():
    assert new_name() != new_name()
