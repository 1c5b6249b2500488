from pathlib import Path

import numpy as np
import pytest

from tramnet_master.design_files import names_of, read_design_task
from tramnet_master.errors import InvalidFile
from tramnet_workers.mpga_settings import SETTINGS
from tramnet_workers.problems.design_task import Base, DesignTask, Genes, Stroke
from tramnet_workers.problems.single_design import single_design
from tramnet_workers.problems.stock import UNLIMITED, Stock
from tramnet_workers.problems.trajectory import Circle, Polyline

CIRCLE = "[points]\ncircle = {centre = [0.8, 0.4], radius = 0.25, count = 4}\n"
LIST = "[points]\nlist = [[0.5, 0.1], [0.6, 0.3], [0.4, 0.4]]\n"
EVERYTHING = """
most_returns = 1
terms = ["isotropy"]

[points]
list = [[0.5, 0.1], [0.6, 0.3], [0.4, 0.4]]
closed = true

[limits]
lower_rad = [-3, -2]
upper_rad = [3, 2]

[weights]
dm = 2
jac = 0.03

[stock]
lengths_m = [0.5, 0.3]

[base]
free = true
position_m = [0.1, 0.2]
lower_m = [-0.1, -0.2]
upper_m = [0.3, 0.4]
mobility_m = inf

[genes]
bits = 12
lower_m = -1
upper_m = 1.5

[arm]
lengths_m = [0.4, 0.5]

[prismatic]
links = [2, 1]
lengths_m = [0.2, 0.1]
scales_m = [0.5, 0.4]

[obstacles]
boxes_m = [[0.0, 0.5, 0.1, 0.6]]
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "task.toml"


def read(path: Path, text: str) -> DesignTask:
    path.write_text(text)
    return read_design_task(path)


def complaint(path: Path, text: str) -> InvalidFile:
    with pytest.raises(InvalidFile) as caught:
        read(path, text)
    return caught.value


def test_points_are_all_that_a_task_needs(path):
    assert read(path, CIRCLE) == DesignTask()


def test_every_key_of_a_task_is_heeded(path):
    assert read(path, EVERYTHING) == DesignTask(
        trajectory=Polyline(((0.5, 0.1), (0.6, 0.3), (0.4, 0.4)), closed=True),
        stations=(0.0, 1.0, 2.0),
        lower=(-3.0, -2.0),
        upper=(3.0, 2.0),
        weights={"dm": 2.0, "jac": 0.03},
        stock=Stock((0.3, 0.5), (UNLIMITED, UNLIMITED)),
        base=Base(free=True, position=(0.1, 0.2), lower=(-0.1, -0.2), upper=(0.3, 0.4)),
        genes=Genes(12, -1.0, 1.5),
        boxes=((0.0, 0.5, 0.1, 0.6),),
        terms=("isotropy",),
        lengths=(0.4, 0.5),
        mobility=np.inf,
        strokes=(Stroke(1, 0.2, 0.5), Stroke(0, 0.1, 0.4)),
        most_returns=1,
    )


def test_a_task_survives_its_way_to_the_workers(path):
    task = read(path, EVERYTHING)

    assert DesignTask.from_parameters(task.parameters()) == task


def test_points_on_a_circle_are_evenly_spaced(path):
    task = read(path, CIRCLE.replace("count = 4", "count = 5"))

    assert task.trajectory == Circle((0.8, 0.4), 0.25)
    assert task.stations == pytest.approx((0.0, 0.2, 0.4, 0.6, 0.8))


def test_a_list_of_points_is_open_unless_it_says_otherwise(path):
    assert not read(path, LIST).trajectory.closed
    assert read(path, LIST + "closed = true\n").trajectory.closed


def test_points_may_stand_in_a_csv_file_beside_the_task(path):
    (path.parent / "p.csv").write_text("name,y_m,x_m\na,0.1,0.5\nb,0.3,0.6\n")

    task = read(path, '[points]\ncsv = "p.csv"\n')

    np.testing.assert_array_equal(task.points, [[0.5, 0.1], [0.6, 0.3]])


def test_the_stock_may_stand_in_a_csv_file_beside_the_task(path):
    (path.parent / "s.csv").write_text("length_m,quantity\n0.4,2\n0.3,\n")

    task = read(path, CIRCLE + '[stock]\ncsv = "s.csv"\n')

    assert task.stock == Stock((0.3, 0.4), (UNLIMITED, 2))


def test_a_base_that_may_move_is_free(path):
    base = read(path, CIRCLE + "[base]\nmobility_m = 0.2\n").base

    assert base.free


@pytest.mark.parametrize(
    ("text", "field", "found", "expected"),
    [
        ("", "points", "nothing", "a value"),
        ("[points]\n", "points", "none of its keys", "one of circle, list, csv"),
        (LIST + 'csv = "a.csv"\n', "points", "list and csv", "one of circle, list, csv"),
        ("[points]\nlist = []\n", "points.list", "0 points", "1 to 4096 points"),
        ("[points]\nlist = [[0.5]]\n", "points.list[0]", "[0.5]", ""),
        ("[points]\nlist = [[0.5, nan]]\n", "points.list[0][1]", "nan", "a number"),
        ('[points]\ncsv = "none.csv"\n', "points.csv", '"none.csv": no such', "a CSV file"),
        (CIRCLE.replace("0.25", "0"), "points.circle.radius", "0.0", "a finite number above 0"),
        (CIRCLE.replace("0.25", "inf"), "points.circle.radius", "inf", "a finite number"),
        (CIRCLE.replace("= 4", "= 0"), "points.circle.count", "0", "a whole number from 1"),
        (CIRCLE.replace("= 4", "= 9999"), "points.circle.count", "9999", "a whole number from 1"),
        (CIRCLE.replace(", count = 4", ""), "points.circle.count", "nothing", "a whole number"),
        (CIRCLE.replace("centre", "center"), "points.circle.center", "an unknown key", "one of"),
        (CIRCLE + "closed = false\n", "points.closed", "false", "true, or nothing"),
    ],
)
def test_wrong_points_are_told_with_their_field(path, text, field, found, expected):
    error = complaint(path, text)

    assert error.field == field
    assert error.found.startswith(found)
    assert error.expected.startswith(expected)
    assert error.exit_code == 2


@pytest.mark.parametrize(
    ("addition", "field", "found", "expected"),
    [
        ("[limits]\nlower_rad = [-1, -1]", "limits.upper_rad", "nothing", "2 numbers, as many"),
        ("[limits]\nlower_rad = [-1, 3, -1]", "limits.lower_rad[1]", "3.0",
         "less than limits.upper_rad[1] = 2.6"),
        ("[limits]\nlower_rad = [-1]\nupper_rad = [1, 2]", "limits.upper_rad", "2 numbers", "1 n"),
        ("[limits]\nlower_rad = []\nupper_rad = []", "limits.lower_rad", "0 numbers", "1 to 8"),
        ("[limits]\nlower_deg = [-1, -1, -1]", "limits.lower_deg", "an unknown key", "one of"),
        ("[weights]\njac = -1", "weights.jac", "-1", "a weight, at least 0"),
        ("[weights]\njac = inf", "weights.jac", "inf", "a finite number"),
        ("[weights]\nfoo = 1", "weights.foo", "an unknown key", "one of dm, tc, rc"),
        ("[stock]\nlengths_m = []", "stock", "no length", "one length at least"),
        ("[stock]\nlengths_m = [-0.1]", "stock.lengths_m[0]", "-0.1", "a finite length above 0"),
        ("[stock]\nlengths_m = [0.1]\ncsv = 's.csv'", "stock", "lengths_m and csv", "one of"),
        ("[base]\nfree = true\nlower_m = [1, 0]", "base.lower_m[0]", "1.0",
         "less than base.upper_m[0] = 0.5"),
        ("[base]\nfree = false\nmobility_m = 1", "base.free", "false", "true, for a base"),
        ("[base]\nposition_m = [1]", "base.position_m", "[1]", "2 numbers x, y [m]"),
        ("[genes]\nbits = 4", "genes.bits", "4", "a whole number from 5 to 16"),
        ("[genes]\nbits = 10.5", "genes.bits", "10.5", "a whole number from 5 to 16"),
        ("[genes]\nlower_m = 2", "genes.lower_m", "2.0", "less than genes.upper_m = 1.2"),
        ("[arm]\nlengths_m = [0.4]", "arm.lengths_m", "1 numbers", "3 numbers"),
        ("[arm]\nlengths_m = [0.4, 0, 0.4]", "arm.lengths_m[1]", "0.0", "a length above 0 m"),
        ("[prismatic]\nlinks = [4]\nlengths_m = [0.1]", "prismatic.links[0]", "4", "a link from 1"),
        ("[prismatic]\nlinks = [1]", "prismatic.lengths_m", "0 numbers", "1, as many"),
        ("[prismatic]\nlinks = [1]\nlengths_m = [0]", "prismatic.lengths_m[0]", "0.0", "a length"),
        ("[obstacles]\nboxes_m = [[1, 0, 0, 1]]", "obstacles.boxes_m[0]", "(1.0, 0.0", "x_min <"),
        ("[obstacles]\nboxes_m = [[1, 0, 0]]", "obstacles.boxes_m[0]", "[1, 0, 0]", ""),
        ("[robot]\nname = 1", "robot", "an unknown key", "one of points, limits, weights"),
    ],
)  # fmt: skip
def test_what_else_is_wrong_is_told_with_its_field(path, addition, field, found, expected):
    error = complaint(path, f"{CIRCLE}\n{addition}\n")

    assert error.field == field
    assert error.found.startswith(found)
    assert error.expected.startswith(expected)
    assert str(error).startswith(f"{path}: {field}: found ")


def test_an_unknown_term_is_told_with_those_that_are_known(path):
    error = complaint(path, f'terms = ["beauty"]\n{CIRCLE}')

    assert (error.field, error.found) == ("terms", "'beauty'")
    assert "isotropy" in error.expected


@pytest.mark.parametrize(
    ("content", "field", "found"),
    [
        ("x_m\n0.1\n", "", "columns x_m"),
        ("", "", "no line of column names"),
        ("x_m,y_m\n0.1,0.2\n0.1,high\n", "line 3, y_m", '"high"'),
        ("x_m,y_m\n0.1,\n", "line 2, y_m", "nothing"),
        ("x_m,y_m\n0.1,inf\n", "line 2, y_m", '"inf"'),
        ("x_m,y_m\n", "", "0 points"),
    ],
)
def test_a_wrong_csv_file_is_told_with_its_line(path, content, field, found):
    (path.parent / "p.csv").write_text(content)

    error = complaint(path, '[points]\ncsv = "p.csv"\n')

    assert error.path == path.parent / "p.csv"
    assert (error.field, error.found) == (field, found)


def test_a_csv_file_that_is_no_text_is_refused(path):
    (path.parent / "p.csv").write_bytes(b"\xff\xfe\x00")

    assert complaint(path, '[points]\ncsv = "p.csv"\n').expected == "UTF-8"


def test_a_later_complaint_of_a_method_has_the_names_of_the_file_too(path):
    task = read(path, LIST + "[limits]\nlower_rad = [-1, -1]\nupper_rad = [1, 1]\n")

    with pytest.raises(InvalidFile) as caught, names_of(path):
        single_design(task, SETTINGS["recommended"])

    assert caught.value.field == "limits.lower_rad"
    assert caught.value.found == "2 links and 0 strokes"
