"""Problems by name: built-in ones, and those that other packages bring."""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pytest

from tramnet_workers.errors import BrokenProblem, UnknownProblem
from tramnet_workers.problems.grid_motion import GridMotion
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.registry import build, problem_names
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.puma560 import akb

ENTRY_POINTS = """\
[tramnet.problems]
their-problem = their_package:build
their-broken-problem = their_package:missing
their-constant = their_package:CONSTANT
"""

MODULE = """\
CONSTANT = 3


class Theirs:
    name = "their-problem"

    def __init__(self, parameters):
        self.parameters = dict(parameters)


def build(parameters):
    return Theirs(parameters)
"""


@pytest.fixture
def their_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Install a package with entry points, for as long as a test lasts."""
    (tmp_path / "their_package.py").write_text(MODULE)
    info = tmp_path / "their_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: their-package\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("their_package", None)


def test_a_built_in_problem_is_found_by_its_name() -> None:
    problem = GridMotion(MotionTask.for_arm(akb(), PAPER_START, PAPER_GOAL))

    built = build("puma560-grid", problem.parameters())

    assert isinstance(built, GridMotion)
    assert built.task == problem.task
    assert np.dtype(np.int16) == built.genome_dtype


@pytest.mark.usefixtures("their_package")
def test_an_installed_package_s_problem_is_found_by_its_name() -> None:
    parameters: Mapping[str, object] = {"size": 3}

    built = build("their-problem", parameters)

    assert built.name == "their-problem"
    assert {"their-problem", "puma560-grid"} <= set(problem_names())


def test_an_unknown_name_is_answered_with_the_known_ones() -> None:
    with pytest.raises(UnknownProblem) as caught:
        build("puma560-grit", {})

    assert caught.value.name == "puma560-grit"
    assert "puma560-grid" in caught.value.known
    assert "puma560-grid" in str(caught.value)


@pytest.mark.usefixtures("their_package")
@pytest.mark.parametrize("name", ["their-broken-problem", "their-constant"])
def test_a_problem_that_cannot_be_loaded_says_what_its_entry_point_names(name: str) -> None:
    with pytest.raises(BrokenProblem, match="their_package:"):
        build(name, {})


def test_names_are_sorted() -> None:
    names = problem_names()

    assert names == sorted(set(names))
