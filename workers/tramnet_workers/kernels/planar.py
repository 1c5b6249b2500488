"""Planar arms at task points: places of their joints, and the terms of eq (4) that need no others.

Kim & Khosla (1992), sections 2 and 5. An arm of n links at task point p is given either by the
places of joints 2 ... n, its last link then ending at p (no inverse kinematics, no elbow variable,
no period of angles), or by its joint angles and link lengths, and then RC stands in for the inverse
kinematics. Rows of genes: pose (places relative to the base, or angles), strokes of prismatic
joints, base, link lengths (not used with places). Shapes as in ``kernels.design``.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.design import DM, HC, JLC, RC, TC
from tramnet_workers.kernels.order import wrap
from tramnet_workers.kernels.transforms import atan2, sincos

Floats = NDArray[np.float64]
_NEVER_ZERO = 1e-300


class PlanarModel(NamedTuple):
    """What is known of the arm before a design.

    Attributes:
        by_place: Whether genes are places of joints; else they are angles and lengths.
        limits: Smallest and largest joint angles, of shape (2, n) [rad].
        strokes: One row a prismatic joint: the link, from 0, that it extends, and the length that
            makes it comparable to an angle in the Jacobian [m], of shape (n_strokes, 2).
        boxes: Obstacles as rows x_min, y_min, x_max, y_max, of shape (n_boxes, 4) [m].
        printed_hc: Whether HC has the sign printed in the paper, which makes degenerate arms.
    """

    by_place: bool
    limits: Floats
    strokes: Floats
    boxes: Floats
    printed_hc: bool


@kernel
def evaluate_planar(
    model: PlanarModel, points: Floats, genes: Floats, places: Floats, traits: Floats, terms: Floats
) -> None:
    """Compute places, traits and terms of k populations.

    Args:
        model: What is known of the arm.
        points: Task points of the populations, of shape (k, 2) [m].
        genes: Genes, of shape (k, n_genes, m) [m, rad].
        places: Receives the places of joints and tip, of shape (k, n + 1, 2, m) [m].
        traits: Receives the traits, of shape (k, n_traits, m) [m, rad].
        terms: Receives DM, TC, RC, HC and JLC, of shape (k, 8, m).
    """
    for i in range(len(genes)):
        if model.by_place:
            _read_places(model, points[i], genes[i], places[i], traits[i])
        else:
            _read_angles(model, genes[i], places[i], traits[i])
        _evaluate_arms(model, points[i], places[i], traits[i], terms[i])


@kernel
def _read_places(
    model: PlanarModel, point: Floats, genes: Floats, places: Floats, traits: Floats
) -> None:
    """Place the joints where the genes say and measure lengths and angles."""
    n = model.limits.shape[1]
    base = 2 * (n - 1) + len(model.strokes)
    for axis in range(2):
        origin = genes[base + axis]
        places[0, axis] = origin
        for k in range(1, n):
            offset, place = genes[2 * (k - 1) + axis], places[k, axis]
            for j in range(len(place)):
                place[j] = origin[j] + offset[j]
        places[n, axis] = point[axis]
        traits[n + axis] = origin
    for k in range(n):
        _measure_link(places, k, traits[k], traits[n + 2 + k])
    for s in range(len(model.strokes)):
        length, stroke = traits[int(model.strokes[s, 0])], genes[2 * (n - 1) + s]
        for j in range(len(length)):
            length[j] -= stroke[j]
        traits[2 * n + 2 + s] = stroke


@kernel
def _measure_link(places: Floats, k: int, length: Floats, angle: Floats) -> None:
    """Measure link k and the angle by which it turns from link k - 1, or from the x axis."""
    x0, y0, x1, y1 = places[k, 0], places[k, 1], places[k + 1, 0], places[k + 1, 1]
    if k == 0:
        for j in range(len(length)):
            x, y = x1[j] - x0[j], y1[j] - y0[j]
            length[j] = np.sqrt(x * x + y * y)
            angle[j] = atan2(y, x)
    else:
        xb, yb = places[k - 1, 0], places[k - 1, 1]
        for j in range(len(length)):
            x, y = x1[j] - x0[j], y1[j] - y0[j]
            u, v = x0[j] - xb[j], y0[j] - yb[j]
            length[j] = np.sqrt(x * x + y * y)
            angle[j] = atan2(u * y - v * x, u * x + v * y)


@kernel
def _read_angles(model: PlanarModel, genes: Floats, places: Floats, traits: Floats) -> None:
    """Place the joints by the angles and lengths that the genes give."""
    n, n_strokes = model.limits.shape[1], len(model.strokes)
    base = n + n_strokes
    places[0] = genes[base : base + 2]
    traits[:n] = genes[base + 2 : base + 2 + n]
    traits[n : n + 2] = genes[base : base + 2]
    traits[2 * n + 2 :] = genes[n : n + n_strokes]
    absolute = np.zeros(genes.shape[1])
    for k in range(n):
        length, turn, joint = genes[base + 2 + k], genes[k], traits[n + 2 + k]
        for j in range(len(length)):
            absolute[j] += turn[j]
            joint[j] = wrap(turn[j])
            s, c = sincos(absolute[j])
            places[k + 1, 0, j] = c
            places[k + 1, 1, j] = s
        reach = length.copy()
        for stroke in range(n_strokes):
            if model.strokes[stroke, 0] == k:
                reach += genes[n + stroke]
        for axis in range(2):
            near, far = places[k, axis], places[k + 1, axis]
            for j in range(len(length)):
                far[j] = near[j] + reach[j] * far[j]


@kernel
def _evaluate_arms(
    model: PlanarModel, point: Floats, places: Floats, traits: Floats, terms: Floats
) -> None:
    n = model.limits.shape[1]
    terms[:] = 0.0
    _add_dexterity(model, places, traits, terms[DM])
    for box in range(len(model.boxes)):
        for k in range(n):
            _add_crossing(model.boxes[box], places[k], places[k + 1], terms[TC])
    if not model.by_place:
        tip, rc = places[n], terms[RC]
        for j in range(len(rc)):
            x, y = point[0] - tip[0, j], point[1] - tip[1, j]
            rc[j] = np.sqrt(x * x + y * y)  # eq 6
    for k in range(n - 1):
        inner, outer = traits[k], traits[k + 1]
        if model.printed_hc:
            inner, outer = outer, inner
        _add_excess(outer, inner, terms[HC])
    for k in range(n):
        _add_limits(traits[n + 2 + k], model.limits[0, k], model.limits[1, k], terms[JLC])
    for s in range(len(model.strokes)):
        _add_limits(
            traits[int(model.strokes[s, 0])], 0.0, np.inf, terms[JLC]
        )  # a stroke needs its link


@kernel
def _add_dexterity(model: PlanarModel, places: Floats, traits: Floats, dm: Floats) -> None:
    """Add the relative manipulability, from the minors of the Jacobian (Cauchy & Binet).

    A revolute joint's column is the lever from it to the tip, turned by a right angle; so the minor
    of two of them is the cross product of the levers.
    """
    n, n_strokes = model.limits.shape[1], len(model.strokes)
    tip_x, tip_y = places[n]
    total = np.zeros(len(dm))
    for k in range(n):
        total += traits[k]
        x, y = places[k]
        for other in range(k + 1, n):
            u, v = places[other]
            for j in range(len(dm)):
                minor = (tip_x[j] - x[j]) * (tip_y[j] - v[j]) - (tip_y[j] - y[j]) * (
                    tip_x[j] - u[j]
                )
                dm[j] += minor * minor
    for s in range(n_strokes):
        total += traits[2 * n + 2 + s]
        _add_stroke_minors(model, s, places, dm)
    for j in range(len(dm)):
        square = max(total[j] * total[j], _NEVER_ZERO)
        dm[j] = np.sqrt(dm[j]) / square  # eqs 1, 2 and 5 with m = 2


@kernel
def _add_stroke_minors(model: PlanarModel, s: int, places: Floats, squares: Floats) -> None:
    """Add the squared minors of a prismatic joint's column with all revolute ones and later strokes."""
    n, link = model.limits.shape[1], int(model.strokes[s, 0])
    for j in range(len(squares)):
        x, y = _direction(places, link, j)
        x, y = model.strokes[s, 1] * x, model.strokes[s, 1] * y
        for k in range(n):
            minor = (places[n, 0, j] - places[k, 0, j]) * x
            minor += (places[n, 1, j] - places[k, 1, j]) * y
            squares[j] += minor * minor
        for later in range(s + 1, len(model.strokes)):
            u, v = _direction(places, int(model.strokes[later, 0]), j)
            minor = model.strokes[later, 1] * (x * v - y * u)
            squares[j] += minor * minor


@kernel
def _direction(places: Floats, link: int, j: int) -> tuple[float, float]:
    x = places[link + 1, 0, j] - places[link, 0, j]
    y = places[link + 1, 1, j] - places[link, 1, j]
    inverse = 1.0 / max(np.sqrt(x * x + y * y), _NEVER_ZERO)
    return x * inverse, y * inverse


@kernel
def _add_excess(larger: Floats, smaller: Floats, hc: Floats) -> None:
    for j in range(len(hc)):
        hc[j] += max(0.0, larger[j] - smaller[j])  # eq 7, its sign corrected


@kernel
def _add_limits(joint: Floats, lower: float, upper: float, jlc: Floats) -> None:
    for j in range(len(jlc)):
        jlc[j] += max(0.0, joint[j] - upper) + max(0.0, lower - joint[j])  # eq 8


@kernel
def _add_crossing(box: Floats, near: Floats, far: Floats, tc: Floats) -> None:
    """Add the length of a link that lies inside a box, TC of eq 4 for an obstacle [m]."""
    for j in range(len(tc)):
        enter, leave, square = 0.0, 1.0, 0.0
        for axis in range(2):
            run = far[axis, j] - near[axis, j]
            square += run * run
            run = run if abs(run) > _NEVER_ZERO else _NEVER_ZERO
            a = (box[axis] - near[axis, j]) / run
            b = (box[2 + axis] - near[axis, j]) / run
            enter = max(enter, min(a, b))
            leave = min(leave, max(a, b))
        tc[j] += max(0.0, leave - enter) * np.sqrt(square)
