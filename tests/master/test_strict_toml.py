from typing import Annotated

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta, Struct

from tramnet_master.errors import InvalidFile
from tramnet_master.strict_toml import read_strictly


class Limits(Struct, frozen=True):
    torque_nm: Annotated[list[float], Meta(description="one torque a joint")] | None = None
    gain: float = 1.0


class Box(Struct, frozen=True):
    lower_cm: Annotated[tuple[float, float], Meta(description="2 numbers")]
    name: str = ""


Row = Annotated[tuple[float, float], Meta(description="a row of 2 numbers")]


class Scene(Struct, frozen=True):
    box: Annotated[list[Box], Meta(description="[[box]] tables")] | None = None
    rows: Annotated[list[Row], Meta(min_length=1, description="rows")] | None = None


class Task(Struct, frozen=True):
    start_rad: Annotated[list[float], Meta(description="one angle a joint")]
    robot: str = "akb"
    segments: Annotated[int, Meta(ge=2)] = 16
    limits: Limits = Limits()
    scene: list[Scene] = []
    exact: bool = False


@pytest.fixture
def path(tmp_path):
    return tmp_path / "task.toml"


def read(path, text: str) -> Task:
    path.write_text(text)
    return read_strictly(path, Task, {"start": "start_rad"}, ("limits.torque_nm",))


def complaint(path, text: str) -> InvalidFile:
    with pytest.raises(InvalidFile) as caught:
        read(path, text)
    return caught.value


def test_a_file_becomes_a_struct_with_defaults(path):
    found = read(path, "start_rad = [0, 1.5]\n[limits]\ntorque_nm = [1, inf]\n")

    assert found == Task([0.0, 1.5], limits=Limits([1.0, float("inf")]))


def test_a_second_spelling_is_taken_for_the_first(path):
    assert read(path, "start = [1]\n") == Task([1.0])


def test_both_spellings_at_once_are_a_mistake(path):
    error = complaint(path, "start = [1]\nstart_rad = [1]\n")

    assert error.field == "start_rad"
    assert error.expected == "one of `start` and `start_rad`"


@pytest.mark.parametrize(
    ("text", "field", "found", "expected"),
    [
        ('start_rad = "zero"', "start_rad", '"zero"', "one angle a joint"),
        ("start_rad = 1.0", "start_rad", "1.0", "one angle a joint"),
        ('start_rad = [0, "a"]', "start_rad[1]", '"a"', "a number"),
        ("start_rad = [0, true]", "start_rad[1]", "true", "a number"),
        ("start_rad = [[0], 1]", "start_rad[0]", "[0]", "a number"),
        ("start_rad = [0, nan]", "start_rad[1]", "nan", "a number"),
        ("start_rad = [-inf, 0]", "start_rad[0]", "-inf", "a finite number"),
        ("start_rad = [1979-05-27]", "start_rad[0]", "1979-05-27", "a number"),
        ("start_rad = [0]\nrobot = 5", "robot", "5", "a text in quotes"),
        ("start_rad = [0]\nsegments = 16.0", "segments", "16.0", "a whole number"),
        ("start_rad = [0]\nsegments = 1", "segments", "1", "a whole number >= 2"),
        ("start_rad = [0]\nexact = 1", "exact", "1", "true or false"),
        ("start_rad = [0]\nlimits = 5", "limits", "5", "a table"),
        ("start_rad = [0]\n[limits]\ntorque_nm = 5", "limits.torque_nm", "5", "one torque a joint"),
        (
            "start_rad = [0]\n[limits]\ntorque_nm = [{}]",
            "limits.torque_nm[0]",
            "a table",
            "a number",
        ),
        ("start_rad = [0]\n[limits]\ngain = inf", "limits.gain", "inf", "a finite number"),
        ("start_rad = [0]\n[limits]\ntorque_nm = [nan]", "limits.torque_nm[0]", "nan", "a number"),
        ("robot = 'akb'", "start_rad", "nothing", "one angle a joint"),
        ("start_rad = [0]\n[start_rad]", "", "Cannot", "TOML"),
        ("start_rad = [0,, 1]", "", "Invalid value (at line 1, column 16)", "TOML"),
        ("start_rad = 0\nstart_rad = 0", "", "Cannot overwrite a value", "TOML"),
    ],
)
def test_a_mistake_is_told_with_its_field_and_what_was_found_and_expected(
    path, text, field, found, expected
):
    error = complaint(path, text)

    assert error.field == field
    assert error.found.startswith(found)
    assert error.expected == expected
    assert error.exit_code == 2


@pytest.mark.parametrize(
    ("text", "field", "hint"),
    [
        ("start_red = [0]", "start_red", "did you mean `start_rad`?"),
        ("start_rad = [0]\ntorque_nm = [5]", "torque_nm", "did you mean `limits.torque_nm`?"),
        ("start_rad = [0]\n[limits]\nsegment = 5", "limits.segment", "did you mean `segments`?"),
        ("start_rad = [0]\n[limit]\n", "limit", "did you mean `limits`?"),
        ("start_rad = [0]\ncolour = 'red'", "colour", ""),
        ("start_rad = [0]\n[limits]\n[limits.torque]\nnm = 1", "limits.torque", "did you mean"),
    ],
)
def test_an_unknown_key_is_told_with_the_one_that_was_probably_meant(path, text, field, hint):
    error = complaint(path, text)

    assert error.field == field
    assert error.found == "an unknown key"
    assert error.hint.startswith(hint)
    assert bool(error.hint) == bool(hint)


def test_the_message_is_one_readable_line(path):
    error = complaint(path, "start_rad = [0]\n[limits]\ntorque = 5")

    assert str(error) == (
        f"{path}: limits.torque: found an unknown key, expected one of torque_nm, gain "
        "(did you mean `limits.torque_nm`?)"
    )


@pytest.mark.parametrize("content", [b"\xff\xfe", b"a = 1\n" + b"#" * (1 << 20)])
def test_what_is_no_text_of_a_task_is_refused(path, content):
    path.write_bytes(content)

    with pytest.raises(InvalidFile) as caught:
        read_strictly(path, Task)

    assert caught.value.field == ""


def test_a_file_that_is_not_there_is_told_of(path, tmp_path):
    with pytest.raises(InvalidFile, match="found no such file or directory"):
        read_strictly(path, Task)
    with pytest.raises(InvalidFile, match="found is a directory"):
        read_strictly(tmp_path, Task)


scalars = st.booleans() | st.integers(-(2**70), 2**70) | st.floats() | st.text(max_size=5)
values = st.recursive(
    scalars,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["torque_nm", "gain", "x"]), inner)
    ),
    max_leaves=6,
)
keys = st.sampled_from(["start", "start_rad", "robot", "segments", "limits", "exact", "other"])


@given(document=st.dictionaries(keys, values))
def test_any_file_is_either_read_or_refused_with_a_reason(tmp_path_factory, document):
    path = tmp_path_factory.mktemp("tasks") / "task.toml"
    path.write_bytes(tomli_w.dumps(document).encode("utf-8", "replace"))

    outcome = read_or_reason(path)

    if isinstance(outcome, InvalidFile):
        assert outcome.found
        assert outcome.expected
        assert "\n" not in str(outcome)
    else:
        assert outcome.segments >= 2
        assert all(isinstance(angle, float) for angle in outcome.start_rad)


def read_or_reason(path) -> Task | InvalidFile:
    try:
        return read_strictly(path, Task, {"start": "start_rad"})
    except InvalidFile as error:
        return error


SCENES = """start_rad = [1]
[[scene]]
[[scene]]
rows = [[1, 2]]
[[scene.box]]
lower_cm = [1, 2]
[[scene.box]]
name = "low"
lower_cm = [3, 4]
"""


def test_arrays_of_tables_become_lists(path):
    found = read(path, SCENES)

    boxes = [Box((1.0, 2.0)), Box((3.0, 4.0), "low")]
    assert found.scene == [Scene(), Scene(boxes, [(1.0, 2.0)])]


@pytest.mark.parametrize(
    ("old", "new", "field", "found", "expected"),
    [
        ("[3, 4]", "[3]", "scene[1].box[1].lower_cm", "[3]", "2 numbers"),
        ("[3, 4]", "[3, nan]", "scene[1].box[1].lower_cm[1]", "nan", "a number"),
        ("[3, 4]", '[3, "x"]', "scene[1].box[1].lower_cm[1]", '"x"', "a number"),
        ("lower_cm = [3, 4]", "", "scene[1].box[1].lower_cm", "nothing", "2 numbers"),
        ("lower_cm = [3", "lowr_cm = [3", "scene[1].box[1].lowr_cm", "an unknown key", "one of "),
        ("rows = ", "row = ", "scene[1].row", "an unknown key", "one of box, rows"),
        ("[[1, 2]]", "[[1, 2], [3]]", "scene[1].rows[1]", "[3]", "a row of 2 numbers"),
        ("[[1, 2]]", "[]", "scene[1].rows", "[]", "rows"),
        ("[[1, 2]]", "3", "scene[1].rows", "3", "rows"),
    ],
)
def test_a_mistake_in_an_array_of_tables_is_told_with_its_place(
    path, old, new, field, found, expected
):
    error = complaint(path, SCENES.replace(old, new))

    assert (error.field, error.found) == (field, found)
    assert error.expected.startswith(expected)


def test_one_table_where_there_may_be_several_is_told_of(path):
    error = complaint(path, "start_rad = [1]\n[[scene]]\n[scene.box]\nlower_cm = [1, 2]\n")

    assert (error.field, error.found, error.expected) == (
        "scene[0].box",
        "a table",
        "[[box]] tables",
    )
