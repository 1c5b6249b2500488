"""The path that an arm's tip has to follow, as points by a path parameter.

The parameter of a circle runs from 0 to 1 once around, that of a polyline from vertex to vertex by
one. Task points are parameters, not places, so that points can be added where a plan fails.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidTask
from tramnet_workers.kernels.transforms import sincos

Floats = NDArray[np.float64]

_TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Circle:
    """A circle, once around from its rightmost point, anticlockwise.

    Attributes:
        centre: Its centre [m].
        radius: Its radius [m].
    """

    centre: tuple[float, float]
    radius: float

    def __post_init__(self) -> None:
        for i, coordinate in enumerate(self.centre):
            if not np.isfinite(coordinate):
                raise InvalidTask(f"circle.centre[{i}]", f"{coordinate}", "a finite number")
        if not 0.0 < self.radius < np.inf:
            raise InvalidTask("circle.radius", f"{self.radius}", "a finite number above 0")

    @property
    def closed(self) -> bool:
        """Whether the end is the beginning."""
        return True

    @property
    def length(self) -> float:
        """Largest parameter; that of the beginning, too, if the path is closed."""
        return 1.0

    def point(self, s: float) -> Floats:
        """Return the point at a parameter, of shape (2,) [m]."""
        turn = sincos(_TURN * (s % 1.0))
        x, y = self.centre
        return np.array([x + self.radius * turn.cosine, y + self.radius * turn.sine])

    def even_stations(self, count: int) -> Floats:
        """Return parameters of ``count`` evenly spaced points."""
        stations: Floats = np.arange(float(count)) / count
        return stations

    def parameters(self) -> dict[str, object]:
        """Return plain values."""
        return {"kind": "circle", "centre": list(self.centre), "radius": self.radius}


@dataclass(frozen=True)
class Polyline:
    """Straight lines from vertex to vertex.

    Attributes:
        vertices: The vertices, as pairs [m].
        closed: Whether a line leads from the last to the first.
    """

    vertices: tuple[tuple[float, float], ...]
    closed: bool = False

    def __post_init__(self) -> None:
        if not self.vertices:
            raise InvalidTask("points", "none", "one point at least")
        for i, vertex in enumerate(self.vertices):
            if len(vertex) != 2 or not np.isfinite(vertex).all():
                raise InvalidTask(f"points[{i}]", f"{vertex}", "two finite numbers x, y")

    @property
    def length(self) -> float:
        """Largest parameter; that of the beginning, too, if the path is closed."""
        return float(len(self.vertices) if self.closed else len(self.vertices) - 1)

    def point(self, s: float) -> Floats:
        """Return the point at a parameter, of shape (2,) [m]."""
        k = len(self.vertices)
        start = int(s)
        a, b = np.array(self.vertices[start % k]), np.array(self.vertices[(start + 1) % k])
        point: Floats = a + (s - start) * (b - a)
        return point

    def even_stations(self, count: int) -> Floats:
        """Return parameters of ``count`` points: the vertices, or evenly spaced ones."""
        if count == len(self.vertices):
            return np.arange(float(count))
        steps = count if self.closed else max(count - 1, 1)
        stations: Floats = np.arange(float(count)) * (self.length / steps)
        return stations

    def parameters(self) -> dict[str, object]:
        """Return plain values."""
        vertices = [list(vertex) for vertex in self.vertices]
        return {"kind": "polyline", "vertices": vertices, "closed": self.closed}


Trajectory: TypeAlias = Circle | Polyline


def grid(
    lower: tuple[float, float], upper: tuple[float, float], columns: int, rows: int
) -> Polyline:
    """Return a grid of points that fills a rectangle, row by row, to and fro."""
    xs, ys = np.linspace(lower[0], upper[0], columns), np.linspace(lower[1], upper[1], rows)
    ordered = [
        (float(x), float(y)) for i, y in enumerate(ys) for x in (xs if i % 2 == 0 else xs[::-1])
    ]
    return Polyline(tuple(ordered))


def intervals(trajectory: Trajectory, stations: Floats) -> list[tuple[float, float]]:
    """Return beginning and end of the intervals between neighbouring stations, in order.

    The end of the interval that closes a path is beyond its length.
    """
    ends = list(stations[1:])
    if trajectory.closed and len(stations) > 1:
        ends.append(stations[0] + trajectory.length)
    return [(float(a), float(b)) for a, b in zip(stations, ends, strict=False)]


def trajectory_from(parameters: Mapping[str, object]) -> Trajectory:
    """Rebuild a path from what its ``parameters`` returned."""
    match parameters:
        case {"kind": "circle", "centre": [x, y], "radius": radius}:
            return Circle((float(x), float(y)), float(radius))  # type: ignore[arg-type]
        case {"kind": "polyline", "vertices": list(vertices), "closed": bool(closed)}:
            return Polyline(tuple((float(x), float(y)) for x, y in vertices), closed)
    raise InvalidTask("trajectory", f"{dict(parameters)}", "the parameters of a circle or polyline")
