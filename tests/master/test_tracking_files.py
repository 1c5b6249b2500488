"""Task files of ``redundant8``: what they may leave out, and what is told of bad ones."""

import re
from pathlib import Path

import numpy as np
import pytest

from tramnet_master.errors import InvalidFile
from tramnet_master.tracking_files import read_scenes, read_tracking_task
from tramnet_workers.problems.tracking_task import TrackingTask, points_along
from tramnet_workers.robots.redundant8 import DH_ROWS, LINE, TOP_PLANE, redundant8

PAPER = TrackingTask.of_paper()

LINE_AND_BOX = """
[path]
points_cm = [[17.0, 57.6, 30.5], [11, 110, 40]]
[[box]]
lower_cm = [5, 50, 50]
upper_cm = [15, 100, 50]
"""
THREE_JOINTS = """
start_deg = [45.0, -19.471, 109.471]
box = []
[arm]
dh = [[0, 10, 0, 90], [0, 0, 30, 0], [0, 0, 20, 0]]
fixed_rows = []
[path]
points_cm = [[20, 20, 20], [10, 20, 20]]
steps = 50
"""
EVERYTHING = """
start_deg = [45.0, -19.471, 109.471]
[arm]
dh = [[0, 4, 0, 0], [0, 6, 0, 90], [0, 0, 30, 0], [0, 0, 20, 0]]
fixed_rows = [0]
radius_cm = 1.5
[path]
points_cm = [[20, 20, 20], [10, 20, 20], [10, 10, 20]]
steps = 40
[[box]]
lower_cm = [40, 0, 0]
upper_cm = [50, 10, 20]
[[box]]
lower_cm = [-50, 0, 0]
upper_cm = [-40, 10, 20]
[limits]
step_deg = [1, 2, 3.5]
zone_cm = 0.2
[weights]
error = 2
clearance = 0.5
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "shelf.toml"


def complaint(path: Path, text: str, read=read_tracking_task) -> InvalidFile:
    path.write_text(text)
    with pytest.raises(InvalidFile) as caught:
        read(path)
    assert caught.value.exit_code == 2
    return caught.value


@pytest.mark.parametrize(
    "text",
    [
        "",
        *(f"[{part}" for part in LINE_AND_BOX.split("\n[")[1:]),
        LINE_AND_BOX,
        "[arm]\nradius_cm = 0",
    ],
)
def test_what_a_file_leaves_out_is_the_paper_s(path, text):
    path.write_text(text)

    assert read_tracking_task(path) == PAPER


def test_every_key_of_a_task_is_heeded(path):
    path.write_text(EVERYTHING)

    task = read_tracking_task(path)

    assert task.n_joints == 3
    np.testing.assert_array_equal(task.start, np.radians([45.0, -19.471, 109.471]))
    np.testing.assert_array_equal(
        task.path, points_along([[20, 20, 20], [10, 20, 20], [10, 10, 20]], 40)
    )
    assert task.boxes.tolist() == [[40, 0, 0, 50, 10, 20], [-50, 0, 0, -40, 10, 20]]
    np.testing.assert_array_equal(task.step, np.radians([1, 2, 3.5]))
    assert (task.zone, task.radius) == (0.2, 1.5)
    assert (task.error_weight, task.clearance_weight) == (2.0, 0.5)


def test_the_paper_s_own_table_makes_the_paper_s_arm(path):
    rows = [[theta, 100 * d, 100 * a, alpha] for theta, d, a, alpha in DH_ROWS]
    path.write_text(f"[arm]\ndh = {rows}\n")

    task = read_tracking_task(path)

    postures = np.random.default_rng(3).uniform(-3.0, 3.0, (20, 8))
    np.testing.assert_allclose(
        task.chain.points(postures), PAPER.chain.points(postures), atol=1e-10
    )


def test_boxes_can_be_left_out_on_purpose(path):
    path.write_text("box = []\n")

    assert read_tracking_task(path).boxes.shape == (0, 6)


def test_a_path_may_stand_in_a_file_beside_the_task(path):
    (path.parent / "paths").mkdir()
    lines = ["x_cm,y_cm,z_cm", *(",".join(map(repr, point)) for point in LINE)]
    (path.parent / "paths" / "line.csv").write_text("\n".join(lines) + "\n")
    path.write_text('[path]\ncsv = "paths/line.csv"\n')

    assert read_tracking_task(path) == PAPER


def test_an_arm_may_be_a_urdf_file_beside_the_task(path):
    link, joint = (
        '<link name="{}"/>',
        (
            '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>'
            '<origin xyz="{3} 0 0"/><axis xyz="0 0 1"/>'
            '<limit effort="1" velocity="1" lower="-2" upper="2"/></joint>'
        ),
    )
    parts = [link.format(name) for name in ("base", "upper", "lower", "hand")]
    parts.append(joint.format("shoulder", "base", "upper", 0.0))
    parts.append(joint.format("elbow", "upper", "lower", 0.3))
    parts.append(joint.format("wrist", "lower", "hand", 0.2))
    (path.parent / "arm.urdf").write_text(f'<robot name="flat">{"".join(parts)}</robot>')
    path.write_text(
        'start_deg = [0, 90, 0]\nbox = []\n[arm]\nurdf = "arm.urdf"\n'
        "[path]\npoints_cm = [[30, 20, 0], [29, 20, 0]]\nsteps = 10\n"
    )

    task = read_tracking_task(path)

    assert task.arm.joint_names == ("shoulder", "elbow", "wrist")
    np.testing.assert_allclose(task.chain.points(task.start[None])[0, -1], [30, 20, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "field", "found", "expected"),
    [
        ("start = [1]", "start", "an unknown key", "one of arm, start_deg"),
        ("start_deg = 3", "start_deg", "3", "the angle of each joint"),
        ("start_deg = [0, 0]", "start_deg", "2 numbers", "8 numbers, one for each joint"),
        ("start_deg = [0, 0, 0, 0, 0, 0, 0, nan]", "start_deg[7]", "nan", "a number"),
        ("start_deg = [inf, 0, 0, 0, 0, 0, 0, 0]", "start_deg[0]", "inf", "a finite number"),
        ("box = [[1, 2, 3, 4, 5, 6]]", "box[0]", "[1, 2, 3, 4, 5, 6]", "a table"),
        ("[box]\nlower_cm = [1, 2, 3]\nupper_cm = [2, 3, 4]", "box", "a table", "[[box]] tables"),
        ("[[box]]\nlower_cm = [1, 2, 3]", "box[0].upper_cm", "nothing", "3 numbers x, y, z [cm]"),
        (
            f"{LINE_AND_BOX}[[box]]\nlower_cm = [1, 2, 3]\nupper_cm = [2, 3]",
            "box[1].upper_cm",
            "[2, 3]",
            "3 numbers x, y, z [cm]",
        ),
        (
            "[[box]]\nlower_cm = [1, 2, 3]\nupper_cm = [2, 3, nan]",
            "box[0].upper_cm[2]",
            "nan",
            "a number",
        ),
        (
            "[[box]]\nlower_cm = [1, 2, 3]\nupper_cm = [2, 1, 4]",
            "box[0]",
            "lower y = 2 cm above upper 1 cm",
            "lower at most upper on each axis",
        ),
        ("[path]\nsteps = 0", "path.steps", "0", "a whole number from 1 to 100000"),
        ("[path]\nsteps = 1.5", "path.steps", "1.5", "a whole number from 1 to 100000"),
        ("[path]\nsteps = 5", "path.steps", "point 1 of 5 at 10.72 cm", "at most 4.93 cm"),
        ("[path]\npoints_cm = [[1, 2]]", "path.points_cm[0]", "[1, 2]", "a list of numbers of"),
        ("[path]\npoints_cm = [[17, 57.6, 30.5]]", "path.points_cm", "1 rows", "2 to 100000 rows"),
        (
            "[path]\npoints_cm = [[17, 57.6, 30.5], [17, 57.6, 30.5]]",
            "path.points_cm",
            "a line of no length",
            "two different points",
        ),
        (
            "[path]\npoints_cm = [[17, 57.6, 30.5], [11, 110, 400]]",
            "path.points_cm",
            "point 358 of 1000 at (",
            "at most 142.6 cm, the reach of the arm",
        ),
        (
            '[path]\ncsv = "a.csv"\npoints_cm = [[1, 2, 3], [4, 5, 6]]',
            "path.csv",
            "path.points_cm beside it",
            "one of them",
        ),
        ('[path]\ncsv = "a.csv"', "path.csv", '"a.csv": no such file or directory', "a CSV file"),
        ("[limits]\nstep_deg = 0", "limits.step_deg", "0 deg", "above 0 and at most 45 deg"),
        ("[limits]\nstep_deg = 50", "limits.step_deg", "50 deg", "above 0 and at most 45 deg"),
        (
            "[limits]\nstep_deg = [1, 1, 1, -1, 1, 1, 1, 1]",
            "limits.step_deg[3]",
            "-1 deg",
            "above 0 and at most 45 deg",
        ),
        ("[limits]\nstep_deg = [1, 2]", "limits.step_deg", "2 numbers", "8 numbers, one for each"),
        ("[limits]\nstep_deg = nan", "limits.step_deg", "nan", "a number"),
        ("[limits]\nzone_cm = 0", "limits.zone_cm", "0", "a length above 0 [cm]"),
        ("[limits]\nzone = 1", "limits.zone", "an unknown key", "one of step_deg, zone_cm"),
        ("[weights]\nerror = -1", "weights.error", "-1", "a weight, at least 0"),
        ("[weights]\nclearance = 'much'", "weights.clearance", '"much"', "a weight, at least 0"),
        ("[weights]\nerror = 0\nclearance = 0", "weights.error", "0, as the", "a positive weight"),
        ("[arm]\nradius_cm = -1", "arm.radius_cm", "-1", "a length, at least 0 [cm]"),
        ("[arm]\ndh = []", "arm.dh", "[]", "rows of theta [deg]"),
        ("[arm]\ndh = [[0, 10, 0]]", "arm.dh[0]", "[0, 10, 0]", "4 numbers: theta [deg]"),
        ("[arm]\nfixed_rows = [0]", "arm.fixed_rows", "no arm.dh beside it", "rows to choose from"),
        ("[arm]\ndh = [[0, 1, 0, 0]]\nfixed_rows = [1]", "arm.fixed_rows[0]", "1", "a row of arm.dh"),
        (
            "[arm]\ndh = [[0, 1, 0, 0], [0, 0, 5, 0]]\nfixed_rows = [0, 0]",
            "arm.fixed_rows[1]",
            "0 again",
            "each row once",
        ),
        ("[arm]\ndh = [[0, 1, 0, 0]]", "arm.dh", "1 rows, all of them without", "one row with a"),
        (
            f"[arm]\ndh = {[[0, 0, 10, 0]] * 14}\n",
            "start_deg",
            "nothing",
            "13 angles, one for each joint [deg]",
        ),
        (
            f"start_deg = {[0] * 13}\n[arm]\ndh = {[[0, 0, 10, 0]] * 14}\n",
            "arm.dh",
            "13 joints",
            "12 joints at most",
        ),
        ('[arm]\nurdf = "a.urdf"', "arm.urdf", '"a.urdf"', "a URDF file"),
        ('[arm]\nurdf = "a.urdf"\ndh = [[0, 1, 0, 0]]', "arm.dh", "arm.urdf beside it", "one of"),
    ],
)  # fmt: skip
def test_a_bad_file_is_told_of_with_its_field(path, text, field, found, expected):
    error = complaint(path, text)

    assert error.field == field
    assert error.found.startswith(found)
    assert error.expected.startswith(expected)
    assert str(error).startswith(f"{path}: {field}: found ")


@pytest.mark.parametrize("start", ["", "start_deg = [10, -90, -50, 0, 50, 0, -25, 0]\n"])
def test_a_start_off_the_path_is_told_with_its_distance_and_one_that_would_do(path, start):
    text = start + "[path]\npoints_cm = [[10.0, 57.6, 30.5], [11, 110, 40]]\n"

    error = complaint(path, text)

    assert error.field == "start_deg"
    assert " cm from the path's first point" in error.found
    assert error.expected == "at most 0.1 cm (the zone) from (10, 57.6, 30.5) cm"
    proposal, _, words = error.hint.partition(" puts")
    assert words == " the tip there"
    path.write_text(f"{proposal}\n{text.removeprefix(start)}")
    task = read_tracking_task(path)
    tip = task.chain.points(task.start[None])[0, -1]
    np.testing.assert_allclose(tip, [10.0, 57.6, 30.5], atol=5e-3)


def test_a_start_of_an_own_arm_is_proposed_as_well(path):
    error = complaint(path, THREE_JOINTS.replace("start_deg = [45.0, -19.471, 109.471]", ""))

    assert (error.field, error.found) == ("start_deg", "nothing")
    path.write_text(f"{error.hint.partition(' puts')[0]}\n{THREE_JOINTS.partition(']')[2]}")
    assert read_tracking_task(path).n_joints == 3


def test_no_start_is_proposed_where_no_posture_reaches_the_path(path):
    text = THREE_JOINTS.replace("[[20, 20, 20]", "[[20, 20, 200]")

    assert "is it within reach?" in complaint(path, text).hint


def test_a_start_outside_the_joints_ranges_is_told_in_degrees(path):
    link = '<link name="{}"/>'
    joint = (
        '<joint name="turn" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
        '<limit effort="1" velocity="1" lower="-1.5" upper="1.5"/></joint>'
        '<joint name="tip" type="fixed"><parent link="b"/><child link="c"/>'
        '<origin xyz="0.3 0 0"/></joint>'
    )
    links = "".join(map(link.format, "abc"))
    (path.parent / "one.urdf").write_text(f'<robot name="one">{links}{joint}</robot>')

    error = complaint(path, 'start_deg = [90]\n[arm]\nurdf = "one.urdf"\n')

    assert (error.field, error.found) == ("start_deg[0]", "90 deg")
    assert error.expected == "an angle in the joint's range [-85.9437, 85.9437] deg"


def test_a_table_of_joints_alone_is_told_of_fixed_rows(path):
    error = complaint(path, THREE_JOINTS.replace("fixed_rows = []\n", ""))

    assert (error.field, error.found) == ("start_deg", "3 numbers")
    assert error.hint.endswith("unless fixed_rows = []")


SCENES = """
[path]
steps = 20
[weights]
error = 2.0
[[scene]]
name = "as-printed"
[[scene]]
name = "two.boxes"
weights.clearance = 0.5
[[scene.box]]
lower_cm = [5, 50, 45]
upper_cm = [15, 100, 50]
[[scene.box]]
lower_cm = [40, 50, 0]
upper_cm = [50, 100, 50]
[[scene]]
name = "elsewhere"
start_deg = [-15.852, -54.505, -51.918, 4.574, 50.774, 18.541, -31.187, 0.0]
limits = { zone_cm = 0.2 }
[scene.path]
points_cm = [[10, 57.6, 30.5], [11, 90, 40]]
[[scene]]
name = "bare"
box = []
"""


def test_scenes_share_what_they_do_not_say_themselves(path):
    path.write_text(SCENES)

    printed, boxes, elsewhere, bare = (scene.task for scene in read_scenes(path))

    assert [scene.name for scene in read_scenes(path)] == [
        "as-printed",
        "two.boxes",
        "elsewhere",
        "bare",
    ]
    assert {task.n_steps for task in (printed, boxes, elsewhere, bare)} == {20}
    assert printed.boxes.tolist() == [list(TOP_PLANE)]
    assert boxes.boxes[:, 2].tolist() == [45.0, 0.0]
    assert bare.boxes.shape == (0, 6)
    assert elsewhere.path[0].tolist() == [10.0, 57.6, 30.5]
    assert (printed.zone, elsewhere.zone) == (0.1, 0.2)
    assert (printed.error_weight, boxes.error_weight) == (2.0, 2.0)
    assert (printed.clearance_weight, boxes.clearance_weight) == (None, 0.5)
    assert printed.arm == bare.arm == redundant8()


def test_a_scene_s_points_replace_those_of_all(path):
    (path.parent / "line.csv").write_text("17.0,57.6,30.5\n11,110,40\n")
    path.write_text(
        '[path]\npoints_cm = [[17, 57.6, 30.5], [17, 80, 30]]\n[[scene]]\nname = "a"\n'
        '[scene.path]\ncsv = "line.csv"\n'
    )

    (scene,) = read_scenes(path)

    np.testing.assert_array_equal(scene.task.path[-1], [11, 110, 40])


@pytest.mark.parametrize(
    ("text", "field", "found", "expected"),
    [
        ("", "scene", "nothing", "[[scene]] tables, each with a name"),
        ("scene = []", "scene", "[]", "[[scene]] tables, each with a name"),
        ("[[scene]]\nbox = []", "scene[0].name", "nothing", "1 to 64 letters"),
        ('[[scene]]\nname = ""', "scene[0].name", '""', "1 to 64 letters"),
        ('[[scene]]\nname = "a/b"', "scene[0].name", '"a/b"', "1 to 64 letters"),
        ('[[scene]]\nname = "../up"', "scene[0].name", '"../up"', "1 to 64 letters"),
        (
            '[[scene]]\nname = "a"\n[[scene]]\nname = "A"',
            "scene[1].name",
            '"A"',
            "another name than that of scene[0]",
        ),
        ('[[scene]]\nname = "a"\narm = 1', "scene[0].arm", "an unknown key", "one of name, start"),
        (
            '[[scene]]\nname = "a"\n[[scene]]\nname = "b"\npath.steps = 500',
            "scene[1].path.steps",
            "500 steps",
            '1000, as in scene "a": all',
        ),
        (
            '[[scene]]\nname = "a"\n[[scene.box]]\nlower_cm = [1, 2, 3]\nupper_cm = [0, 2, 3]',
            "scene[0].box[0]",
            "lower x = 1 cm above upper 0 cm",
            "lower at most upper",
        ),
        (
            '[[box]]\nlower_cm = [1, 2, 3]\nupper_cm = [0, 2, 3]\n[[scene]]\nname = "a"',
            "box[0]",
            "lower x = 1 cm above upper 0 cm",
            "lower at most upper",
        ),
        ('[[scene]]\nname = "a"\nstart_deg = [1]', "scene[0].start_deg", "1 numbers", "8 numbers"),
        (
            '[[scene]]\nname = "a"\nlimits.step_deg = 99',
            "scene[0].limits.step_deg",
            "99 deg",
            "",
        ),
        ('[limits]\nstep_deg = 99\n[[scene]]\nname = "a"', "limits.step_deg", "99 deg", "above"),
        (
            '[[scene]]\nname = "a"\npath.csv = "b.csv"',
            "scene[0].path.csv",
            '"b.csv": no such',
            "a ",
        ),
        (
            '[[scene]]\nname = "a"\npath.points_cm = [[10, 57.6, 30.5], [11, 90, 40]]',
            "start_deg",
            "the tip at",
            "at most 0.1 cm",
        ),
    ],
)
def test_a_bad_scene_is_told_of_where_it_stands(path, text, field, found, expected):
    error = complaint(path, text, read_scenes)

    assert error.field == field
    assert error.found.startswith(found)
    assert error.expected.startswith(expected)


def test_the_examples_of_the_documentation_are_good_files(path):
    text = (Path(__file__).parents[2] / "docs" / "tracking-tasks.md").read_text()
    box, own_arm, scenes = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)

    path.write_text(box)
    assert read_tracking_task(path) == TrackingTask.of_paper(5.0)
    path.write_text(own_arm)
    assert read_tracking_task(path).n_joints == 3
    path.write_text(scenes)
    assert [len(scene.task.boxes) for scene in read_scenes(path)] == [1, 1, 1, 0]
