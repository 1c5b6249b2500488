"""Where compiled kernels are kept: a private folder per state of the kernel sources.

Numba recompiles a function when its own file changes, but not when a function that it calls
changes in another file. So the folder is named by the SHA-256 of every source that can end up
in machine code, and an edit anywhere opens a new, empty one. Numba loads what it finds there
with pickle, hence nobody else may be able to write into it.
"""

import contextlib
import hashlib
import os
import re
import shutil
import stat
import time
from pathlib import Path

_DECORATED = re.compile(rb"^[ ]*@(?:kernel|device)\b", re.MULTILINE)
_IMPORT = re.compile(
    rb"^(?:from[ ]+(tramnet_workers[\w.]*)[ ]+import[ ]+(\([^)]*\)|[^\n]*)"
    rb"|import[ ]+(tramnet_workers[\w.]*))",
    re.MULTILINE,
)

_KEPT_FOR = 30 * 24 * 3600  # seconds since a folder's last use


class UnsafeCacheFolder(RuntimeError):
    """The folder for compiled kernels can be written by somebody else.

    Attributes:
        folder: The folder that was found.
    """

    def __init__(self, folder: Path, found: str) -> None:
        self.folder = folder
        super().__init__(
            f"the kernel cache {folder} is {found}, but compiled code is only loaded from a folder "
            f"owned by user {os.getuid()} with mode 0700; remove it, or set XDG_CACHE_HOME to a "
            f"folder of your own"
        )


def open_cache_folder(package: Path) -> Path:
    """Create, or check, the private folder for the kernels of a package.

    Args:
        package: Folder of ``tramnet_workers``.

    Returns:
        A folder of mode 0700 named by ``source_digest``.

    Raises:
        UnsafeCacheFolder: If an existing folder has another owner, mode or kind.
        OSError: If the folder cannot be made.
    """
    folder = cache_home() / "tramnet" / f"kernels-{source_digest(package)[:32]}"
    for private in (folder.parent, folder):
        _make(private)
        _check_private(private)
    os.utime(folder)
    _remove_unused(folder.parent)
    return folder


def cache_home() -> Path:
    """Return ``$XDG_CACHE_HOME``, or ``~/.cache`` (XDG base directory specification 0.8)."""
    configured = os.environ.get("XDG_CACHE_HOME", "")
    # The specification says that a relative path is to be ignored.
    return Path(configured) if os.path.isabs(configured) else Path.home() / ".cache"


def source_digest(package: Path) -> str:
    """Return the SHA-256 of all sources that can end up in a kernel's machine code.

    These are the files with decorated functions and, since compiled code freezes the constants
    that it reads, everything of the package that they import, directly or not.
    """
    digest = hashlib.sha256()
    for path, source in sorted(_kernel_sources(package).items()):
        digest.update(f"{path.relative_to(package).as_posix()} {len(source)}\n".encode())
        digest.update(source)
    return digest.hexdigest()


def _kernel_sources(package: Path) -> dict[Path, bytes]:
    sources = {path: path.read_bytes() for path in package.rglob("*.py")}
    waiting = [path for path, source in sources.items() if _DECORATED.search(source)]
    reached: dict[Path, bytes] = {}
    while waiting:
        path = waiting.pop()
        if path in sources and path not in reached:
            reached[path] = sources[path]
            waiting += _imported_paths(package, sources[path])
    return reached


def _imported_paths(package: Path, source: bytes) -> list[Path]:
    """List the files that the imports of a source may mean; some may not exist."""
    modules: list[str] = []
    for origin, names, module in _IMPORT.findall(source):
        parent = (origin or module).decode()
        modules += [parent, *(f"{parent}.{name}" for name in re.findall(r"\w+", names.decode()))]
    stems = [package.parent.joinpath(*module.split(".")) for module in modules]
    return [p for stem in stems for p in (stem.with_suffix(".py"), stem / "__init__.py")]


def _make(folder: Path) -> None:
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except FileExistsError:
        pass  # and is no folder, which the check says better
    except OSError as error:
        raise OSError(
            f"cannot make the kernel cache {folder} ({error}); set XDG_CACHE_HOME to a folder of "
            f"your own"
        ) from error


def _remove_unused(parent: Path) -> None:
    """Remove the folders of old sources: each process that opens a folder renews its date."""
    oldest = time.time() - _KEPT_FOR
    for folder in parent.glob("kernels-*"):
        with contextlib.suppress(FileNotFoundError):  # another process may be at it too
            if folder.lstat().st_mtime < oldest:
                shutil.rmtree(folder, ignore_errors=True)


def _check_private(folder: Path) -> None:
    status = folder.lstat()  # a symbolic link is nobody's private folder
    if not stat.S_ISDIR(status.st_mode):
        raise UnsafeCacheFolder(folder, "not a folder")
    if status.st_uid != os.getuid():
        raise UnsafeCacheFolder(folder, f"owned by user {status.st_uid}")
    if stat.S_IMODE(status.st_mode) != 0o700:
        raise UnsafeCacheFolder(folder, f"of mode {stat.S_IMODE(status.st_mode):04o}")
