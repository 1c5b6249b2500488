"""Smooth paths between two joint positions, and what it costs to drive along them.

A path is the straight joint line plus a few modes, polynomials that vanish at both ends:

    q_j(s) = start_j + s (goal_j - start_j) + reach_j sum_k amplitude_jk phi_k(s),   0 <= s <= 1,
    phi_k(s) = sqrt(2k + 1) integral_0^s P_k(2r - 1) dr,   k = 1, 2, ...,

with the Legendre polynomials P_k, so that the slopes of the modes are orthonormal. (Sines need more
modes for the same result: they force the curvature to 0 at both ends, where the best paths have
none of that.) reach_j <= 1 draws a joint's deviation back to where it keeps the position limits: the
line itself is within them, and so is everything between it and a path that touches them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.kernels.topp import time_optimal

Floats = NDArray[np.float64]

INFEASIBLE = 1e6


@kernel
def path_modes(s: Floats, n_modes: int) -> Floats:
    """Return the modes and their first and second derivatives, of shape (3, n_modes, k).

    Args:
        s: Places on the path, of shape (k,).
        n_modes: Number of modes.
    """
    modes = np.empty((3, n_modes, len(s)))
    for p in range(len(s)):
        z = 2.0 * s[p] - 1.0
        before, slope_before = 1.0, 0.0  # P_(k-1) and its derivative
        here, slope = z, 1.0
        for k in range(1, n_modes + 1):
            after = ((2 * k + 1) * z * here - k * before) / (k + 1)
            norm = np.sqrt(2.0 * k + 1.0)
            modes[0, k - 1, p] = 0.5 * (after - before) / norm
            modes[1, k - 1, p] = norm * here
            modes[2, k - 1, p] = 2.0 * norm * slope
            slope_before, slope = slope, slope_before + (2 * k + 1) * here
            before, here = here, after
    return modes


@kernel
def path_points(
    start: Floats, goal: Floats, amplitudes: Floats, s: Floats, modes: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return positions, tangents and curvatures of a path.

    Args:
        start: Joint angles at s = 0, of shape (n_joints,) [rad].
        goal: Joint angles at s = 1, of shape (n_joints,) [rad].
        amplitudes: Amplitudes of the modes, of shape (n_joints, n_modes) [rad].
        s: Places on the path, of shape (k,).
        modes: The modes and their first and second derivatives there, of shape (3, n_modes, k).

    Returns:
        q, dq/ds and d²q/ds², each of shape (k, n_joints) [rad].
    """
    k, n = len(s), len(start)
    q, dq, ddq = np.empty((k, n)), np.empty((k, n)), np.zeros((k, n))
    for j in range(n):
        way = goal[j] - start[j]
        for p in range(k):
            q[p, j] = start[j] + s[p] * way
            dq[p, j] = way
        for mode in range(amplitudes.shape[1]):
            amplitude = amplitudes[j, mode]
            for p in range(k):
                q[p, j] += amplitude * modes[0, mode, p]
                dq[p, j] += amplitude * modes[1, mode, p]
                ddq[p, j] += amplitude * modes[2, mode, p]
    return q, dq, ddq


@kernel
def within_limits(
    start: Floats,
    goal: Floats,
    amplitudes: Floats,
    lower: Floats,
    upper: Floats,
    s: Floats,
    shapes: Floats,
) -> Floats:
    """Return amplitudes whose path keeps the position limits, drawn back where it would not.

    Args:
        start: Joint angles at s = 0, within the limits, of shape (n_joints,) [rad].
        goal: Joint angles at s = 1, within the limits, of shape (n_joints,) [rad].
        amplitudes: Amplitudes of the modes, of shape (n_joints, n_modes) [rad].
        lower: Smallest joint angles, of shape (n_joints,) [rad].
        upper: Largest joint angles, of shape (n_joints,) [rad].
        s: Places where the limits are kept, of shape (k,).
        shapes: The modes there, of shape (n_modes, k).
    """
    kept = amplitudes.copy()
    for j in range(len(start)):
        reach = 1.0
        for p in range(len(s)):
            line = start[j] + s[p] * (goal[j] - start[j])
            deviation = 0.0
            for mode in range(amplitudes.shape[1]):
                deviation += amplitudes[j, mode] * shapes[mode, p]
            if line + deviation > upper[j]:
                reach = min(reach, max(upper[j] - line, 0.0) / deviation)
            elif line + deviation < lower[j]:
                reach = min(reach, min(lower[j] - line, 0.0) / deviation)
        kept[j] *= reach
    return kept


@kernel
def path_torques(
    arm: Floats, gravity: Floats, q: Floats, dq: Floats, ddq: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the coefficients of tau = a u + b x + c along a path (see ``kernels.topp``).

    Args:
        arm: Table of the arm (see ``kernels.dynamics``).
        gravity: Acceleration of gravity in the base frame, of shape (3,) [m/s²].
        q: Positions on the path, of shape (k, n_joints) [rad].
        dq: Tangents dq/ds there, of the same shape [rad].
        ddq: Curvatures d²q/ds² there, of the same shape [rad].

    Returns:
        a and b [N m s²] and c [N m], each of shape (k, n_joints).
    """
    still, weightless = np.zeros_like(q), np.zeros_like(gravity)
    a = inverse_dynamics_batch(arm, weightless, q, still, dq)
    b = inverse_dynamics_batch(arm, weightless, q, dq, ddq)
    c = inverse_dynamics_batch(arm, gravity, q, still, still)
    return a, b, c


@kernel
def speed_ceiling(dq: Floats, velocity_limits: Floats, cap: float) -> Floats:
    """Return the largest squared path speeds that keep the joints' velocity limits and a cap.

    Args:
        dq: Tangents dq/ds, of shape (k, n_joints) [rad].
        velocity_limits: Largest joint speeds, of shape (n_joints,) [rad/s]; may be inf.
        cap: Largest path speed whatever the joints could do [1/s]; may be inf.
    """
    k, n = dq.shape
    ceiling = np.full(k, cap * cap)
    for p in range(k):
        for j in range(n):
            if dq[p, j] != 0.0:
                speed = velocity_limits[j] / dq[p, j]
                ceiling[p] = min(ceiling[p], speed * speed)
    return ceiling


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
