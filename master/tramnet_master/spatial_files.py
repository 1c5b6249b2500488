"""A user's own task for ``crank --variant spatial``, read once, here.

    [points]                                       # list or csv
    list = [[0.55, 0.2, 0.2], [0.55, 0.0, 0.4]]    # [m]
    csv = "points.csv"                             # beside this file, with columns x_m, y_m, z_m
    rpy_rad = [[0.0, 1.57, 0.0], [0.0, 1.57, 0.0]] # roll, pitch, yaw of the tip, as in URDF
    closed = true                                  # whether the last point leads to the first

    [limits]                                       # a number a joint
    lower_rad = [-3.14, -3.14, -3.14, -3.14, -2.0, -3.14]
    upper_rad = [3.14, 3.14, 3.14, 3.14, 2.0, 3.14]

    [weights]                                      # of eq (4); those of the settings if left out
    dm = 1.0                                       # and tc, rc, hc, jlc, lc, bpc, jac

    [base]
    free = true                                    # whether its place is to be found
    position_m = [0.0, 0.0, 0.0]                   # if it is given
    lower_m = [-0.2, -0.2, -0.2]                   # if it is free
    upper_m = [0.2, 0.2, 0.2]

    [genes]
    bits = 10
    lower_m = 0.1                                  # designed lengths
    upper_m = 0.8

    [arm]                                          # standard Denavit-Hartenberg rows
    a_m = [0.0, 0.4, 0.0, 0.0, 0.0, 0.0]
    d_m = [0.0, 0.0, 0.0, 0.4, 0.0, 0.1]
    alpha_rad = [-1.5707963, 0.0, 1.5707963, -1.5707963, 1.5707963, 0.0]
    designed = ["", "a", "", "d", "", ""]          # which lengths are to be found
    scale_m = 0.3                                  # what makes an angle comparable to a distance

Everything but the points may be left out; without ``rpy_rad`` only positions matter.
"""

from math import cos, sin
from pathlib import Path
from typing import Annotated, Literal, TypeAlias, TypeVar

from msgspec import Meta, Struct

from tramnet_master.design_files import Angles, Bits, FileName, WeightsTable, one_of
from tramnet_master.errors import InvalidFile
from tramnet_master.strict_toml import read_strictly
from tramnet_master.user_csv import read_beside, read_columns
from tramnet_workers.errors import InvalidTask
from tramnet_workers.problems.design_task import MOST_POINTS
from tramnet_workers.problems.spatial_task import SpatialTask, Triple, Turn
from tramnet_workers.robots.revolute_chain import ChainRow, six_joint_template

T = TypeVar("T")

_DEFAULTS = SpatialTask()
_Triple: TypeAlias = Annotated[
    tuple[float, float, float], Meta(description="3 numbers x, y, z [m]")
]
_Turn: TypeAlias = Annotated[
    tuple[float, float, float], Meta(description="3 numbers roll, pitch, yaw [rad]")
]
_Offsets: TypeAlias = Annotated[list[float], Meta(description="one length for each joint [m]")]
_Designed: TypeAlias = Annotated[
    list[Literal["", "a", "d"]], Meta(description='"a", "d" or "" for each joint')
]


class _Points(Struct, frozen=True, rename={"places": "list"}):
    places: list[_Triple] | None = None
    csv: FileName | None = None
    rpy_rad: list[_Turn] = []
    closed: bool = True


class _Limits(Struct, frozen=True):
    lower_rad: Angles | None = None
    upper_rad: Angles | None = None


class _Base(Struct, frozen=True):
    free: bool = True
    position_m: _Triple = (0.0, 0.0, 0.0)
    lower_m: _Triple = _DEFAULTS.base_lower
    upper_m: _Triple = _DEFAULTS.base_upper


class _Genes(Struct, frozen=True):
    bits: Bits = _DEFAULTS.bits
    lower_m: float = _DEFAULTS.lengths[0]
    upper_m: float = _DEFAULTS.lengths[1]


class _Arm(Struct, frozen=True):
    a_m: _Offsets | None = None
    d_m: _Offsets | None = None
    alpha_rad: Angles | None = None
    designed: _Designed | None = None
    scale_m: float = _DEFAULTS.scale


class _TaskFile(Struct, frozen=True):
    points: _Points
    limits: _Limits = _Limits()
    weights: WeightsTable = WeightsTable()
    base: _Base = _Base()
    genes: _Genes = _Genes()
    arm: _Arm = _Arm()


_FIELDS = {
    "points": "points.list",
    "orientations": "points.rpy_rad",
    "arm": "arm.designed",
    "lengths": "genes.lower_m",
    "base_lower": "base.lower_m",
    "scale": "arm.scale_m",
}


def read_spatial_task(path: Path) -> SpatialTask:
    """Read a task file of ``crank`` for a spatial arm.

    Raises:
        InvalidFile: With the field that is wrong, what was found and what was expected.
    """
    file = read_strictly(path, _TaskFile)
    base = file.base
    try:
        return SpatialTask(
            points=_points(path, file.points),
            orientations=tuple(_turn(*rpy) for rpy in file.points.rpy_rad),
            closed=file.points.closed,
            arm=_arm(path, file.arm, file.limits),
            lengths=(file.genes.lower_m, file.genes.upper_m),
            base_lower=base.lower_m if base.free else base.position_m,
            base_upper=base.upper_m if base.free else base.position_m,
            weights=file.weights.given(),
            scale=file.arm.scale_m,
            bits=file.genes.bits,
        )
    except InvalidTask as error:
        name, bracket, index = error.field.partition("[")
        field = _FIELDS.get(name, name) + bracket + index
        expected = error.expected.replace("base_upper", "base.upper_m")
        raise InvalidFile(path, field, error.found, expected) from error


def _points(path: Path, points: _Points) -> tuple[Triple, ...]:
    one_of(path, "points", {"list": points.places, "csv": points.csv}, required=True)
    if points.csv is None:
        found = points.places or []
    else:
        csv_path, text = read_beside(path, "points.csv", points.csv)
        found = [(x, y, z) for x, y, z in read_columns(csv_path, text, ("x_m", "y_m", "z_m"))]
    if not 1 <= len(found) <= MOST_POINTS:
        field = "points.list" if points.csv is None else "points.csv"
        raise InvalidFile(path, field, f"{len(found)} points", f"1 to {MOST_POINTS} points")
    return tuple(found)


def _turn(roll: float, pitch: float, yaw: float) -> Turn:
    """Return the matrix Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr, cp, sp, cy, sy = (f(x) for x in (roll, pitch, yaw) for f in (cos, sin))
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def _arm(path: Path, arm: _Arm, limits: _Limits) -> tuple[ChainRow, ...]:
    """Return the usual six joints with what the file says otherwise, or as many as ``arm.a_m`` has."""
    usual = six_joint_template()
    if arm.a_m is not None and len(arm.a_m) != len(usual):
        usual = tuple(ChainRow(a, 0.0, 0.0) for a in arm.a_m)
    rows = tuple(
        ChainRow(*row)
        for row in zip(
            _column(path, "arm.a_m", arm.a_m, [row.a for row in usual]),
            _column(path, "arm.d_m", arm.d_m, [row.d for row in usual]),
            _column(path, "arm.alpha_rad", arm.alpha_rad, [row.alpha for row in usual]),
            _column(path, "arm.designed", arm.designed, [row.designed for row in usual]),
            _column(path, "limits.lower_rad", limits.lower_rad, [row.lower for row in usual]),
            _column(path, "limits.upper_rad", limits.upper_rad, [row.upper for row in usual]),
            strict=True,
        )
    )
    for i, row in enumerate(rows):
        if not row.lower < row.upper:
            expected = f"less than limits.upper_rad[{i}] = {row.upper}"
            raise InvalidFile(path, f"limits.lower_rad[{i}]", f"{row.lower}", expected)
    return rows


def _column(path: Path, field: str, given: list[T] | None, usual: list[T]) -> list[T]:
    if given is None:
        return usual
    if len(given) != len(usual):
        expected = f"{len(usual)} of them, one for each joint"
        raise InvalidFile(path, field, f"{len(given)} of them", expected)
    return given
