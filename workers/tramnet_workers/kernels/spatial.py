"""Spatial arms of revolute joints at task points, given by angles, lengths and base position.

Kim & Khosla (1992), sections 2 and 5: a spatial arm has no short cut like the planar one, so RC (eq 6)
stands in for inverse kinematics. Links follow the standard Denavit-Hartenberg convention, T = Rz(theta)
Tz(d) Tx(a) Rx(alpha), of length l = sqrt(a^2 + d^2); some of the a and d are genes. Rows of genes: n
angles, base (3), designed lengths; rows of traits: designed lengths, base (3), angles. A task point is
a position and, if wanted, an orientation; errors and velocities of turning count ``scale`` metres a
radian.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.design import DM, HC, JLC, RC
from tramnet_workers.kernels.order import wrap
from tramnet_workers.kernels.roots import cube_root
from tramnet_workers.kernels.transforms import atan2, sincos

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_POSITION = 3  # order m of a task of positions; of one of poses it is 6
_NO_LINK = 1e-9  # lengths that HC does not compare [m]
_SNAP_STEPS = 30
_DAMPING = 1e-9


class SpatialModel(NamedTuple):
    """What is known of the arm before a design.

    Attributes:
        rows: One row a joint: a, d [m], cosine and sine of alpha, of shape (n, 4).
        designed: Joint and column (0 for a, 1 for d) of each designed length, of shape (n_lengths, 2).
        limits: Smallest and largest joint angles, of shape (2, n) [rad].
        order: 3 if task points are positions, 6 if they are poses.
        scale: Length that makes an angle comparable to a distance [m].
    """

    rows: Floats
    designed: Integers
    limits: Floats
    order: int
    scale: float


@kernel
def evaluate_spatial(
    model: SpatialModel, goals: Floats, genes: Floats, traits: Floats, terms: Floats
) -> None:
    """Compute traits and terms of k populations.

    Args:
        model: What is known of the arm.
        goals: Position, then the axes x, y and z of the tip, of shape (k, 12) [m].
        genes: Genes, of shape (k, n_genes, m) [rad, m].
        traits: Receives the traits, of shape (k, n_traits, m) [m, rad].
        terms: Receives DM, RC, HC and JLC, of shape (k, 8, m).
    """
    n, n_lengths = len(model.rows), len(model.designed)
    rows, theta = model.rows.copy(), np.empty(n)
    frames, jacobian, error = np.empty((n + 1, 4, 3)), np.empty((6, n)), np.empty(6)
    for i in range(len(genes)):
        terms[i] = 0.0
        for j in range(genes.shape[2]):
            for k in range(n_lengths):
                rows[model.designed[k, 0], model.designed[k, 1]] = genes[i, n + 3 + k, j]
                traits[i, k, j] = genes[i, n + 3 + k, j]
            for axis in range(3):
                traits[i, n_lengths + axis, j] = genes[i, n + axis, j]
            for k in range(n):
                theta[k] = genes[i, k, j]
                angle = wrap(theta[k])
                traits[i, n_lengths + 3 + k, j] = angle
                over = max(0.0, angle - model.limits[1, k]) + max(0.0, model.limits[0, k] - angle)
                terms[i, JLC, j] += over  # eq 8
            place_frames(rows, theta, genes[i, n : n + 3, j], frames)
            _differentiate(model.scale, frames, jacobian)
            miss = find_error(model, goals[i], frames, error)
            terms[i, RC, j] = miss  # eq 6
            terms[i, HC, j] = _compare_lengths(rows)  # eq 7, its sign corrected
            terms[i, DM, j] = _dexterity(model.order, rows, jacobian)  # eq 5


@kernel
def snap_spatial(
    model: SpatialModel, goals: Floats, lengths: Floats, bases: Floats, angles: Floats
) -> None:
    """Move poses onto their task points by damped Newton steps.

    Args:
        model: What is known of the arm.
        goals: Task points, of shape (t, 12).
        lengths: Designed lengths, of shape (n_lengths,) [m].
        bases: Base positions, of shape (t, 3) [m].
        angles: Joint angles, changed, of shape (t, n) [rad].
    """
    n = len(model.rows)
    rows, error = model.rows.copy(), np.empty(6)
    frames, jacobian = np.empty((n + 1, 4, 3)), np.empty((6, n))
    for k in range(len(lengths)):
        rows[model.designed[k, 0], model.designed[k, 1]] = lengths[k]
    for i in range(len(goals)):
        for _ in range(_SNAP_STEPS):
            place_frames(rows, angles[i], bases[i], frames)
            _differentiate(model.scale, frames, jacobian)
            find_error(model, goals[i], frames, error)
            _step_towards(jacobian[: model.order], error[: model.order], angles[i])


@kernel
def place_frames(rows: Floats, theta: Floats, base: Floats, frames: Floats) -> None:
    """Set the frames of all links: rows x, y, z axis and origin, of shape (n + 1, 4, 3)."""
    frames[0] = 0.0
    for axis in range(3):
        frames[0, axis, axis] = 1.0
        frames[0, 3, axis] = base[axis]
    for k in range(len(rows)):
        s, c = sincos(theta[k])
        a, d, ca, sa = rows[k]
        for r in range(3):
            x, y, z = frames[k, 0, r], frames[k, 1, r], frames[k, 2, r]
            along = c * x + s * y
            across = c * y - s * x
            frames[k + 1, 0, r] = along
            frames[k + 1, 1, r] = ca * across + sa * z
            frames[k + 1, 2, r] = ca * z - sa * across
            frames[k + 1, 3, r] = frames[k, 3, r] + d * z + a * along


@kernel
def find_error(model: SpatialModel, goal: Floats, frames: Floats, error: Floats) -> float:
    """Set what is missing to a task point, linear then angular times ``scale``; return its size."""
    n = len(model.rows)
    square = 0.0
    for r in range(3):
        error[r] = goal[r] - frames[n, 3, r]
        error[3 + r] = 0.0
        square += error[r] * error[r]
    distance = float(np.sqrt(square))
    if model.order == _POSITION:
        return distance
    sine, cosine = 0.0, -0.5
    for axis in range(3):  # half the sum of (have x want) over the axes is the turn's sine vector
        u, v, w = frames[n, axis]
        x, y, z = goal[3 + 3 * axis], goal[4 + 3 * axis], goal[5 + 3 * axis]
        error[3] += 0.5 * (v * z - w * y)
        error[4] += 0.5 * (w * x - u * z)
        error[5] += 0.5 * (u * y - v * x)
        cosine += 0.5 * (u * x + v * y + w * z)
    for r in range(3, 6):
        sine += error[r] * error[r]
    sine = float(np.sqrt(sine))
    angle = atan2(sine, cosine)
    for r in range(3, 6):
        error[r] *= model.scale * (angle / sine if sine > 1e-12 else 1.0)
    return distance + model.scale * angle


@kernel
def _differentiate(scale: float, frames: Floats, jacobian: Floats) -> None:
    """Set the Jacobian of the tip: linear rows, then angular ones times ``scale``, (6, n)."""
    n = len(frames) - 1
    for k in range(n):
        zx, zy, zz = frames[k, 2]
        x = frames[n, 3, 0] - frames[k, 3, 0]
        y = frames[n, 3, 1] - frames[k, 3, 1]
        z = frames[n, 3, 2] - frames[k, 3, 2]
        jacobian[0, k] = zy * z - zz * y
        jacobian[1, k] = zz * x - zx * z
        jacobian[2, k] = zx * y - zy * x
        jacobian[3, k], jacobian[4, k], jacobian[5, k] = scale * zx, scale * zy, scale * zz


@kernel
def _dexterity(order: int, rows: Floats, jacobian: Floats) -> float:
    """Return det(J J^T)^(1/m) over the squared total length, eqs 1, 2 and 5."""
    total = 0.0
    for k in range(len(rows)):
        total += np.sqrt(rows[k, 0] * rows[k, 0] + rows[k, 1] * rows[k, 1])
    gram = _gram(jacobian[:order])
    root = cube_root(_eliminate(gram, np.zeros(order)))
    if order != _POSITION:
        root = float(np.sqrt(root))
    return float(root / max(total * total, 1e-300))


@kernel
def _compare_lengths(rows: Floats) -> float:
    """Return by how much links that are no zero links are longer than the one before."""
    before, excess = np.inf, 0.0
    for k in range(len(rows)):
        length = np.sqrt(rows[k, 0] * rows[k, 0] + rows[k, 1] * rows[k, 1])
        if length > _NO_LINK:
            excess += max(0.0, length - before)
            before = length
    return excess


@kernel
def _step_towards(jacobian: Floats, error: Floats, angles: Floats) -> None:
    """Add J^T (J J^T + damping)^-1 error to the angles."""
    gram, solution = _gram(jacobian), error.copy()
    for r in range(len(gram)):
        gram[r, r] += _DAMPING
    _eliminate(gram, solution)
    for k in range(len(angles)):
        for r in range(len(solution)):
            angles[k] += jacobian[r, k] * solution[r]


@kernel
def _gram(jacobian: Floats) -> Floats:
    """Return J J^T."""
    m = len(jacobian)
    gram = np.zeros((m, m))
    for r in range(m):
        for q in range(m):
            for k in range(jacobian.shape[1]):
                gram[r, q] += jacobian[r, k] * jacobian[q, k]
    return gram


@kernel
def _eliminate(matrix: Floats, right: Floats) -> float:
    """Solve a positive definite system in place, by Gauss; return the determinant, at least zero."""
    m, determinant = len(matrix), 1.0
    for r in range(m):
        pivot = matrix[r, r]
        if pivot <= 0.0:
            return 0.0
        determinant *= pivot
        for below in range(r + 1, m):
            factor = matrix[below, r] / pivot
            right[below] -= factor * right[r]
            for q in range(r + 1, m):
                matrix[below, q] -= factor * matrix[r, q]
    for r in range(m - 1, -1, -1):
        for q in range(r + 1, m):
            right[r] -= matrix[r, q] * right[q]
        right[r] /= matrix[r, r]
    return determinant
