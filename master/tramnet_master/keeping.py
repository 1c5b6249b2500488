"""The workers that ``tramnet worker`` keeps on this machine: how many they should be, and how many do their duty.

Each such command has a folder of its own in the runtime folder while it lives: its workers leave their signs of
life there, and it holds a lock on a file that says how many they should be.
"""

import contextlib
import fcntl
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tramnet_master.networks import is_locked, runtime_folder
from tramnet_workers.node.pulse import beating

_WANTED = "wanted"


@dataclass(frozen=True)
class Kept:
    """What live commands keep here.

    Attributes:
        wanted: Workers there should be.
        connected: Workers that have a seat in a network and sent their heartbeat lately.
    """

    wanted: int = 0
    connected: int = 0


@contextlib.contextmanager
def keeping(count: int) -> Iterator[Path]:
    """Let others know that this process keeps workers.

    Args:
        count: How many.

    Yields:
        A folder for their signs of life.
    """
    folder = Path(tempfile.mkdtemp(prefix="workers-", dir=runtime_folder()))
    try:
        with (folder / _WANTED).open("w") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            file.write(str(count))
            file.flush()
            yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def kept_here() -> Kept:
    """Return what all live commands of this machine and user keep together."""
    wanted = connected = 0
    for folder in runtime_folder().glob("workers-*"):
        if is_locked(folder / _WANTED):  # else it is what a killed one left
            wanted += int((folder / _WANTED).read_text() or 0)
            connected += beating(folder)
    return Kept(wanted, connected)
