"""Differential kinematics of one posture: Gauss-Newton steps, null space, gradient of clearance.

The Jacobian J of the tip has the columns z_j x (tip - o_j). A step dq = J+ e with the pseudo-inverse
J+ = J^T (J J^T)^-1 (Lin, Chen & Yu 2017, eq. 5) leads the tip by e; adding (I - J+ J) g moves the
arm in the direction g as far as the tip does not notice (eq. 6).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.distances import (
    Vector,
    approach,
    box_at,
    outside,
    subtract,
    vector_at,
)
from tramnet_workers.kernels.kinematics import joint_axes
from tramnet_workers.kernels.scenes import Scene, step_cost
from tramnet_workers.kernels.tracking import Stage

Array = NDArray[np.float64]

# Keeps J J^T invertible where the arm is stretched out, relative to its trace.
_DAMPING = 1e-9

_TINY = 1e-12  # a distance from which no direction can be told [cm]


class Ascent(NamedTuple):
    """How an arm moves away from the boxes in the null space.

    Attributes:
        gain: Step per gradient of the clearance and per clearance [rad²/cm²].
        sharpness: How much a nearer link counts more than a farther one; see ``_find_gradient``.
    """

    gain: float
    sharpness: int


class Tangent(NamedTuple):
    """A posture and its derivatives.

    Attributes:
        q: Joint angles, of shape (n,) [rad].
        axes: Unit vectors along the joints' axes, of shape (n, 3).
        points: Origins of the joints, and the tip, of shape (n + 1, 3) [cm].
        jacobian: Derivative of the tip, of shape (3, n) [cm/rad].
        gradient: A direction in joint space, of shape (n,).
        free: 1 for a joint that may still move, else 0, of shape (n,).
    """

    q: Array
    axes: Array
    points: Array
    jacobian: Array
    gradient: Array
    free: Array


@kernel
def new_tangent(n: int) -> Tangent:
    """Return storage for the derivatives of an arm of n joints."""
    return Tangent(
        np.empty(n),
        np.empty((n, 3)),
        np.empty((n + 1, 3)),
        np.empty((3, n)),
        np.empty(n),
        np.empty(n),
    )


@kernel
def correct_step(
    scene: Scene, stage: Stage, q: Array, n_corrections: int, tangent: Tangent, dq: Array
) -> float:
    """Bring the tip nearer to the target by Gauss-Newton steps within the limits.

    A joint that reaches a limit stays there, and the others take over.

    Args:
        scene: The task.
        stage: From ``set_stage``.
        q: Present joint angles, of shape (n,) [rad].
        n_corrections: Number of Gauss-Newton steps.
        tangent: Scratch.
        dq: The step to correct, in place, of shape (n,) [rad].

    Returns:
        Cost of the corrected step.
    """
    tangent.free[:] = 1.0
    for _ in range(n_corrections):
        _look_at(scene, q, dq, tangent)
        y = _solve(tangent, _missing(stage, tangent))
        for j in range(len(q)):
            change = tangent.free[j] * _transposed(tangent, j, y)
            wanted = dq[j] + change
            dq[j] = min(max(wanted, stage.low[j]), stage.high[j])
            if dq[j] != wanted:
                tangent.free[j] = 0.0
    _look_at(scene, q, dq, tangent)
    return _cost(scene, stage, tangent)


@kernel
def resolve_step(
    scene: Scene,
    stage: Stage,
    q: Array,
    ascent: Ascent,
    n_corrections: int,
    tangent: Tangent,
    dq: Array,
) -> float:
    """Find a step by resolved-rate control, moving away from the boxes in the null space.

    Args:
        scene: The task.
        stage: From ``set_stage``.
        q: Present joint angles, of shape (n,) [rad].
        ascent: How the arm moves away from the boxes.
        n_corrections: Number of Gauss-Newton steps afterwards.
        tangent: Scratch.
        dq: Receives the step, of shape (n,) [rad].

    Returns:
        Cost of the step.
    """
    dq[:] = 0.0
    tangent.free[:] = 1.0
    _look_at(scene, q, dq, tangent)
    y = _solve(tangent, _missing(stage, tangent))
    for j in range(len(q)):
        dq[j] = min(max(_transposed(tangent, j, y), stage.low[j]), stage.high[j])
    share = ascent.gain * _find_gradient(scene, ascent.sharpness, tangent)
    _project(tangent)
    for j in range(len(q)):
        g = tangent.gradient[j]
        room = stage.high[j] - dq[j] if g > 0.0 else stage.low[j] - dq[j]
        if abs(g) * share > abs(room):
            share = room / g
    for j in range(len(q)):
        step = dq[j] + share * tangent.gradient[j]
        dq[j] = min(max(step, stage.low[j]), stage.high[j])
    return correct_step(scene, stage, q, n_corrections, tangent, dq)


@device
def _look_at(scene: Scene, q: Array, dq: Array, tangent: Tangent) -> None:
    """Compute points and Jacobian at q + dq."""
    for j in range(len(q)):
        tangent.q[j] = q[j] + dq[j]
    joint_axes(scene.chain, tangent.q, tangent.axes, tangent.points)
    tip = vector_at(tangent.points, len(q))
    for j in range(len(q)):
        arm = subtract(tip, vector_at(tangent.points, j))
        column = _cross(vector_at(tangent.axes, j), arm)
        tangent.jacobian[0, j] = column.x
        tangent.jacobian[1, j] = column.y
        tangent.jacobian[2, j] = column.z


@device
def _missing(stage: Stage, tangent: Tangent) -> Vector:
    """Return the vector from the tip to the target."""
    target = Vector(stage.target[0], stage.target[1], stage.target[2])
    return subtract(target, vector_at(tangent.points, len(tangent.points) - 1))


@device
def _solve(tangent: Tangent, e: Vector) -> Vector:
    """Return y with (J J^T + damping) y = e, for the columns of the free joints."""
    xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(len(tangent.q)):
        free = tangent.free[j]
        x, y, z = tangent.jacobian[0, j], tangent.jacobian[1, j], tangent.jacobian[2, j]
        xx += free * x * x
        xy += free * x * y
        xz += free * x * z
        yy += free * y * y
        yz += free * y * z
        zz += free * z * z
    damping = _DAMPING * (xx + yy + zz) + _TINY
    xx, yy, zz = xx + damping, yy + damping, zz + damping
    # Cramer's rule: the matrix is symmetric, and so is its adjugate.
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    d, f, g = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    inverse = 1.0 / (xx * a + xy * b + xz * c)
    return Vector(
        (a * e.x + b * e.y + c * e.z) * inverse,
        (b * e.x + d * e.y + f * e.z) * inverse,
        (c * e.x + f * e.y + g * e.z) * inverse,
    )


@device
def _transposed(tangent: Tangent, j: int, y: Vector) -> float:
    """Return element j of J^T y."""
    jacobian = tangent.jacobian
    return float(jacobian[0, j] * y.x + jacobian[1, j] * y.y + jacobian[2, j] * y.z)


@device
def _project(tangent: Tangent) -> None:
    """Take from the gradient g what moves the tip: (I - J+ J) g."""
    x, y, z = 0.0, 0.0, 0.0
    for j in range(len(tangent.q)):
        g = tangent.gradient[j]
        x += tangent.jacobian[0, j] * g
        y += tangent.jacobian[1, j] * g
        z += tangent.jacobian[2, j] * g
    solution = _solve(tangent, Vector(x, y, z))
    for j in range(len(tangent.q)):
        tangent.gradient[j] -= _transposed(tangent, j, solution)


@device
def _find_gradient(scene: Scene, sharpness: int, tangent: Tangent) -> float:
    """Compute the gradient of the smoothed clearance, and return the clearance.

    (sum d_i^-p)^(-1/p) over all pairs of link and box has the gradient sum r_i^(p + 1) grad d_i with
    r_i the ratio of it to d_i; here the weights are normalised. The gradient of the plain minimum
    jumps from link to link, and the arm would tremble on the ridge between them.
    """
    least = np.inf
    for link in range(len(scene.links)):
        for box in range(len(scene.boxes)):
            least = min(least, _distance(scene, tangent, link, box))
    tangent.gradient[:] = 0.0
    total = 0.0
    for link in range(len(scene.links)):
        for box in range(len(scene.boxes)):
            distance = _distance(scene, tangent, link, box)
            if distance > _TINY:
                weight = _power(least / distance, sharpness + 1)
                _add_gradient(scene, tangent, link, box, weight)
                total += weight
    if total > 0.0:
        for j in range(len(tangent.gradient)):
            tangent.gradient[j] /= total
    return least if total > 0.0 else 0.0


@device
def _power(base: float, exponent: int) -> float:
    result = 1.0
    for _ in range(exponent):
        result *= base
    return result


@device
def _add_gradient(scene: Scene, tangent: Tangent, link: int, box: int, weight: float) -> None:
    """Add the gradient of the distance between one link and one box."""
    start, end = scene.links[link, 0], scene.links[link, 1]
    a, b = vector_at(tangent.points, start), vector_at(tangent.points, end)
    obstacle = box_at(scene.boxes, box)
    d = subtract(b, a)
    t = approach(a, d, obstacle).t
    contact = Vector(a.x + t * d.x, a.y + t * d.y, a.z + t * d.z)
    away = outside(contact, obstacle)
    scale = weight / np.sqrt(away.x * away.x + away.y * away.y + away.z * away.z)
    for j in range(start + 1):
        arm = subtract(contact, vector_at(tangent.points, j))
        v = _cross(vector_at(tangent.axes, j), arm)
        tangent.gradient[j] += scale * (away.x * v.x + away.y * v.y + away.z * v.z)


@kernel
def _distance(scene: Scene, tangent: Tangent, link: int, box: int) -> float:
    start, end = scene.links[link, 0], scene.links[link, 1]
    a, b = vector_at(tangent.points, start), vector_at(tangent.points, end)
    return float(np.sqrt(approach(a, subtract(b, a), box_at(scene.boxes, box)).squared))


@device
def _cost(scene: Scene, stage: Stage, tangent: Tangent) -> float:
    least = np.inf
    for link in range(len(scene.links)):
        for box in range(len(scene.boxes)):
            least = min(least, _distance(scene, tangent, link, box))
    e = _missing(stage, tangent)
    return step_cost(scene.objective, e.x * e.x + e.y * e.y + e.z * e.z, least * least)


@device
def _cross(a: Vector, b: Vector) -> Vector:
    return Vector(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
