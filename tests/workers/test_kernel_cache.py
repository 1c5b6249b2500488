"""The cache of compiled kernels: whose code it holds, and who may write there."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numba
import pytest

from tramnet_workers.kernels import cache
from tramnet_workers.kernels.cache import UnsafeCacheFolder, open_cache_folder, source_digest

KERNELS = Path(cache.__file__).parent

CALLEE = """
from tramnet_workers.kernels import kernel

@kernel
def factor():
    return {value}
"""
CALLER = """
from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.callee import factor

@kernel
def product(x):
    return factor() * x
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A small package with the real decorators and two kernels, one calling the other."""
    package = tmp_path / "source" / "tramnet_workers"
    kernels = package / "kernels"
    kernels.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    for name in ("__init__.py", "cache.py"):
        (kernels / name).write_text((KERNELS / name).read_text())
    (kernels / "callee.py").write_text(CALLEE.format(value=2.0))
    (kernels / "caller.py").write_text(CALLER)
    return package


@pytest.fixture
def cache_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    home = tmp_path / "cache"
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    return home


def run_product(package: Path, cache_home: Path) -> float:
    """Return product(21) as a fresh process computes it."""
    environment = os.environ | {
        "PYTHONPATH": str(package.parent),
        "XDG_CACHE_HOME": str(cache_home),
        "PYTHONDONTWRITEBYTECODE": "1",  # two edits within a second look alike to Python
    }
    code = "from tramnet_workers.kernels.caller import product; print(product(21.0))"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def compiled_files(cache_home: Path) -> int:
    return len(list(cache_home.rglob("*.nbc")))


def test_an_edited_callee_in_another_file_is_seen_despite_the_cache(
    package: Path, cache_home: Path
) -> None:
    assert run_product(package, cache_home) == 42.0

    (package / "kernels" / "callee.py").write_text(CALLEE.format(value=3.0))

    assert run_product(package, cache_home) == 63.0


def test_unchanged_kernels_are_loaded_and_not_compiled_again(
    package: Path, cache_home: Path
) -> None:
    run_product(package, cache_home)
    compiled = compiled_files(cache_home)
    newest = max(path.stat().st_mtime_ns for path in cache_home.rglob("*.nb?"))

    run_product(package, cache_home)

    assert compiled_files(cache_home) == compiled > 0
    assert max(path.stat().st_mtime_ns for path in cache_home.rglob("*.nb?")) == newest


def test_this_process_keeps_its_kernels_in_the_private_folder() -> None:
    folder = Path(numba.config.CACHE_DIR)

    assert folder.name == f"kernels-{source_digest(KERNELS.parent)[:32]}"
    assert folder.stat().st_mode & 0o777 == 0o700
    assert folder.stat().st_uid == os.getuid()


def test_a_new_folder_is_private_whatever_the_umask(package: Path, cache_home: Path) -> None:
    before = os.umask(0)
    try:
        folder = open_cache_folder(package)
    finally:
        os.umask(before)

    assert folder.parent.parent == cache_home
    assert folder.stat().st_mode & 0o777 == 0o700
    assert folder.parent.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("mode", [0o755, 0o770, 0o777])
def test_a_folder_that_others_can_enter_is_refused(
    package: Path, cache_home: Path, mode: int
) -> None:
    folder = open_cache_folder(package)
    folder.chmod(mode)

    with pytest.raises(UnsafeCacheFolder, match=f"of mode 0{mode:o}.*XDG_CACHE_HOME") as refusal:
        open_cache_folder(package)

    assert refusal.value.folder == folder


def test_a_folder_of_another_user_is_refused(
    package: Path, cache_home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_cache_folder(package)
    monkeypatch.setattr(os, "getuid", lambda: os.geteuid() + 1)

    with pytest.raises(UnsafeCacheFolder, match=f"owned by user {os.geteuid()}"):
        open_cache_folder(package)


def test_a_link_to_a_folder_is_refused(package: Path, cache_home: Path, tmp_path: Path) -> None:
    folder = open_cache_folder(package)
    folder.rmdir()
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    folder.symlink_to(tmp_path / "elsewhere")

    with pytest.raises(UnsafeCacheFolder, match="not a folder"):
        open_cache_folder(package)


def test_a_folder_that_nobody_used_for_a_month_is_removed(package: Path, cache_home: Path) -> None:
    folder = open_cache_folder(package)
    recent, forgotten = folder.with_name("kernels-recent"), folder.with_name("kernels-forgotten")
    for other, days in ((recent, 29), (forgotten, 31)):
        other.mkdir()
        (other / "product.nbc").touch()
        then = time.time() - days * 24 * 3600
        os.utime(other, (then, then))

    open_cache_folder(package)

    assert recent.exists()
    assert not forgotten.exists()


def test_a_folder_in_use_stays_however_old_its_contents(package: Path, cache_home: Path) -> None:
    folder = open_cache_folder(package)
    os.utime(folder, (0, 0))

    assert open_cache_folder(package).exists()


def test_a_cache_that_cannot_be_made_says_what_to_set(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", os.devnull)

    with pytest.raises(OSError, match="set XDG_CACHE_HOME"):
        open_cache_folder(package)


def test_a_relative_cache_home_is_ignored(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "somewhere")
    monkeypatch.setenv("HOME", str(tmp_path))

    assert cache.cache_home() == tmp_path / ".cache"


def test_the_digest_follows_kernels_outside_the_kernels_folder_and_what_they_import(
    package: Path,
) -> None:
    evolution = package / "evolution"
    evolution.mkdir()
    (evolution / "__init__.py").write_text("")
    (evolution / "streams.py").write_text("CROSSOVER = 1\n")
    (evolution / "crossover.py").write_text(
        "from tramnet_workers.kernels import kernel\n"
        "from tramnet_workers.evolution.streams import (\n    CROSSOVER,\n)\n\n"
        "@kernel\ndef cross():\n    return CROSSOVER\n"
    )
    before = source_digest(package)

    (evolution / "streams.py").write_text("CROSSOVER = 2\n")

    assert source_digest(package) != before


def test_the_digest_ignores_what_no_kernel_can_reach(package: Path) -> None:
    before = source_digest(package)

    (package / "reports.py").write_text("COLOUR = 'blue'\n")

    assert source_digest(package) == before


def test_a_moved_source_changes_the_digest(package: Path) -> None:
    before = source_digest(package)

    (package / "kernels" / "caller.py").rename(package / "kernels" / "called.py")

    assert source_digest(package) != before
