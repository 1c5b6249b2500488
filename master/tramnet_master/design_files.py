"""A user's own task for ``crank``, read once, here; what passes can be relied on everywhere else.

    most_returns = 3                               # to step 1, at most
    terms = ["isotropy"]                           # task constraints by name, added up in TC

    [points]                                       # one of the first three keys
    circle = {centre = [0.8, 0.4], radius = 0.25, count = 4}
    list = [[0.5, 0.1], [0.6, 0.3]]                # [m]
    csv = "points.csv"                             # beside this file, with columns x_m and y_m
    closed = false                                 # whether the last point leads to the first

    [limits]                                       # a number a joint, and so a link
    lower_rad = [-3.14, -2.6, -2.6]
    upper_rad = [3.14, 2.6, 2.6]

    [weights]                                      # of eq (4); those of the settings if left out
    dm = 1.0                                       # and tc, rc, hc, jlc, lc, bpc, jac

    [stock]                                        # of link modules; one of the keys
    lengths_m = [0.3, 0.4, 0.5]
    csv = "stock.csv"                              # with columns length_m and, if few, quantity

    [base]
    free = false                                   # whether its place is to be found
    position_m = [0.0, 0.0]                        # if it is given
    lower_m = [-0.5, -0.5]                         # if it is free
    upper_m = [0.5, 0.5]
    mobility_m = inf                               # how far it may move between points, if it may

    [genes]                                        # places of joints, relative to the base
    bits = 10
    lower_m = -1.2
    upper_m = 1.2

    [arm]                                          # if its links are not to be designed
    lengths_m = [0.45, 0.45, 0.45]

    [prismatic]                                    # joints that extend links
    links = [2]                                    # counted from 1 at the base
    lengths_m = [0.3]                              # longest strokes
    scales_m = [0.3]                               # what makes strokes comparable to angles

    [obstacles]
    boxes_m = [[0.2, 0.5, 0.4, 0.7]]               # x_min, y_min, x_max, y_max

Everything but the points may be left out. Spatial arms have files of their own (``spatial_files``).
"""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, TypeAlias

import msgspec
from msgspec import Meta, Struct

from tramnet_master.errors import InvalidFile
from tramnet_master.strict_toml import read_strictly
from tramnet_master.user_csv import read_beside, read_columns
from tramnet_workers.errors import InvalidTask
from tramnet_workers.problems.design_task import MOST_POINTS, Base, DesignTask, Genes, Stroke
from tramnet_workers.problems.stock import Stock
from tramnet_workers.problems.task_terms import find_task_term
from tramnet_workers.problems.trajectory import Circle, Polyline, Trajectory

Angles: TypeAlias = Annotated[list[float], Meta(description="one angle for each joint [rad]")]
Weight: TypeAlias = Annotated[float, Meta(ge=0, description="a weight, at least 0")]
Bits: TypeAlias = Annotated[int, Meta(ge=5, le=16, description="a whole number from 5 to 16")]
Lengths: TypeAlias = Annotated[list[float], Meta(description="a list of lengths [m]")]
FileName: TypeAlias = Annotated[
    str, Meta(min_length=1, description="the name of a CSV file beside this one")
]
_Point: TypeAlias = Annotated[tuple[float, float], Meta(description="2 numbers x, y [m]")]
_Count: TypeAlias = Annotated[
    int, Meta(ge=1, le=MOST_POINTS, description=f"a whole number from 1 to {MOST_POINTS}")
]
_Box: TypeAlias = tuple[float, float, float, float]


class _Circle(Struct, frozen=True):
    centre: _Point
    radius: float
    count: _Count


class _Points(Struct, frozen=True, rename={"vertices": "list"}):
    circle: _Circle | None = None
    vertices: list[_Point] | None = None
    csv: FileName | None = None
    closed: bool | None = None


class _Limits(Struct, frozen=True):
    lower_rad: Angles | None = None
    upper_rad: Angles | None = None


class WeightsTable(Struct, frozen=True):
    """Weights of eq (4) that a file gives."""

    dm: Weight | None = None
    tc: Weight | None = None
    rc: Weight | None = None
    hc: Weight | None = None
    jlc: Weight | None = None
    lc: Weight | None = None
    bpc: Weight | None = None
    jac: Weight | None = None

    def given(self) -> dict[str, float]:
        """Those that are given, by name."""
        return {name: w for name, w in msgspec.structs.asdict(self).items() if w is not None}


class _StockTable(Struct, frozen=True):
    lengths_m: Lengths | None = None
    csv: FileName | None = None


class _BaseTable(Struct, frozen=True):
    free: bool | None = None
    position_m: _Point = Base.position
    lower_m: _Point = Base.lower
    upper_m: _Point = Base.upper
    mobility_m: Annotated[float, Meta(ge=0, description="a distance [m], or inf")] | None = None


class _GenesTable(Struct, frozen=True):
    bits: Bits = Genes.bits
    lower_m: float = Genes.lower
    upper_m: float = Genes.upper


class _Arm(Struct, frozen=True):
    lengths_m: Lengths | None = None


class _Prismatic(Struct, frozen=True):
    links: Annotated[list[int], Meta(description="links, counted from 1 at the base")] = []
    lengths_m: Lengths = []
    scales_m: Lengths | None = None


class _Obstacles(Struct, frozen=True):
    boxes_m: Annotated[list[_Box], Meta(description="a list of 4 numbers a box")] = []


class _TaskFile(Struct, frozen=True):
    points: _Points
    limits: _Limits = _Limits()
    weights: WeightsTable = WeightsTable()
    stock: _StockTable = _StockTable()
    base: _BaseTable = _BaseTable()
    genes: _GenesTable = _GenesTable()
    arm: _Arm = _Arm()
    prismatic: _Prismatic = _Prismatic()
    obstacles: _Obstacles = _Obstacles()
    terms: list[str] = []
    most_returns: Annotated[int, Meta(ge=0, le=100, description="0 to 100")] = (
        DesignTask.most_returns
    )


DEFAULT = DesignTask()
"""What is not in a file."""

_UNBOUNDED = ("base.mobility_m",)

# Names in a DesignTask, with those in the file; the first that fits counts.
_FIELDS = (
    (r"(?<![\w.])lower\b(?=$|\[)", "limits.lower_rad"),
    (r"(?<![\w.])upper\b(?=$|\[)", "limits.upper_rad"),
    (r"\bbase\.(position|lower|upper)\b", r"base.\1_m"),
    (r"\bgenes\.(lower|upper)\b", r"genes.\1_m"),
    (r"\bstock\.lengths\b", "stock.lengths_m"),
    (r"^boxes\b", "obstacles.boxes_m"),
    (r"^lengths\b", "arm.lengths_m"),
    (r"^mobility\b", "base.mobility_m"),
    (r"^strokes(\[\d+\])\.(link|length|scale)$", r"prismatic.\2s_m\1"),
    (r"^circle\b", "points.circle"),
    (r"^points\b", "points.list"),
    (r"^stations\b.*", "points"),
)


def read_design_task(path: Path) -> DesignTask:
    """Read a task file of ``crank`` for a planar arm.

    Raises:
        InvalidFile: With the field that is wrong, what was found and what was expected.
    """
    file = read_strictly(path, _TaskFile, unbounded=_UNBOUNDED)
    points = file.points
    with names_of(path):
        trajectory, count = _trajectory(path, points)
        lower, upper = _limits(path, file.limits)
        for name in file.terms:
            find_task_term(name)
        task = DesignTask(
            trajectory=trajectory,
            stations=tuple(float(s) for s in trajectory.even_stations(count)),
            lower=lower,
            upper=upper,
            weights=file.weights.given(),
            stock=_stock(path, file.stock),
            base=_base(file.base),
            genes=Genes(file.genes.bits, file.genes.lower_m, file.genes.upper_m),
            boxes=tuple(file.obstacles.boxes_m),
            terms=tuple(file.terms),
            mobility=file.base.mobility_m,
            most_returns=file.most_returns,
        )
        strokes = _strokes(path, file.prismatic, task.n_links)
        given = file.arm.lengths_m
        return replace(task, strokes=strokes, lengths=None if given is None else tuple(given))


@contextmanager
def names_of(path: Path) -> Iterator[None]:
    """Give a design task's complaint the names of the file that it was read from.

    Raises:
        InvalidFile: In place of an ``InvalidTask``.
    """
    try:
        yield
    except InvalidTask as error:
        raise InvalidFile(
            path, _renamed(error.field), error.found, _renamed(error.expected)
        ) from error


def one_of(path: Path, table: str, given: Mapping[str, object], required: bool) -> None:
    """Check that one key of a table is there, or at most one.

    Args:
        path: The file.
        table: Name of the table.
        given: The keys, with what stands there.
        required: Whether one has to be there.

    Raises:
        InvalidFile: There are more, or none.
    """
    found = [key for key, value in given.items() if value is not None]
    if len(found) > 1 or (required and not found):
        expected = f"one of {', '.join(given)}"
        raise InvalidFile(path, table, " and ".join(found) or "none of its keys", expected)


def _renamed(text: str) -> str:
    for pattern, name in _FIELDS:
        found = re.sub(pattern, name, text)
        if found != text:
            return found.replace("links_m", "links")
    return text


def _trajectory(path: Path, points: _Points) -> tuple[Trajectory, int]:
    """Return the path of the tip and the number of task points on it."""
    given = {"circle": points.circle, "list": points.vertices, "csv": points.csv}
    one_of(path, "points", given, required=True)
    if points.circle is not None:
        if points.closed is False:
            raise InvalidFile(path, "points.closed", "false", "true, or nothing, for a circle")
        circle = points.circle
        return Circle(circle.centre, circle.radius), circle.count
    if points.csv is not None:
        csv_path, text = read_beside(path, "points.csv", points.csv)
        vertices = [(x, y) for x, y in read_columns(csv_path, text, ("x_m", "y_m"))]
        _check_count(csv_path, "", len(vertices))
    else:
        vertices = points.vertices or []
        _check_count(path, "points.list", len(vertices))
    return Polyline(tuple(vertices), bool(points.closed)), len(vertices)


def _check_count(path: Path, field: str, count: int) -> None:
    if not 1 <= count <= MOST_POINTS:
        raise InvalidFile(path, field, f"{count} points", f"1 to {MOST_POINTS} points")


def _limits(path: Path, limits: _Limits) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return smallest and largest angles; where one is given, it has to fit the other's default."""
    found: list[tuple[float, ...]] = []
    given = {"lower": limits.lower_rad, "upper": limits.upper_rad}
    for (name, angles), default in zip(given.items(), (DEFAULT.lower, DEFAULT.upper), strict=True):
        other = given["upper" if name == "lower" else "lower"]
        if angles is None and other is not None and len(other) != len(default):
            expected = f"{len(other)} numbers, as many as the other limits have"
            raise InvalidFile(path, f"limits.{name}_rad", "nothing", expected)
        found.append(default if angles is None else tuple(angles))
    return found[0], found[1]


def _stock(path: Path, stock: _StockTable) -> Stock:
    one_of(path, "stock", {"lengths_m": stock.lengths_m, "csv": stock.csv}, required=False)
    if stock.lengths_m is not None:
        return Stock.of_lengths(stock.lengths_m)
    if stock.csv is not None:
        _, text = read_beside(path, "stock.csv", stock.csv)
        return Stock.from_csv(text, stock.csv)
    return DEFAULT.stock


def _base(base: _BaseTable) -> Base:
    """Return where the arm stands; a base that may move is free if the file says nothing else."""
    free = base.mobility_m is not None if base.free is None else base.free
    return Base(free, base.position_m, base.lower_m, base.upper_m)


def _strokes(path: Path, table: _Prismatic, n_links: int) -> tuple[Stroke, ...]:
    scales = [Stroke.scale] * len(table.links) if table.scales_m is None else table.scales_m
    for name, values in (("lengths_m", table.lengths_m), ("scales_m", scales)):
        if len(values) != len(table.links):
            expected = f"{len(table.links)}, as many as prismatic.links has"
            raise InvalidFile(path, f"prismatic.{name}", f"{len(values)} numbers", expected)
    for i, link in enumerate(table.links):
        if not 1 <= link <= n_links:
            raise InvalidFile(
                path, f"prismatic.links[{i}]", f"{link}", f"a link from 1 to {n_links}"
            )
    rows = zip(table.links, table.lengths_m, scales, strict=True)
    return tuple(Stroke(link - 1, length, scale) for link, length, scale in rows)
