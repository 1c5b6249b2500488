"""What it costs to drive along smooth paths, each timed as well as it can be."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.smooth_paths import (
    path_points,
    path_torques,
    speed_ceiling,
    within_limits,
)
from tramnet_workers.kernels.topp import time_optimal

Floats = NDArray[np.float64]

INFEASIBLE = 1e6  # objectives from here on belong to paths that no motion can follow


class PathTask(NamedTuple):
    """What ``path_objectives`` takes for granted: the task, and the grid on which it looks at paths.

    Attributes:
        arm: Table of the arm (see ``kernels.dynamics``).
        gravity: Acceleration of gravity in the base frame, of shape (3,) [m/s²].
        start: Joint angles at the start, of shape (n_joints,) [rad].
        goal: Joint angles at the end, of shape (n_joints,) [rad].
        lower: Smallest joint angles, of shape (n_joints,) [rad].
        upper: Largest joint angles, of shape (n_joints,) [rad].
        torque_limits: Largest torques, of shape (n_joints,) [N m].
        velocity_limits: Largest joint speeds, of shape (n_joints,) [rad/s].
        time_weight: Weight of the motion time [1/s].
        torque_weight: Weight of the torque impulse [1/s].
        stops: Whether the motion ends at rest.
        s: Ends and middles of the m intervals of the grid, of shape (2m + 1,).
        modes: The modes there, of shape (3, n_modes, 2m + 1).
    """

    arm: Floats
    gravity: Floats
    start: Floats
    goal: Floats
    lower: Floats
    upper: Floats
    torque_limits: Floats
    velocity_limits: Floats
    time_weight: float
    torque_weight: float
    stops: bool
    s: Floats
    modes: Floats


@kernel
def path_objectives(task: PathTask, amplitudes: Floats, caps: Floats, stretches: Floats) -> Floats:
    """Return the objectives of the best timed motions along paths.

    Each depends on its own path alone. A path that no motion can follow costs ``INFEASIBLE`` times
    its largest ratio of gravity torque to bound, so that less of that is still better.

    Args:
        task: The task.
        amplitudes: Amplitudes of the paths' modes, of shape (k, n_joints, n_modes) [rad].
        caps: Largest path speeds, of shape (k,) [1/s]; may be inf.
        stretches: Factors, at least 1, by which the motions are slowed down, of shape (k,).

    Returns:
        Objectives, of shape (k,).
    """
    objectives = np.empty(len(amplitudes))
    for i in range(len(amplitudes)):
        objectives[i] = _objective(task, amplitudes[i], caps[i], stretches[i])
    return objectives


@kernel
def _objective(task: PathTask, amplitudes: Floats, cap: float, stretch: float) -> float:
    kept = within_limits(
        task.start, task.goal, amplitudes, task.lower, task.upper, task.s, task.modes[0]
    )
    q, dq, ddq = path_points(task.start, task.goal, kept, task.s, task.modes)
    a, b, c = path_torques(task.arm, task.gravity, q, dq, ddq)
    steps = task.s[2::2] - task.s[:-2:2]
    ceiling = speed_ceiling(dq, task.velocity_limits, cap)
    duration, x, u = time_optimal(steps, a, b, c, task.torque_limits, ceiling, task.stops)
    if not duration < np.inf:
        return INFEASIBLE * _weakness(c, task.torque_limits)
    objective = task.time_weight * duration * stretch
    if task.torque_weight > 0.0:
        impulse = _impulse(steps, a, b, c, task.torque_limits, x, u, stretch)
        objective += task.torque_weight * impulse
    return objective


@kernel
def _weakness(c: Floats, limits: Floats) -> float:
    """Return the largest ratio of gravity torque to bound on a path, at least 1."""
    worst = 1.0
    for p in range(c.shape[0]):
        for j in range(len(limits)):
            worst = max(worst, abs(c[p, j]) / limits[j])
    return worst


@kernel
def _impulse(
    steps: Floats,
    a: Floats,
    b: Floats,
    c: Floats,
    limits: Floats,
    x: Floats,
    u: Floats,
    stretch: float,
) -> float:
    """Return the torque impulse of a motion [s]: the integral of mean_j |tau_j| / bound_j."""
    n = len(limits)
    slower = 1.0 / (stretch * stretch)
    impulse = 0.0
    for i in range(len(steps)):
        effort = 0.0
        for k in range(3):  # Simpson's rule
            p = 2 * i + k
            weight = 4.0 if k == 1 else 1.0
            speed = x[i] + k * steps[i] * u[i]
            for j in range(n):
                torque = (a[p, j] * u[i] + b[p, j] * speed) * slower + c[p, j]
                effort += weight * abs(torque) / limits[j]
        impulse += effort / (6.0 * n) * 2.0 * steps[i] / (np.sqrt(x[i]) + np.sqrt(x[i + 1]))
    return impulse * stretch
