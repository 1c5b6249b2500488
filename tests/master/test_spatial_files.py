from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.errors import InvalidFile
from tramnet_master.spatial_files import read_spatial_task
from tramnet_workers.problems.spatial_task import SpatialTask
from tramnet_workers.robots.revolute_chain import ChainRow

POINTS = "[points]\nlist = [[0.55, 0.2, 0.2], [0.55, 0.0, 0.4]]\n"
ARM = """
[arm]
a_m = [0.0, 0.3]
d_m = [0.1, 0.0]
alpha_rad = [1.5, 0.0]
designed = ["", "a"]
scale_m = 0.2
[limits]
lower_rad = [-1, -2]
upper_rad = [1, 2]
"""
angle = st.floats(-3.0, 3.0)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "task.toml"


def read(path: Path, text: str) -> SpatialTask:
    path.write_text(text)
    return read_spatial_task(path)


def complaint(path: Path, text: str) -> InvalidFile:
    with pytest.raises(InvalidFile) as caught:
        read(path, text)
    return caught.value


def test_points_are_all_that_a_spatial_task_needs(path):
    task = read(path, POINTS)

    assert task == SpatialTask(points=((0.55, 0.2, 0.2), (0.55, 0.0, 0.4)))


def test_an_arm_of_one_s_own_may_have_any_number_of_joints(path):
    task = read(path, POINTS + ARM)

    assert task.arm == (
        ChainRow(0.0, 0.1, 1.5, "", -1.0, 1.0),
        ChainRow(0.3, 0.0, 0.0, "a", -2.0, 2.0),
    )
    assert task.scale == 0.2


def test_base_genes_and_weights_are_heeded(path):
    task = read(
        path,
        f"{POINTS}closed = false\n[base]\nlower_m = [0, 0, 0]\nupper_m = [1, 2, 3]\n"
        "[genes]\nbits = 12\nlower_m = 0.2\nupper_m = 0.4\n[weights]\nlc = 3\n",
    )

    assert (task.base_lower, task.base_upper) == ((0.0, 0.0, 0.0), (1.0, 2.0, 3.0))
    assert (task.bits, task.lengths, task.weights) == (12, (0.2, 0.4), {"lc": 3.0})
    assert not task.closed


def test_a_given_base_stays_where_it_is(path):
    task = read(path, f"{POINTS}[base]\nfree = false\nposition_m = [0.1, 0.2, 0.3]\n")

    assert task.base_lower == task.base_upper == (0.1, 0.2, 0.3)


def test_points_may_stand_in_a_csv_file(path):
    (path.parent / "p.csv").write_text("x_m,y_m,z_m\n0.1,0.2,0.3\n")

    assert read(path, '[points]\ncsv = "p.csv"\n').points == ((0.1, 0.2, 0.3),)


@given(roll=angle, pitch=angle, yaw=angle)
def test_orientations_are_those_of_urdf(tmp_path_factory, roll, pitch, yaw):
    path = tmp_path_factory.mktemp("spatial") / "task.toml"
    text = f"[points]\nlist = [[0.5, 0, 0]]\nrpy_rad = [[{roll}, {pitch}, {yaw}]]\n"

    found = np.array(read(path, text).orientations[0])

    np.testing.assert_allclose(found, pin.rpy.rpyToMatrix(roll, pitch, yaw), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "field", "found"),
    [
        ("[points]\nlist = []\n", "points.list", "0 points"),
        ("[points]\nlist = [[0.5, 0.1]]\n", "points.list[0]", "[0.5, 0.1]"),
        ("[points]\ncircle = {count = 4}\n", "points.circle", "an unknown key"),
        (f"{POINTS}rpy_rad = [[0, 0, 0]]\n", "points.rpy_rad", "1 for 2 points"),
        (f"{POINTS}[base]\nlower_m = [1, 0, 0]\n", "base.lower_m[0]", "1.0"),
        (f"{POINTS}[genes]\nlower_m = 0.9\n", "genes.lower_m", "(0.9, 0.8)"),
        (f"{POINTS}[arm]\nscale_m = 0\n", "arm.scale_m", "0.0"),
        (f"{POINTS}[arm]\nd_m = [0.1]\n", "arm.d_m", "1 of them"),
        (f"{POINTS}[arm]\na_m = [0.1]\n", "arm.designed", "no designed length"),
        (f"{POINTS}[arm]\ndesigned = ['', 'x', '', '', '', '']\n", "arm.designed[1]", '"x"'),
        (f"{POINTS}[limits]\nlower_rad = [4, 0, 0, 0, 0, 0]\n", "limits.lower_rad[0]", "4.0"),
        (f"{POINTS}[weights]\nlc = -3\n", "weights.lc", "-3"),
    ],
)
def test_what_is_wrong_is_told_with_its_field(path, text, field, found):
    error = complaint(path, text)

    assert (error.field, error.found) == (field, found)
