"""``docs/task-files.md``: its examples are good files, and its tables have every key that a file may have."""

import re
from pathlib import Path

import numpy as np
import pytest

from tramnet_master import configuration, design_files, spatial_files
from tramnet_master.configuration import read_motion_task
from tramnet_master.design_files import read_design_task
from tramnet_master.spatial_files import read_spatial_task
from tramnet_master.strict_toml import keys_of
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.spatial_task import SpatialTask
from tramnet_workers.robots.puma560 import akb, p560

DOCUMENT = Path(__file__).parents[2] / "docs" / "task-files.md"
KINDS = {
    "puma560": configuration._TaskFile,
    "crank": design_files._TaskFile,
    "crank --variant spatial": spatial_files._TaskFile,
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "task.toml"


def section(title: str) -> str:
    """What stands under a heading of the second level."""
    _, _, after = DOCUMENT.read_text().partition(f"\n## {title}\n")
    return after.partition("\n## ")[0]


def examples(title: str) -> list[str]:
    return re.findall(r"```toml\n(.*?)```", section(title), re.DOTALL)


def test_no_example_stands_outside_the_sections_that_are_read():
    assert sum(len(examples(title)) for title in KINDS) == DOCUMENT.read_text().count("```toml")


def test_the_examples_for_motions_are_good_files(path):
    paper, loaded = examples("puma560")

    path.write_text(paper)
    assert read_motion_task(path).arm == akb()
    path.write_text(loaded)
    task = read_motion_task(path)
    assert task.arm == p560().with_payload(1.5, (0.0, 0.0, 0.1))
    assert np.isinf(task.velocity_limits).tolist() == [False] * 5 + [True]
    assert (task.weights.torque, task.segments, task.margin_levels) == (0.06, 20, 2)


def test_the_examples_for_planar_designs_are_good_files(path):
    paper, design, given = examples("crank")

    path.write_text(paper)
    assert read_design_task(path) == DesignTask()
    path.write_text(design)
    task = read_design_task(path)
    assert (task.base.free, len(task.stock.lengths), len(task.boxes)) == (True, 5, 1)
    path.write_text(given)
    task = read_design_task(path)
    assert (task.lengths, task.mobility, task.base.free) == ((0.45, 0.35, 0.2), 0.3, True)
    assert task.extensions.tolist() == [0.0, 0.2, 0.0]


def test_the_examples_for_spatial_designs_are_good_files(path):
    usual, own = examples("crank --variant spatial")

    path.write_text(usual)
    assert read_spatial_task(path) == SpatialTask()
    path.write_text(own)
    task = read_spatial_task(path)
    assert len(task.orientations) == len(task.points) == 2
    assert task.base_lower == task.base_upper == (0.0, 0.0, 0.1)
    assert (task.bits, task.lengths, task.arm[5].d) == (12, (0.2, 0.6), 0.12)


@pytest.mark.parametrize("title", KINDS)
def test_every_key_has_its_row_and_every_row_a_key(title):
    table = section(title).partition("\n### ")[0]
    rows = re.findall(r"^\| `([\w.]+)` \|", table, re.MULTILINE)

    keys = {key.field for key in keys_of(KINDS[title])}
    tables = {field.rpartition(".")[0] for field in keys} - {"", "points.circle"}
    assert sorted(rows) == sorted(keys - tables)
