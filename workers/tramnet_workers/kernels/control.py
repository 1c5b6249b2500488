"""Resolved-rate motion of planar arms: onto a point, and along a path to a given pose.

Kim & Khosla (1992), section 6, step 4. With the pseudo-inverse J+ = J^T (J J^T)^-1,

    d theta = J+ dx + (I - J+ J) k                                                  (eq 12)

and k drives the arm along its null space to the pose at the end of the interval. The printed gain is
k = k1 j / n1 with k1 = theta_end - theta (eq 13), said to keep the null motion "almost constant"; it
lets the distance decay as prod(1 - j / n1) and peaks near j = sqrt(n1). The gain that does keep it
constant is 1 / (n1 - j + 1): the distance left, divided by the steps left.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.order import wrap
from tramnet_workers.kernels.transforms import sincos

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_SINGULAR = 1e-12  # least determinant of J J^T [m^4]; below it the motion is cut short
_SNAP_STEPS = 10
_NEAR = 0.02  # [m]
_SNAPPED = 1e-13  # [m]


@kernel
def snap_poses(
    lengths: Floats, prismatic: Integers, bases: Floats, points: Floats, joints: Floats
) -> None:
    """Move poses onto their points by Newton's method with the pseudo-inverse.

    Only those that are near already: from afar the method goes anywhere, and a pose that misses its
    point is to be seen.

    Args:
        lengths: Link lengths without strokes, of shape (n,) [m].
        prismatic: Links that a prismatic joint extends, of shape (n_strokes,).
        bases: Base positions, of shape (t, 2) [m].
        points: Task points, of shape (t, 2) [m].
        joints: Joint angles, then strokes, of shape (t, n + n_strokes) [rad, m]; only the angles
            are changed.
    """
    n = len(lengths)
    tip, jacobian = np.empty(2), np.empty((2, joints.shape[1]))
    for i in range(len(points)):
        for step in range(_SNAP_STEPS):
            _differentiate(lengths, prismatic, joints[i], tip, jacobian)
            x = points[i, 0] - bases[i, 0] - tip[0]
            y = points[i, 1] - bases[i, 1] - tip[1]
            error = abs(x) + abs(y)
            if error < _SNAPPED or (step == 0 and error > _NEAR):
                break
            u, v = _solve(jacobian[:, :n], x, y)
            for k in range(n):
                joints[i, k] += jacobian[0, k] * u + jacobian[1, k] * v


@kernel
def follow_path(
    lengths: Floats,
    prismatic: Integers,
    path: Floats,
    goal: Floats,
    exact_gain: bool,
    joints: Floats,
    null_motion: Floats,
) -> None:
    """Move along a path to a pose.

    Args:
        lengths: Link lengths without strokes, of shape (n,) [m].
        prismatic: Links that a prismatic joint extends, of shape (n_strokes,).
        path: Points of the path relative to the base, of shape (n1 + 1, 2) [m].
        goal: Joint values wanted at the end, of shape (n + n_strokes,) [rad, m].
        exact_gain: Whether k is k1 / (n1 - j + 1); else it is the printed k1 j / n1.
        joints: Joint values, of shape (n1 + 1, n + n_strokes) [rad, m]; row 0 is the start, the
            others are filled.
        null_motion: Receives the length of each step in the null space, of shape (n1,) [rad].
    """
    n, n1 = len(lengths), len(path) - 1
    size = joints.shape[1]
    tip, jacobian, k = np.empty(2), np.empty((2, size)), np.empty(size)
    for j in range(1, n1 + 1):
        theta = joints[j - 1]
        _differentiate(lengths, prismatic, theta, tip, jacobian)
        gain = 1.0 / (n1 - j + 1) if exact_gain else j / n1
        along_x, along_y = path[j, 0] - tip[0], path[j, 1] - tip[1]
        for r in range(size):
            left = wrap(goal[r] - theta[r]) if r < n else goal[r] - theta[r]
            k[r] = gain * left  # eq 13
            along_x -= jacobian[0, r] * k[r]
            along_y -= jacobian[1, r] * k[r]
        u, v = _solve(jacobian, along_x, along_y)
        w, z = _solve(jacobian, path[j, 0] - tip[0], path[j, 1] - tip[1])
        square = 0.0
        for r in range(size):
            step = k[r] + jacobian[0, r] * u + jacobian[1, r] * v  # eq 12, J+ taken out
            null = step - (jacobian[0, r] * w + jacobian[1, r] * z)
            square += null * null
            joints[j, r] = theta[r] + step
        null_motion[j - 1] = np.sqrt(square)


@kernel
def _solve(jacobian: Floats, x: float, y: float) -> tuple[float, float]:
    """Return (J J^T)^-1 (x, y)."""
    a, b, c = 0.0, 0.0, 0.0
    for r in range(jacobian.shape[1]):
        a += jacobian[0, r] * jacobian[0, r]
        b += jacobian[0, r] * jacobian[1, r]
        c += jacobian[1, r] * jacobian[1, r]
    determinant = max(a * c - b * b, _SINGULAR)
    return (c * x - b * y) / determinant, (a * y - b * x) / determinant


@kernel
def _differentiate(
    lengths: Floats, prismatic: Integers, joints: Floats, tip: Floats, jacobian: Floats
) -> None:
    """Set the tip relative to the base and the Jacobian of the tip."""
    n = len(lengths)
    directions = np.empty((n, 2))
    absolute, tip[0], tip[1] = 0.0, 0.0, 0.0
    jacobian[:] = 0.0
    for k in range(n):
        absolute += joints[k]
        s, c = sincos(absolute)
        directions[k, 0], directions[k, 1] = c, s
        reach = lengths[k]
        for stroke in range(len(prismatic)):
            if prismatic[stroke] == k:
                reach += joints[n + stroke]
        tip[0] += reach * c
        tip[1] += reach * s
        for earlier in range(k + 1):  # link k swings about every joint before it
            jacobian[0, earlier] -= reach * s
            jacobian[1, earlier] += reach * c
    for stroke in range(len(prismatic)):
        jacobian[0, n + stroke] = directions[prismatic[stroke], 0]
        jacobian[1, n + stroke] = directions[prismatic[stroke], 1]
