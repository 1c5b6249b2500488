"""Files written so that a crash leaves the old one or the new one, never half of either.

A file is written beside its final name, forced to the disk, and renamed over it; then the folder is
forced to the disk, so that the rename survives a power cut too. What the system refuses becomes
``CannotWrite``.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tramnet_master.errors import CannotWrite

TEMPORARY_SUFFIX = ".writing"


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn what the system refuses while ``path`` is written into ``CannotWrite``."""
    try:
        yield
    except OSError as error:
        raise CannotWrite(path, error.strerror or str(error)) from error


def write_atomically(path: Path, content: bytes) -> None:
    """Put ``content`` under the name ``path``, whole or not at all.

    Args:
        path: The file; its folder exists.
        content: All of its bytes.

    Raises:
        CannotWrite: The disk is full, read-only or not ours; what stood there is untouched.
    """
    temporary = path.with_name(path.name + TEMPORARY_SUFFIX)
    with writing(path):
        try:
            _write_through(temporary, content)
            os.replace(temporary, path)
        except OSError:
            temporary.unlink(missing_ok=True)
            raise
        _force_folder(path.parent)


def _write_through(path: Path, content: bytes) -> None:
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _force_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
