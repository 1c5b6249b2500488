"""Smooth paths between two joint positions, and the torques that it takes to drive along them.

A path is the straight joint line plus a few modes, polynomials that vanish at both ends:

    q_j(s) = start_j + s (goal_j - start_j) + reach_j sum_k amplitude_jk phi_k(s),   0 <= s <= 1,
    phi_k(s) = sqrt(2k + 1) integral_0^s P_k(2r - 1) dr,   k = 1, 2, ...,

with the Legendre polynomials P_k, so that the slopes of the modes are orthonormal. (Sines need more
modes for the same result: they force the curvature to 0 at both ends, where the best paths have
none of that.) reach_j <= 1 draws a joint's deviation back to where it keeps the position limits: the
line itself is within them, and so is everything between it and a path that touches them.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.dynamics import inverse_dynamics_batch

Floats = NDArray[np.float64]


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
