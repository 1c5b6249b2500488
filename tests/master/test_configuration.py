from pathlib import Path

import numpy as np
import pytest

from tramnet_master.configuration import read_motion_task
from tramnet_master.errors import InvalidFile
from tramnet_workers.problems.motion_task import ObjectiveWeights
from tramnet_workers.robots.puma560 import akb, p560

ENDS = """
start_rad = [-0.3, 0.4, -0.18, 0.0, -0.05, 0.05]
goal_rad = [0.51, -0.42, 0.58, 0.87, 0.64, 0.84]
"""
EVERYTHING = f"""
robot = "p560"
{ENDS}
[limits]
torque_nm = [90, 180, 80, 20, 20, 20]
velocity_rad_s = [1.92, 1.51, 2.4, 5.34, 5.09, inf]
position_lower_rad = [-1, -1, -1, -1, -1, -1]
position_upper_rad = [1, 1, 1, 1, 1, 1]

[payload]
mass_kg = 1.5
centre_m = [0.0, 0.0, 0.1]

[objective]
time = 2
torque = 0.06
end_velocity = 0.2

[grid]
segments = 25
margin_levels = 3
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "pick.toml"


def complaint(path: Path, text: str) -> InvalidFile:
    path.write_text(text)
    with pytest.raises(InvalidFile) as caught:
        read_motion_task(path)
    return caught.value


def test_start_and_goal_are_all_that_a_task_needs(path):
    path.write_text(ENDS)

    task = read_motion_task(path)

    assert task.arm == akb()
    np.testing.assert_array_equal(task.start, [-0.3, 0.4, -0.18, 0.0, -0.05, 0.05])
    np.testing.assert_array_equal(task.goal, [0.51, -0.42, 0.58, 0.87, 0.64, 0.84])
    np.testing.assert_array_equal(task.torque_limits, akb().torque_limits)
    assert np.isinf(task.velocity_limits).all()
    np.testing.assert_array_equal(task.position_lower, akb().position_lower)
    assert task.weights == ObjectiveWeights(1.0, 0.0, 0.1)
    assert (task.segments, task.margin_levels) == (16, 0)


def test_every_key_of_a_task_is_heeded(path):
    path.write_text(EVERYTHING)

    task = read_motion_task(path)

    assert task.arm == p560().with_payload(1.5, (0.0, 0.0, 0.1))
    np.testing.assert_array_equal(task.torque_limits, [90, 180, 80, 20, 20, 20])
    np.testing.assert_array_equal(task.velocity_limits, [1.92, 1.51, 2.4, 5.34, 5.09, np.inf])
    np.testing.assert_array_equal(task.position_lower, [-1] * 6)
    np.testing.assert_array_equal(task.position_upper, [1] * 6)
    assert task.weights == ObjectiveWeights(2.0, 0.06, 0.2)
    assert (task.segments, task.margin_levels) == (25, 3)


def test_start_and_goal_may_be_named_without_their_unit(path):
    path.write_text(ENDS.replace("_rad", ""))

    np.testing.assert_array_equal(read_motion_task(path).goal[:2], [0.51, -0.42])


@pytest.mark.parametrize(
    ("old", "new", "field", "found", "expected"),
    [
        ("0.05]", "0.05, 1]", "start_rad", "7 numbers", "6 numbers, one for each joint"),
        (", 0.05]", "]", "start_rad", "5 numbers", "6 numbers, one for each joint"),
        ("[-0.3", "[nan", "start_rad[0]", "nan", "a number"),
        ("[0.51", "[inf", "goal_rad[0]", "inf", "a finite number"),
        ("[-0.3", "[-2.8", "start_rad[0]", "-2.8", "an angle in the joint's range"),
        ("-0.42", "-4.0", "goal_rad[1]", "-4.0", "an angle in the joint's range"),
        ("goal_rad", "goal_deg", "goal_deg", "an unknown key", "one of start_rad, goal_rad, robot"),
        ("goal_rad", "#", "goal_rad", "nothing", "one angle for each joint [rad]"),
        ("goal_rad", "goal = [1]\ngoal_rad", "goal_rad", "`goal` beside it", "one of"),
    ],
)
def test_a_wrong_start_or_goal_is_told_with_its_field(path, old, new, field, found, expected):
    error = complaint(path, ENDS.replace(old, new, 1))

    assert error.field == field
    assert error.found == found
    assert error.expected.startswith(expected)
    assert str(error).startswith(f"{path}: {field}: found ")


@pytest.mark.parametrize(
    ("addition", "field", "found"),
    [
        ("robot = 'puma'", "robot", '"puma"'),
        ("robot = 'arms/none.urdf'", "robot", '"arms/none.urdf"'),
        ("robot = 560", "robot", "560"),
        ("[limits]\ntorque_nm = [1, 2]", "limits.torque_nm", "2 numbers"),
        ("[limits]\ntorque_nm = [90, 180, 80, 20, 0, 20]", "limits.torque_nm[4]", "0.0"),
        ("[limits]\ntorque_nm = [90, 180, 80, 20, inf, 20]", "limits.torque_nm[4]", "inf"),
        ("[limits]\ntorque_nm = [90, 18, 80, 20, 20, 20]", "limits.torque_nm[1]", "18.0"),
        ("[limits]\nvelocity_rad_s = [1, 1, 1, 1, 1, -1]", "limits.velocity_rad_s[5]", "-1.0"),
        ("[limits]\nvelocity_rad_s = [1, 1, 1, 1, 1, nan]", "limits.velocity_rad_s[5]", "nan"),
        (
            "[limits]\nposition_upper_rad = [-3, 1, 1, 1, 1, 1]",
            "limits.position_lower_rad[0]",
            "-2.79",
        ),
        ("[payload]\nmass_kg = -1", "payload.mass_kg", "-1"),
        ("[payload]\nmass_kg = inf", "payload.mass_kg", "inf"),
        ("[payload]\ncentre_m = [0, 0]", "payload.centre_m", "[0, 0]"),
        ("[objective]\ntime = -1", "objective.time", "-1"),
        ("[objective]\ntime = 0", "objective", "0 for time and torque"),
        ("[objective]\ntimes = 1", "objective.times", "an unknown key"),
        ("[grid]\nsegments = 1", "grid.segments", "1"),
        ("[grid]\nsegments = 16.5", "grid.segments", "16.5"),
        ("[grid]\nmargin_levels = -1", "grid.margin_levels", "-1"),
    ],
)
def test_a_wrong_setting_is_told_with_its_field(path, addition, field, found):
    tables = addition.startswith("[")
    error = complaint(path, ENDS + addition if tables else addition + ENDS)

    assert error.field == field
    assert error.found.startswith(found)
    assert error.exit_code == 2


def test_start_equal_to_goal_in_all_joints_is_no_motion(path):
    ends = ENDS.splitlines()
    error = complaint(path, ends[1] + "\n" + ends[1].replace("start", "goal"))

    assert error.field == "goal_rad"
    assert error.found == "the start in all joints"


def test_a_joint_that_stays_where_it_is_is_ordinary(path):
    path.write_text(ENDS.replace("0.51", "-0.3"))

    assert read_motion_task(path).goal[0] == -0.3


def test_the_limits_of_a_message_have_the_names_of_the_file(path):
    error = complaint(path, ENDS + "[limits]\nposition_upper_rad = [-3, 1, 1, 1, 1, 1]")

    assert error.expected == "less than limits.position_upper_rad[0] = -3.0"


def test_angles_in_degrees_are_recognised(path):
    error = complaint(path, ENDS.replace("0.51", "45"))

    assert error.hint == "angles are in radians: 45 degrees are 0.785398 rad"


@pytest.mark.parametrize(("robot", "meant"), [("akp", "akb"), ("P560", "p560")])
def test_a_robot_that_was_probably_meant_is_named(path, robot, meant):
    error = complaint(path, f'robot = "{robot}"' + ENDS)

    assert error.hint == f'did you mean "{meant}"?'


def test_a_urdf_that_is_not_there_is_told_of_with_its_whole_path(path):
    error = complaint(path, 'robot = "arms/my.urdf"' + ENDS)

    assert error.hint == f"there is no file {path.parent / 'arms/my.urdf'}"


def urdf(kind: str = "revolute", effort: float = 50.0) -> str:
    """Two links of half a metre that turn in a horizontal plane."""
    link = """<link name="{0}"><inertial><origin xyz="0.25 0 0"/><mass value="2"/>
        <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial></link>"""
    joint = """<joint name="{0}" type="{4}"><parent link="{1}"/><child link="{2}"/>
        <origin xyz="{3} 0 0"/><axis xyz="0 0 1"/>
        <limit effort="{5}" velocity="3" lower="-2" upper="2"/></joint>"""
    parts = [link.format(name) for name in ("base", "upper", "lower")]
    parts.append(joint.format("shoulder", "base", "upper", 0, kind, effort))
    parts.append(joint.format("elbow", "upper", "lower", 0.5, kind, effort))
    return f'<robot name="planar">{"".join(parts)}</robot>'


def test_a_robot_may_be_a_urdf_file_beside_the_task(path):
    (path.parent / "arms").mkdir()
    (path.parent / "arms" / "planar.urdf").write_text(urdf())
    path.write_text('robot = "arms/planar.urdf"\nstart_rad = [0, 0]\ngoal_rad = [1, -1]\n')

    task = read_motion_task(path)

    assert task.n_joints == 2
    assert task.arm.joint_names == ("shoulder", "elbow")
    assert task.torque_limits.tolist() == [50.0, 50.0]
    assert task.velocity_limits.tolist() == [3.0, 3.0]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (urdf(kind="prismatic"), "shoulder"),
        (urdf(effort=0.0), "torque limit"),
        ("<robot", "planar"),
    ],
)
def test_a_urdf_that_is_no_serial_arm_is_told_of(path, content, reason):
    (path.parent / "planar.urdf").write_text(content)

    error = complaint(path, 'robot = "planar.urdf"\nstart_rad = [0, 0]\ngoal_rad = [1, -1]\n')

    assert error.field == "robot"
    assert reason in error.found
    assert error.expected == "a serial arm of revolute joints"
