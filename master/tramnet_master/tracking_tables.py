"""What a task file of ``redundant8`` may say, table by table, and what the tables make.

All lengths are in centimetres and all angles in degrees, as their names say.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TypeAlias, TypeVar

import numpy as np
from msgspec import Meta, Struct
from msgspec.structs import asdict
from numpy.typing import NDArray

from tramnet_master.errors import InvalidFile
from tramnet_master.point_files import Point, read_points
from tramnet_master.wording import spell
from tramnet_workers.problems.tracking_task import MOST_STEPS, points_along
from tramnet_workers.robots.arm import InvalidArm, SerialArm
from tramnet_workers.robots.dh_rows import arm_from_dh_rows
from tramnet_workers.robots.redundant8 import LINE, redundant8

Array = NDArray[np.float64]

T = TypeVar("T", bound=Struct)

_Row: TypeAlias = Annotated[
    tuple[float, float, float, float],
    Meta(description="4 numbers: theta [deg], d [cm], a [cm], alpha [deg]"),
]
_Rows: TypeAlias = Annotated[
    list[_Row], Meta(min_length=1, description="rows of theta [deg], d [cm], a [cm], alpha [deg]")
]
_Indices: TypeAlias = Annotated[
    list[int], Meta(description="indices of the rows of dh without a joint, from 0")
]
_Length: TypeAlias = Annotated[float, Meta(ge=0, description="a length, at least 0 [cm]")]
_File: TypeAlias = Annotated[str, Meta(description="the path of a file, from this one")]
_Points: TypeAlias = Annotated[
    list[Point], Meta(description="the corners of a polyline, at least 2 points [x, y, z] [cm]")
]
_Steps: TypeAlias = Annotated[
    int, Meta(ge=1, le=MOST_STEPS, description=f"a whole number from 1 to {MOST_STEPS}")
]
_Point: TypeAlias = Annotated[
    tuple[float, float, float], Meta(description="3 numbers x, y, z [cm]")
]
_Turns: TypeAlias = Annotated[
    float | list[float],
    Meta(description="one angle for all joints, or one for each [deg]"),
]
_Radius: TypeAlias = Annotated[float, Meta(gt=0, description="a length above 0 [cm]")]
_Weight: TypeAlias = Annotated[float, Meta(ge=0, description="a weight, at least 0")]


class ArmTable(Struct, frozen=True):
    """``[arm]``: a Denavit-Hartenberg table or a URDF file, and how thick the links are."""

    dh: _Rows | None = None
    fixed_rows: _Indices | None = None
    radius_cm: _Length | None = None
    urdf: _File | None = None


class PathTable(Struct, frozen=True):
    """``[path]``: a polyline, here or in a file, and into how many steps it is cut."""

    points_cm: _Points | None = None
    csv: _File | None = None
    steps: _Steps | None = None


class BoxTable(Struct, frozen=True):
    """``[[box]]``: two opposite corners of an obstacle."""

    lower_cm: _Point
    upper_cm: _Point


class LimitsTable(Struct, frozen=True):
    """``[limits]``: how far joints turn in a step, and how far the tip may be from its point."""

    step_deg: _Turns | None = None
    zone_cm: _Radius | None = None


class WeightsTable(Struct, frozen=True):
    """``[weights]``: w1 and w2 of the paper's cost."""

    error: _Weight | None = None
    clearance: _Weight | None = None


Boxes: TypeAlias = Annotated[
    list[BoxTable], Meta(description="[[box]] tables with lower_cm and upper_cm, or [] for no box")
]
Start: TypeAlias = Annotated[
    list[float], Meta(description="the angle of each joint at the path's first point [deg]")
]

_PAPER_STEPS = 1000


class TaskTables(Struct, frozen=True, kw_only=True):
    """A task file."""

    arm: ArmTable = ArmTable()
    start_deg: Start | None = None
    path: PathTable = PathTable()
    box: Boxes | None = None
    limits: LimitsTable = LimitsTable()
    weights: WeightsTable = WeightsTable()


def overlaid(base: T, own: T) -> T:
    """A table with what ``own`` says, and what ``base`` says where it is silent."""
    return type(base)(**(asdict(base) | {k: v for k, v in asdict(own).items() if v is not None}))


def overlaid_path(base: PathTable, own: PathTable) -> PathTable:
    """The same for a path, whose points come from one place only."""
    if own.points_cm is not None or own.csv is not None:
        base = PathTable(steps=base.steps)
    return overlaid(base, own)


def build_arm(file: Path, table: ArmTable) -> SerialArm:
    """The arm that a table describes, the paper's if it describes none.

    Args:
        file: The task file.
        table: Its table.

    Raises:
        InvalidFile: The table contradicts itself, or there is no such arm.
    """
    if table.urdf is not None:
        for name in ("dh", "fixed_rows"):
            if getattr(table, name) is not None:
                raise InvalidFile(file, f"arm.{name}", "arm.urdf beside it", "one of them")
        return _arm_of_urdf(file, table.urdf)
    if table.dh is None:
        if table.fixed_rows is not None:
            raise InvalidFile(file, "arm.fixed_rows", "no arm.dh beside it", "rows to choose from")
        return redundant8()
    fixed = [0] if table.fixed_rows is None else table.fixed_rows
    _check_fixed_rows(file, fixed, len(table.dh))
    rows = [(theta, d / 100, a / 100, alpha) for theta, d, a, alpha in table.dh]
    return arm_from_dh_rows(file.stem, rows, fixed)


def build_path(file: Path, table: PathTable, field: str) -> Array:
    """The points that a table describes, the paper's line if it describes none.

    Args:
        file: The task file.
        table: Its table.
        field: What the table is called there, for messages.

    Returns:
        Points, of shape (steps + 1, 3) [cm].

    Raises:
        InvalidFile: There are points in two places, or the file cannot be read.
        InvalidTask: The corners are no polyline.
    """
    if table.points_cm is not None and table.csv is not None:
        raise InvalidFile(file, f"{field}.csv", f"{field}.points_cm beside it", "one of them")
    corners: Sequence[Point] = LINE if table.points_cm is None else table.points_cm
    if table.csv is not None:
        corners = read_points(file, f"{field}.csv", table.csv)
    return points_along(corners, table.steps or _PAPER_STEPS)


def _check_fixed_rows(file: Path, fixed: list[int], n_rows: int) -> None:
    for i, row in enumerate(fixed):
        field = f"arm.fixed_rows[{i}]"
        if not 0 <= row < n_rows:
            raise InvalidFile(file, field, str(row), f"a row of arm.dh, 0 to {n_rows - 1}")
        if row in fixed[:i]:
            raise InvalidFile(file, field, f"{row} again", "each row once")
    if len(fixed) == n_rows:
        found = f"{n_rows} rows, all of them without a joint (fixed_rows)"
        raise InvalidFile(file, "arm.dh", found, "one row with a joint at least")


def _arm_of_urdf(file: Path, name: str) -> SerialArm:
    urdf = file.parent / name
    if not urdf.is_file():
        hint = f"there is no file {urdf}"
        raise InvalidFile(file, "arm.urdf", spell(name), "a URDF file", hint)
    from tramnet_workers.robots.pinocchio_bridge import arm_from_urdf  # noqa: PLC0415  slow

    try:
        return arm_from_urdf(urdf)
    except InvalidArm as error:
        found = f"{spell(name)}, which cannot be used ({error})"
        raise InvalidFile(file, "arm.urdf", found, "a serial arm of revolute joints") from error
