"""Arms with their poses at all task points in one chromosome: the traditional approach.

Kim & Khosla (1992), section 4, count (n - 2) t + n + 2 variables for it, eq (3): link lengths, base and
for a three-link arm one angle for each point, the other two following by inverse kinematics with the
elbow on one side. Rows of genes: three lengths, base, first angles at the t points. Rows of traits:
the same lengths and base, then the three angles at each point.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.design import DM, HC, JAC, JLC, RC
from tramnet_workers.kernels.order import wrap
from tramnet_workers.kernels.transforms import atan2, sincos

Floats = NDArray[np.float64]

_N = 3


@kernel
def evaluate_single(
    points: Floats,
    lower: Floats,
    upper: Floats,
    closed: bool,
    genes: Floats,
    traits: Floats,
    terms: Floats,
) -> None:
    """Compute traits and terms, means over the task points, of one population.

    Args:
        points: Task points, of shape (t, 2) [m].
        lower: Smallest joint angles, of shape (3,) [rad].
        upper: Largest joint angles, of shape (3,) [rad].
        closed: Whether the last point's neighbour is the first.
        genes: Genes, of shape (5 + t, m) [m, rad].
        traits: Receives the traits, of shape (5 + 3 t, m) [m, rad].
        terms: Receives DM, RC, HC, JLC and JAC, of shape (8, m).
    """
    terms[:] = 0.0
    traits[:5] = genes[:5]
    share = 1.0 / len(points)
    for i in range(len(points)):
        pose = traits[5 + _N * i : 5 + _N * (i + 1)]
        _bend(points[i], genes, genes[5 + i], share, pose, terms)
        for k in range(_N):
            for j in range(genes.shape[1]):
                over = max(0.0, pose[k, j] - upper[k]) + max(0.0, lower[k] - pose[k, j])
                terms[JLC, j] += share * over  # eq 8
    for k in range(_N - 1):
        for j in range(genes.shape[1]):
            terms[HC, j] += max(0.0, genes[k + 1, j] - genes[k, j])  # eq 7, its sign corrected
    for i in range(len(points) if closed else len(points) - 1):
        here, there = 5 + _N * i, 5 + _N * ((i + 1) % len(points))
        for k in range(_N):
            for j in range(genes.shape[1]):
                change = abs(wrap(traits[there + k, j] - traits[here + k, j]))
                terms[JAC, j] += share * change  # what eq 11 is for


@kernel
def _bend(
    point: Floats, genes: Floats, first: Floats, share: float, pose: Floats, terms: Floats
) -> None:
    """Bend the arm onto a point; add its dexterity, or by how much it misses the point."""
    for j in range(len(first)):
        a, b, c = genes[0, j], genes[1, j], genes[2, j]
        px, py = point[0] - genes[3, j], point[1] - genes[4, j]
        s, co = sincos(first[j])
        x, y = px - a * co, py - a * s
        distance = max(np.sqrt(x * x + y * y), 1e-9)
        reached = min(max(distance, abs(b - c)), b + c)
        terms[RC, j] += share * abs(distance - reached)  # eq 6, the tip as near as it gets
        along = (b * b - c * c + reached * reached) / (2.0 * max(reached, 1e-9))
        aside = np.sqrt(max(0.0, b * b - along * along))
        x, y = x / distance, y / distance
        u, v = along * x + aside * y, along * y - aside * x
        p, q = reached * x - u, reached * y - v
        pose[0, j] = wrap(first[j])
        pose[1, j] = atan2(co * v - s * u, co * u + s * v)
        pose[2, j] = atan2(u * q - v * p, u * p + v * q)
        rx, ry = u + p, v + q
        tx, ty = a * co + rx, a * s + ry
        m1, m2, m3 = tx * ry - ty * rx, tx * q - ty * p, rx * q - ry * p
        total = max(a + b + c, 1e-9)
        terms[DM, j] += share * np.sqrt(m1 * m1 + m2 * m2 + m3 * m3) / (total * total)  # eq 5
