"""Smooth paths that keep position limits everywhere, not on a grid only."""

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.plan import SmoothPath

Array = NDArray[np.float64]

_ROUNDS = 20  # each squares what is left; some five are needed
_NEGLIGIBLE = 1e-14  # a coefficient that is smaller than this part of the largest one


def path_within_limits(task: MotionTask, amplitudes: Array) -> SmoothPath:
    """Return a path with its joints drawn back to the line as far as the position limits ask for.

    A joint's angle is a polynomial, and what must be within the limits are its extrema. Drawing the
    joint back moves these a little; so look for them again, until they are inside.

    Args:
        task: The task.
        amplitudes: Amplitudes of the modes, of shape (n_joints, n_modes) [rad].
    """
    path = SmoothPath(task.start, task.goal, amplitudes)
    for _ in range(_ROUNDS):
        reach = np.array([_reach(task, path, j) for j in range(task.n_joints)])
        if (reach == 1.0).all():
            break
        path = SmoothPath(task.start, task.goal, path.amplitudes * reach[:, None])
    return path


def _reach(task: MotionTask, path: SmoothPath, joint: int) -> float:
    """Return the share of a joint's deviation from the line that its limits leave, at most 1."""
    s = _extrema(path, joint)
    q = path.points(s)[0][:, joint]
    line = task.start[joint] + s * (task.goal[joint] - task.start[joint])
    limit = np.clip(q, task.position_lower[joint], task.position_upper[joint])
    beyond = q != limit
    return float(np.min((limit - line)[beyond] / (q - line)[beyond], initial=1.0))


def _extrema(path: SmoothPath, joint: int) -> Array:
    """Return where a joint may have its extrema between both ends of a path, of shape (k,)."""
    order = np.arange(1, path.amplitudes.shape[1] + 1)
    slope = np.empty(len(order) + 1)  # dq/ds as a Legendre series in 2 s - 1
    slope[0] = path.goal[joint] - path.start[joint]
    slope[1:] = path.amplitudes[joint] * np.sqrt(2.0 * order + 1.0)
    significant = legendre.legtrim(slope, _NEGLIGIBLE * np.abs(slope).max())
    # A double root may come out as a pair that is a little complex.
    s = 0.5 * (legendre.legroots(significant).real + 1.0)
    return np.ascontiguousarray(s[(s > 0.0) & (s < 1.0)])
