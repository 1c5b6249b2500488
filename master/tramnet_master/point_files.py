"""Points in CSV files that users wrote: a line of names, which may be missing, and a point a line."""

import math
from pathlib import Path

from tramnet_master.errors import InvalidFile
from tramnet_master.user_csv import read_beside
from tramnet_master.wording import spell

NAMES = ["x_cm", "y_cm", "z_cm"]

Point = tuple[float, float, float]


def read_points(file: Path, field: str, name: str) -> list[Point]:
    """Read the points of a CSV file that a task file names.

    Args:
        file: The task file.
        field: Its field that names the CSV file, for messages.
        name: The CSV file, from the folder of the task file.

    Raises:
        InvalidFile: The file cannot be read, or a line of it is no point.
    """
    lines = read_beside(file, field, name)[1].splitlines()
    first = 1 if lines and _names_of(lines[0]) == NAMES else 0
    return [
        _point(line, InvalidFile(file, field, f"{spell(line)} in line {i} of {name}", _EXPECTED))
        for i, line in enumerate(lines[first:], start=first + 1)
        if line.strip()
    ]


_EXPECTED = f"a point: 3 finite numbers, as in {','.join(NAMES)} [cm]"


def _names_of(line: str) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(",")]


def _point(line: str, complaint: InvalidFile) -> Point:
    try:
        x, y, z = (float(cell) for cell in line.split(","))
    except ValueError as error:
        raise complaint from error
    if not all(math.isfinite(value) for value in (x, y, z)):
        raise complaint
    return (x, y, z)
