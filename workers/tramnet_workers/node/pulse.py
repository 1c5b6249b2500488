"""Signs of life on a worker's own machine, for whoever watches over it there: a health check for one.

A worker that has a seat touches a file of its own at each heartbeat. One that looks for a root does not, nor does
one whose interpreter hangs. Nothing is asked of the network: a worker's certificate may not allow it to ask.
"""

import contextlib
import os
import time
from pathlib import Path

STALE = 5.0
"""Age of a sign of life that is none any more [s]: heartbeats come once a second."""


class Pulse:
    """The pulse of this process.

    Args:
        folder: Where its file is to be, or None where nobody watches.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._file = folder / str(os.getpid()) if folder else None

    def beat(self) -> None:
        """Leave a sign of life."""
        if self._file is not None:
            with contextlib.suppress(OSError):  # a full disk is no reason to stop working
                self._file.touch()


def beating(folder: Path) -> int:
    """Return how many live processes left a sign of life in a folder lately."""
    return sum(_is_fresh(file) and _is_alive(int(file.name)) for file in folder.glob("[0-9]*"))


def _is_fresh(file: Path) -> bool:
    try:
        return time.time() - file.stat().st_mtime < STALE
    except FileNotFoundError:
        return False


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
