"""Starts worker processes, watches them, replaces those that end, and takes all of them along when it ends.

A worker is a new interpreter (never a fork: Zenoh's threads do not survive one). Two ties keep it from
outliving its supervisor, however that ends: end-of-file on an inherited pipe, which the worker watches, and
the kernel's parent-death signal, which needs no working interpreter on the other side.

One thread owns all processes; the others only leave wishes. A process that dies is started again: at once the first
time, then after a pause that doubles while it keeps failing. One that ends by itself, because it was told to or
found nobody to work for, is not.
"""

import contextlib
import logging
import os
import secrets
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

POLL = 0.02
"""Period at which ended processes are noticed [s]."""

STEADY = 5.0
"""A process that lived this long did not fail to start [s]."""

LONGEST_PAUSE = 5.0
"""Upper limit of the pause before a failing process is started again [s]."""

GRACE = 1.5
"""Time a process has to end by itself when the supervisor closes [s]."""

TOLD_TO_END = 100
"""Exit status of a worker that was told to end; not 0, with which an evaluation may end its process."""

GAVE_UP = 101
"""Exit status of a worker that is of no use here: it was refused, or found no root."""

CRASHED = 102
"""Exit status of a worker that met what it should not."""

_log = logging.getLogger(__name__)

_ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}


@dataclass
class _Post:
    """A place for one process at a time."""

    process: subprocess.Popen[bytes] | None = None
    started: float = 0.0
    pause: float = 0.0
    due: float = 0.0
    retired: bool = False

    def failed(self, now: float) -> None:
        """Begin the pause before the next start, and make the one after it longer."""
        self.due = now + self.pause
        self.pause = min(max(2 * self.pause, 0.1), LONGEST_PAUSE)


@dataclass(frozen=True)
class Ended:
    """A worker process ended.

    Attributes:
        pid: Its process id.
        status: Its exit status; negative is the signal that ended it.
        surplus: Whether its supervisor ended it, to keep fewer.
    """

    pid: int
    status: int
    surplus: bool = False

    @property
    def died(self) -> bool:
        """Whether it neither was told to end nor gave up."""
        return not self.surplus and self.status not in (TOLD_TO_END, GAVE_UP)


@dataclass
class _Wishes:
    count: int = 0
    replace: set[int] = field(default_factory=set)
    closing: bool = False


def new_name() -> str:
    """Return a name for a supervisor that no other has, in a container of the same name or not."""
    return f"{socket.gethostname()}-{os.getpid()}-{secrets.token_hex(4)}"


class Supervisor:
    """Keeps a number of worker processes alive.

    Args:
        arguments: Arguments of ``python -m tramnet_workers.node``.
        count: Number of processes to keep.
        notify: Called, on the supervisor's thread, for each process that ended before ``close``.

    Attributes:
        finished: Set when every process has ended and none is to be started again.
    """

    def __init__(
        self, arguments: Sequence[str], count: int, notify: Callable[[Ended], None]
    ) -> None:
        self._command = [sys.executable, "-m", "tramnet_workers.node", *arguments]
        self._notify = notify
        self._posts: list[_Post] = []
        self._wishes = _Wishes(count=count)
        self._changed = threading.Condition()
        self._pids: frozenset[int] = frozenset()
        self.finished = threading.Event()
        # Not a daemon: the parent-death signal is tied to the thread that started a process.
        self._thread = threading.Thread(target=self._run, name="supervisor")
        self._thread.start()

    @property
    def count(self) -> int:
        """Number of processes wanted."""
        return self._wishes.count

    @property
    def pids(self) -> frozenset[int]:
        """Process ids of the live workers."""
        return self._pids

    def scale(self, count: int) -> None:
        """Change the number of processes; the newest end first.

        Args:
            count: Number of processes to keep from now on.
        """
        with self._changed:
            self._wishes.count = count
            self._changed.notify()

    def replace(self, pid: int) -> bool:
        """End a process that overran and start another in its place.

        Args:
            pid: Its process id; ignored when it is none of ours.

        Returns:
            Whether it was one of ours.
        """
        if pid not in self._pids:
            return False
        with self._changed:
            self._wishes.replace.add(pid)
            self._changed.notify()
        return True

    def close(self) -> None:
        """End all processes: first by end-of-file, after a moment of grace by force."""
        with self._changed:
            self._wishes.closing = True
            self._changed.notify()
        self._thread.join()

    def __enter__(self) -> "Supervisor":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        while True:
            with self._changed:
                if self._wishes.closing:
                    break
                self._changed.wait(POLL)
                replace, self._wishes.replace = self._wishes.replace, set()
                count = self._wishes.count
            now = time.monotonic()
            for post in self._posts:
                if post.process is not None and post.process.pid in replace:
                    post.process.kill()
            self._reap(now)
            self._resize(count)
            self._start(now)
        _end([post.process for post in self._posts if post.process is not None])
        self._pids = frozenset()

    def _reap(self, now: float) -> None:
        for post in self._posts:
            process = post.process
            if process is None or process.poll() is None:
                continue
            _close_pipe(process)
            post.process = None
            ended = Ended(process.pid, process.returncode)
            post.retired = not ended.died
            post.failed(now)
            if now - post.started >= STEADY:
                post.pause = 0.0
            self._notify(ended)

    def _resize(self, count: int) -> None:
        while len(self._posts) < count:
            self._posts.append(_Post())
        surplus = [post.process for post in self._posts[count:] if post.process is not None]
        del self._posts[count:]
        _end(surplus)
        for process in surplus:
            self._notify(Ended(process.pid, process.returncode, surplus=True))

    def _start(self, now: float) -> None:
        for post in self._posts:
            if post.process is None and not post.retired and now >= post.due:
                self._start_at(post, now)
        self._pids = frozenset(post.process.pid for post in self._posts if post.process is not None)
        if self._posts and all(post.retired for post in self._posts):
            self.finished.set()

    def _start_at(self, post: _Post, now: float) -> None:
        try:
            post.process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                start_new_session=True,
                env={**os.environ, **_ONE_THREAD},
            )
        except OSError as error:  # no memory, process or descriptor is left
            # Were this thread to end, the kernel would end all workers with it.
            post.failed(now)
            _log.error("cannot start a worker, trying again in %.1f s: %s", post.due - now, error)
        else:
            post.started = now


def _end(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        _close_pipe(process)
    deadline = time.monotonic() + GRACE
    for process in processes:
        try:
            process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _close_pipe(process: subprocess.Popen[bytes]) -> None:
    if process.stdin is not None:
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
