from pathlib import Path

import pytest

from tramnet_master.errors import InvalidFile
from tramnet_master.point_files import read_points
from tramnet_master.user_csv import LARGEST_FILE

POINTS = [(1.0, 2.5, -3.0), (4.0, 5.0, 6e-3)]


def read(folder: Path, content: bytes) -> list[tuple[float, float, float]]:
    (folder / "points.csv").write_bytes(content)
    return read_points(folder / "task.toml", "path.csv", "points.csv")


@pytest.mark.parametrize(
    "content",
    [
        b"1,2.5,-3\n4,5,6e-3\n",
        b"x_cm,y_cm,z_cm\n1,2.5,-3\n4,5,6e-3",
        b'"x_cm", "y_cm", "z_cm"\r\n1, 2.5, -3\r\n\r\n4, 5, 6e-3\r\n',
        b"\xef\xbb\xbfx_cm,y_cm,z_cm\n1,2.5,-3\n4,5,6e-3\n",
    ],
)
def test_points_are_read_with_or_without_a_line_of_names(tmp_path, content):
    assert read(tmp_path, content) == POINTS


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"1,2,3\n1,2\n", '"1,2" in line 2 of points.csv'),
        (b"x_cm,y_cm,z_cm\n1,2,3\n1,2,3,4\n", '"1,2,3,4" in line 3 of points.csv'),
        (b"x,y,z\n1,2,3\n", '"x,y,z" in line 1 of points.csv'),
        (b"1,2,nan\n", '"1,2,nan" in line 1 of points.csv'),
        (b"1,2,inf\n", '"1,2,inf" in line 1 of points.csv'),
        (b"1;2;3\n", '"1;2;3" in line 1 of points.csv'),
    ],
)
def test_a_line_that_is_no_point_is_told_of_with_its_number(tmp_path, content, found):
    with pytest.raises(InvalidFile) as caught:
        read(tmp_path, content)

    assert (caught.value.field, caught.value.found) == ("path.csv", found)
    assert "x_cm,y_cm,z_cm" in caught.value.expected


def test_bytes_that_are_no_text_are_told_of(tmp_path):
    with pytest.raises(InvalidFile, match="no text"):
        read(tmp_path, b"\xff\xfe1,2,3\n")


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    with pytest.raises(InvalidFile, match=f"a file of at most {LARGEST_FILE}"):
        read(tmp_path, b"1,2,3\n" * (LARGEST_FILE // 6 + 1))


def test_a_missing_file_is_told_of_with_its_whole_path(tmp_path):
    with pytest.raises(InvalidFile) as caught:
        read_points(tmp_path / "task.toml", "path.csv", "none.csv")

    assert caught.value.hint == f"looked for {tmp_path / 'none.csv'}"
