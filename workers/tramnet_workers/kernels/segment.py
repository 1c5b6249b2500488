"""Joint torques in one segment of a grid trajectory, as quadratics in x = 1 / h.

See ``kernels.scaling`` for the derivation. Wang & Zalzala (1995) do not say at which posture of the
segment the torques are bounded. ``START``, its first node, comes nearest to their figure; ``MIDDLE``
is halfway between the nodes; ``EXACT`` bounds them at the true states at both ends, and halfway, so
that the plan keeps what it promises (a plan bounded at one posture overshoots by 1 to 4 %).
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.book import (
    ANGLE,
    NODE,
    RATE,
    STEP,
    A,
    B,
    Book,
    C,
    n_segments,
)
from tramnet_workers.kernels.dynamics import LANES, dynamics_workspace, inverse_dynamics
from tramnet_workers.kernels.inertia import momentum, resting_torques

Array = NDArray[np.float64]

START = 0
MIDDLE = 1
EXACT = 2


@device
def n_postures(posture: int) -> int:
    """Return the number of postures at which torques are bounded."""
    return 3 if posture == EXACT else 1


@device
def rest_segments(
    arm: Array, gravity: Array, posture: int, book: Book, chain: Array, links: Array
) -> None:
    """Compute what does not depend on the velocities at the start of the segments.

    Args:
        arm: Table of the arm, of shape (n_joints, ARM_COLUMNS).
        gravity: Acceleration of gravity in the base frame, of shape (3,) [m/s²].
        posture: START, MIDDLE or EXACT.
        book: Holds NODE and STEP; receives angles, sines, cosines, A and C of all postures.
        chain: Scratch; see ``kernels.inertia``.
        links: Scratch; see ``kernels.inertia``.
    """
    n_joints = arm.shape[0]
    for k in range(n_postures(posture)):
        # The k-th of the exact postures is k / 2 of the way along D, where the joints move with
        # v, D x and 2 D x - v: D contributes k times itself to the velocity.
        way = 0.5 * k if posture == EXACT else 0.5 * posture
        share = 1.0 * k if posture == EXACT else 1.0
        for j in range(n_segments(book)):
            _place(n_joints, j, k * n_joints, way, book)
            resting_torques(arm, gravity, j, k * n_joints, share, book, chain, links)


@device
def _place(n_joints: int, j: int, first: int, way: float, book: Book) -> None:
    for row in range(first, first + n_joints):
        for lane in range(LANES):
            along = way * book[j, row, STEP + lane]
            book[j, row, ANGLE + lane] = book[j, row, NODE + lane] + along


@device
def move_segment(
    arm: Array, gravity: Array, posture: int, j: int, book: Book, chain: Array, links: Array
) -> None:
    """Complete the torques of a segment, for the velocities at its start.

    Args:
        arm: Table of the arm, of shape (n_joints, ARM_COLUMNS).
        gravity: Acceleration of gravity in the base frame, of shape (3,) [m/s²].
        posture: START, MIDDLE or EXACT.
        j: Index of the segment.
        book: Holds what ``rest_segments`` found, and RATE; receives B and, if EXACT, C.
        chain: Scratch; see ``kernels.inertia``.
        links: Scratch; see ``kernels.inertia``.
    """
    momentum(arm, j, 0, book, chain, links)
    if posture == EXACT:
        momentum(arm, j, arm.shape[0], book, chain, links)
        _move_ends(arm, gravity, j, book)


@kernel
def _move_ends(arm: Array, gravity: Array, j: int, book: Book) -> None:
    """Write C(v, v) + g at either end, and B at the last, where the joints move with 2 D x - v."""
    n = arm.shape[0]
    work = dynamics_workspace(n)
    blocks = np.zeros((5, n, LANES))
    q, qd, qdd, tau, zero = blocks[0], blocks[1], blocks[2], blocks[3], blocks[4]
    for first in (0, 2 * n):
        _copy_state(j, first, book, q, qd)
        inverse_dynamics(arm, gravity, q, qd, zero, tau, work)
        for i in range(n):
            for lane in range(LANES):
                book[j, first + i, C + lane] = tau[i, lane]
    for i in range(n):
        for lane in range(LANES):
            step, rate = book[j, i, STEP + lane], book[j, i, RATE + lane]
            qd[i, lane], qdd[i, lane] = 2.0 * step - rate, 2.0 * (step - rate)
    inverse_dynamics(arm, gravity, q, qd, qdd, tau, work)  # at x = 1, where it is A + 2 B + C
    for i in range(n):
        row = 2 * n + i
        for lane in range(LANES):
            known = book[j, row, A + lane] + book[j, row, C + lane]
            book[j, row, B + lane] = 0.5 * (tau[i, lane] - known)


@device
def _copy_state(j: int, first: int, book: Book, q: Array, qd: Array) -> None:
    for i in range(q.shape[0]):
        for lane in range(LANES):
            q[i, lane] = book[j, first + i, ANGLE + lane]
            qd[i, lane] = book[j, i, RATE + lane]
