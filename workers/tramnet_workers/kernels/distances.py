"""Exact distance from a line segment to a box with sides along the axes.

Along the line a + t d the squared distance to the box, f(t), is convex with a continuous slope that
is linear between the (at most six) points where the line crosses a plane of a side. So the smallest
f lies in that piece between two crossings in which the slope changes its sign, and there it is found
by one division; on the segment it is the same t, brought into [0, 1]. Three comparisons find the
piece among the sorted crossings. All steps are the same for all segments, degenerate ones included:
a point, a flat box, a segment within a side.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel

Array = NDArray[np.float64]

# A segment shorter than this along an axis crosses no plane of that axis at a t that matters [cm].
_SHORTEST = 1e-100


class Vector(NamedTuple):
    """A vector of three components in the base frame [cm]."""

    x: float
    y: float
    z: float


class Box(NamedTuple):
    """A box with sides along the axes of the base [cm]."""

    lower: Vector
    upper: Vector


class Approach(NamedTuple):
    """Where a segment comes nearest to a box.

    Attributes:
        squared: Squared distance; 0 where they meet [cm²].
        t: Place on the segment, 0 at its start to 1 at its end.
    """

    squared: float
    t: float


@kernel
def segment_box_distances(starts: Array, ends: Array, boxes: Array) -> Array:
    """Compute the distances of segments from boxes, pair by pair.

    Args:
        starts: Starts of the segments, of shape (k, 3) [cm].
        ends: Their ends, of shape (k, 3) [cm].
        boxes: Boxes as (lower x, y, z, upper x, y, z), of shape (k, 6) [cm].

    Returns:
        Distances, of shape (k,) [cm].
    """
    distances = np.empty(len(starts))
    for i in range(len(starts)):
        start, end = vector_at(starts, i), vector_at(ends, i)
        distances[i] = np.sqrt(approach(start, subtract(end, start), box_at(boxes, i)).squared)
    return distances


@device
def approach(a: Vector, d: Vector, box: Box) -> Approach:
    """Find where the segment from a to a + d comes nearest to a box."""
    tx, ux = _crossings(a.x, d.x, box.lower.x, box.upper.x)
    ty, uy = _crossings(a.y, d.y, box.lower.y, box.upper.y)
    tz, uz = _crossings(a.z, d.z, box.lower.z, box.upper.z)
    t0, t1 = _piece(a, d, box, _merged(tx, ux, ty, uy, tz, uz))
    t0, t1 = _clamp(t0, 0.0, 1.0), _clamp(t1, 0.0, 1.0)
    middle = 0.5 * (t0 + t1)
    e = _excess(_along(a, d, middle), box)
    curvature = (
        (d.x * d.x if e.x != 0.0 else 0.0)
        + (d.y * d.y if e.y != 0.0 else 0.0)
        + (d.z * d.z if e.z != 0.0 else 0.0)
    )
    t = _clamp(middle - _dot(d, e) * _inverse(curvature), t0, t1)
    e = _excess(_along(a, d, t), box)
    return Approach(_dot(e, e), t)


@device
def outside(point: Vector, box: Box) -> Vector:
    """Return the vector to a point from the nearest point of a box."""
    return _excess(point, box)


@device
def vector_at(rows: Array, i: int) -> Vector:
    """Return row i, (x, y, z)."""
    return Vector(rows[i, 0], rows[i, 1], rows[i, 2])


@device
def box_at(rows: Array, i: int) -> Box:
    """Return the box of row i, (lower x, y, z, upper x, y, z)."""
    upper = Vector(rows[i, 3], rows[i, 4], rows[i, 5])
    return Box(vector_at(rows, i), upper)


@device
def subtract(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return Vector(a.x - b.x, a.y - b.y, a.z - b.z)


@device
def _crossings(a: float, d: float, lower: float, upper: float) -> tuple[float, float]:
    """Return the t, in order, at which one coordinate passes the two sides of a box."""
    inverse = _inverse(d)
    return _ordered((lower - a) * inverse, (upper - a) * inverse)


@device
def _inverse(d: float) -> float:
    return 1.0 / d if abs(d) > _SHORTEST else 0.0


@device
def _merged(
    a: float, b: float, c: float, d: float, e: float, f: float
) -> tuple[float, float, float, float, float, float]:
    """Sort three ordered pairs (a, b), (c, d), (e, f)."""
    a, c = _ordered(a, c)
    a, e = _ordered(a, e)
    b, d = _ordered(b, d)
    d, f = _ordered(d, f)
    b, c = _ordered(b, c)
    d, e = _ordered(d, e)
    b, d = _ordered(b, d)
    c, e = _ordered(c, e)
    c, d = _ordered(c, d)
    return a, b, c, d, e, f


@device
def _piece(
    origin: Vector,
    direction: Vector,
    box: Box,
    crossings: tuple[float, float, float, float, float, float],
) -> tuple[float, float]:
    """Return the ends of the piece in which the slope changes its sign, by bisection."""
    a, b, c, d, e, f = crossings
    after_d = _slope(origin, direction, box, d) < 0.0
    t0, t1 = (d if after_d else 0.0), (1.0 if after_d else d)
    m = f if after_d else b
    after_m = _slope(origin, direction, box, m) < 0.0
    t0, t1 = (m if after_m else t0), (t1 if after_m else m)
    m = (f if after_m else e) if after_d else (c if after_m else a)
    after_m = _slope(origin, direction, box, m) < 0.0
    return (m if after_m else t0), (t1 if after_m else m)


@device
def _slope(a: Vector, d: Vector, box: Box, t: float) -> float:
    """Return half of f'(t)."""
    return _dot(d, _excess(_along(a, d, t), box))


@device
def _along(a: Vector, d: Vector, t: float) -> Vector:
    return Vector(a.x + t * d.x, a.y + t * d.y, a.z + t * d.z)


@device
def _excess(p: Vector, box: Box) -> Vector:
    return Vector(
        p.x - _clamp(p.x, box.lower.x, box.upper.x),
        p.y - _clamp(p.y, box.lower.y, box.upper.y),
        p.z - _clamp(p.z, box.lower.z, box.upper.z),
    )


@device
def _dot(a: Vector, b: Vector) -> float:
    return a.x * b.x + a.y * b.y + a.z * b.z


@device
def _clamp(value: float, lower: float, upper: float) -> float:
    return min(max(value, lower), upper)


@device
def _ordered(a: float, b: float) -> tuple[float, float]:
    return min(a, b), max(a, b)
