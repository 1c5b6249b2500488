"""Packages of a user's own, put where the processes of a test find installed ones, entry points included."""

from pathlib import Path

import pytest


def install(
    folder: Path, monkeypatch: pytest.MonkeyPatch, module: str, source: str, builder: str
) -> None:
    """Install a module that brings the problem of its own name.

    Args:
        folder: Where to make the folder of packages.
        monkeypatch: Undoes it after the test.
        module: Name of the module and of the problem.
        source: Its code.
        builder: Name of the function that builds the problem.
    """
    site = folder / "site"
    information = site / f"{module}-1.0.dist-info"
    information.mkdir(parents=True)
    (site / f"{module}.py").write_text(source)
    (information / "METADATA").write_text(f"Name: {module}\nVersion: 1.0\n")
    entry = f"[tramnet.problems]\n{module} = {module}:{builder}\n"
    (information / "entry_points.txt").write_text(entry)
    monkeypatch.setenv("PYTHONPATH", str(site), prepend=":")
