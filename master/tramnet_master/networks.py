"""The networks that are alive on this machine: one locked file each, in a folder of the user's own.

A root holds an exclusive lock on ``<runtime folder>/tramnet/<network>.json`` for as long as it lives; the kernel
lets go of it however the root ends. The file says where to connect. ``scale``, ``inspect`` and the others read it.
"""

import contextlib
import fcntl
import json
import os
import stat
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from tramnet_master.errors import AmbiguousNetwork, NetworkTaken, NoNetwork, UnsafeFolder

DEFAULT_NETWORK = "tramnet"
"""Name of a network whose user gave none."""

GLANCE = 0.05
"""Longest time for which ``is_locked`` keeps the lock that it looks at [s]; it needs microseconds."""


@dataclass(frozen=True)
class LiveNetwork:
    """A running root.

    Attributes:
        network: Name of the network.
        endpoint: Where workers connect.
        observers: Where observers connect.
        pid: Process id of the root.
        folder: Its run folder.
    """

    network: str
    endpoint: str
    observers: str
    pid: int
    folder: str


def runtime_folder() -> Path:
    """Return the folder for sockets and locks, made private to this user.

    Raises:
        UnsafeFolder: It belongs to somebody else or others may write to it.
    """
    base = os.environ.get("XDG_RUNTIME_DIR")
    name = "tramnet" if base else f"tramnet-{os.getuid()}"
    folder = Path(base or tempfile.gettempdir()) / name
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    found = folder.stat()
    if found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) & 0o077:
        raise UnsafeFolder(folder, found.st_uid, stat.S_IMODE(found.st_mode))
    return folder


@contextlib.contextmanager
def hold(network: str) -> Iterator["Claim"]:
    """Claim a network name for this process.

    Args:
        network: Name of the network.

    Yields:
        The claim; ``announce`` makes the root findable.

    Raises:
        NetworkTaken: A live root holds that name.
    """
    path = runtime_folder() / f"{network}.json"
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        try:
            _lock(descriptor)
        except BlockingIOError as error:
            holder = _read(path)
            raise NetworkTaken(network, holder.pid if holder else None) from error
        os.ftruncate(descriptor, 0)
        yield Claim(descriptor)
        # Emptied, never unlinked: a new root may already be waiting for the lock on this very file.
        os.ftruncate(descriptor, 0)
    finally:
        os.close(descriptor)


def _lock(descriptor: int) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        time.sleep(GLANCE)  # perhaps somebody only looks whether it is locked
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


class Claim:
    """A held network name.

    Args:
        descriptor: The open, locked file.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def announce(self, live: LiveNetwork) -> None:
        """Write down where this root can be reached."""
        os.ftruncate(self._descriptor, 0)
        os.pwrite(self._descriptor, json.dumps(asdict(live)).encode(), 0)


def find(network: str | None = None) -> LiveNetwork:
    """Return the live network of that name, or the only live one.

    Args:
        network: Its name, or None for the only one.

    Raises:
        NoNetwork: None is alive, or none of that name.
        AmbiguousNetwork: Several are alive and no name was given.
    """
    live = {found.network: found for found in _live()}
    if network is not None:
        if network not in live:
            raise NoNetwork(network, sorted(live))
        return live[network]
    if not live:
        raise NoNetwork(None, [])
    if len(live) > 1:
        raise AmbiguousNetwork(sorted(live))
    return next(iter(live.values()))


def _live() -> Iterator[LiveNetwork]:
    for path in sorted(runtime_folder().glob("*.json")):
        found = _read(path)
        if found is not None and is_locked(path):
            yield found


def _read(path: Path) -> LiveNetwork | None:
    try:
        return LiveNetwork(**json.loads(path.read_text()))
    except (OSError, ValueError, TypeError):
        return None  # empty: claimed and not announced yet


def is_locked(path: Path) -> bool:
    """Return whether a live process holds the lock on a file."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    else:
        return False
    finally:
        os.close(descriptor)
