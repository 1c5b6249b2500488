"""Plans along given paths: as fast as the limits allow, and honest between the points of the grid."""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.kernels.smooth_paths import path_torques, speed_ceiling
from tramnet_workers.kernels.topp import time_optimal
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.plan import PathPlan, Plan, SmoothPath

Array = NDArray[np.float64]

FINE = 1000  # intervals of a plan that is to be carried out
_INSTANTS = 4001  # where a plan is looked at between the points of its grid
_EXCESS = 1e-9  # relative excess of a limit that is left alone
_ROUNDS = 5


def grid(intervals: int) -> Array:
    """Return ends and middles of the intervals of a grid on [0, 1], of shape (2 intervals + 1,).

    The grid is dense where the arm is slow, at both ends: a motion from rest needs as long for the
    first hundredth of a path as for a fifth in the middle.
    """
    even = np.arange(intervals + 1) / intervals
    points = np.empty(2 * intervals + 1)
    points[::2] = even * even * (3.0 - 2.0 * even)
    points[1::2] = 0.5 * (points[:-2:2] + points[2::2])
    return points


def time_path(
    task: MotionTask, path: SmoothPath, cap: float = np.inf, intervals: int = FINE
) -> PathPlan | None:
    """Return the fastest motion along a path within a task's torque and velocity limits.

    Between the points of the grid the bounds may be exceeded by a hair. Then the motion is timed
    again with bounds that are narrower by as much.

    Args:
        task: The task; it ends at rest unless its end velocity costs nothing.
        path: The path.
        cap: Largest path speed [1/s].
        intervals: Intervals of the grid.

    Returns:
        The plan, or None if no motion follows the path.
    """
    torque_limits, velocity_limits = task.torque_limits, task.velocity_limits
    for _ in range(_ROUNDS):
        plan = _time(task, path, cap, grid(intervals), torque_limits, velocity_limits)
        if plan is None:
            return None
        torque, velocity = limit_ratios(task, plan)
        if max(torque.max(), velocity.max()) <= 1.0 + _EXCESS:
            return plan
        torque_limits = torque_limits / np.maximum(torque, 1.0)
        velocity_limits = velocity_limits / np.maximum(velocity, 1.0)
    return plan


def limit_ratios(task: MotionTask, plan: Plan) -> tuple[Array, Array]:
    """Return the largest ratios of torque and of velocity to their limits, of shape (n_joints,)."""
    q, qd, qdd = plan.sample(np.linspace(0.0, plan.duration, _INSTANTS))
    torques = inverse_dynamics_batch(task.arm.table, task.arm.gravity, q, qd, qdd)
    torque = np.abs(torques).max(axis=0) / task.torque_limits
    velocity = np.abs(qd).max(axis=0) / task.velocity_limits
    return torque, velocity


def stops(task: MotionTask) -> bool:
    """Return whether a motion must end at rest: it must, unless its end velocity costs nothing."""
    return task.weights.end_velocity > 0.0


def _time(
    task: MotionTask,
    path: SmoothPath,
    cap: float,
    points: Array,
    torque_limits: Array,
    velocity_limits: Array,
) -> PathPlan | None:
    q, dq, ddq = path.points(points)
    a, b, c = path_torques(task.arm.table, task.arm.gravity, q, dq, ddq)
    ceiling = speed_ceiling(dq, velocity_limits, cap)
    s = points[::2]
    duration, x, u = time_optimal(np.diff(s), a, b, c, torque_limits, ceiling, stops(task))
    return PathPlan(path, s, x, u) if duration < np.inf else None
