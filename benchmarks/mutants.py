"""Every promise has a mechanism, and a test that misses it: each is removed in turn, and its test must fail.

    python -m benchmarks.mutants [NAME ...]

``tests/mutants/`` holds one small patch per promise of ``docs/reliability.md``. Each is applied to a copy of this
tree, whose tests that the patch names are run; the one that failed is printed. A patch that no test notices is a
promise that nobody keeps, and ends this with an error.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parents[1]
MUTANTS = HERE / "tests" / "mutants"
PATIENCE = 30
"""Longest wait of a test for a condition; here most of them wait in vain [s]."""

LONGEST_TEST = 100
"""Longest time of one test, which fails by it [s]."""

LONGEST = 300.0
"""Longest time for the tests of a mutant; one that hangs is noticed too [s]."""

_LEFT_BEHIND = (".git", ".venv", "__pycache__", ".*_cache", ".hypothesis", "runs", "dist")
_HEAD = re.compile(r"Promise: (?P<promise>.+)\nTests: (?P<tests>.+)\n")
_FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+?)(?:\[[^\n]*)?(?: - .*)?$", re.MULTILINE)


@dataclass(frozen=True)
class Mutant:
    """A promise without its mechanism.

    Attributes:
        path: The patch.
        promise: The promise, in words.
        tests: Arguments of pytest: the tests that must notice.
    """

    path: Path
    promise: str
    tests: tuple[str, ...]

    @classmethod
    def read(cls, path: Path) -> "Mutant":
        """Read a patch and what stands at its head."""
        head = _HEAD.match(path.read_text())
        assert head is not None, f"{path.name} begins with its promise and its tests"
        return cls(path, head["promise"], tuple(head["tests"].split()))

    def apply(self, tree: Path) -> None:
        """Remove the mechanism from a copy of this tree."""
        command = ["git", "apply", "--unidiff-zero", "--whitespace=nowarn", str(self.path)]
        subprocess.run(command, cwd=tree, check=True)


def all_mutants() -> list[Mutant]:
    """Return every mutant, in the order of names."""
    return [Mutant.read(path) for path in sorted(MUTANTS.glob("*.patch"))]


def failed_test(mutant: Mutant) -> str | None:
    """Return the first test that notices a mutant, or None where none does."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(HERE, tree, ignore=shutil.ignore_patterns(*_LEFT_BEHIND))
        mutant.apply(tree)
        parts = os.pathsep.join(str(tree / part) for part in ("protocol", "workers", "master"))
        path = os.pathsep.join(filter(None, (parts, os.environ.get("PYTHONPATH"))))
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-m", "slow or not slow"]
        command += ["-p", "no:cacheprovider", "--timeout", str(LONGEST_TEST), *mutant.tests]
        try:
            found = subprocess.run(
                command,
                cwd=tree,
                env={**os.environ, "PYTHONPATH": path, "TRAMNET_TEST_PATIENCE": str(PATIENCE)},
                capture_output=True,
                text=True,
                timeout=LONGEST,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return f"{mutant.tests[0]} hangs"
        if found.returncode == 0:
            return None
        failed = _FAILED.search(found.stdout)
        assert failed is not None, found.stdout + found.stderr
        return failed[1]


def main() -> None:
    """Try the mutants that were named, or all of them."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mutants")
    parser.add_argument("names", nargs="*", help="names of patches, without .patch")
    names = parser.parse_args().names
    survived = []
    for mutant in all_mutants():
        if names and mutant.path.stem not in names:
            continue
        began = time.monotonic()
        noticed = failed_test(mutant)
        print(f"{mutant.path.stem}: {mutant.promise}", flush=True)
        print(f"    {noticed or 'NOBODY NOTICES'} ({time.monotonic() - began:.0f} s)", flush=True)
        if noticed is None:
            survived.append(mutant.path.stem)
    if survived:
        sys.exit(f"nobody notices {', '.join(survived)}")


if __name__ == "__main__":
    main()
