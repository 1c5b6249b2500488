"""Dynamic scaling: the shortest interval in which an arm can cover one segment of a trajectory.

Hollerbach (1984), as Wang & Zalzala (1995), section 4.2, use it. With constant acceleration during
the segment, the displacement D, the interval h and the velocity v at its start give (eqs 3, 4 and
step 7)

    mean velocity D / h,   acceleration (2 / h) (D / h - v),   end velocity 2 D / h - v.

Put into the dynamics at one fixed posture, every joint torque is a quadratic in x = 1 / h:

    tau_i(x) = K_i x^2 - 2 (H v)_i x + g_i,   K = 2 H D + C(D, D).

The paper's eqs 5 and 6 are differences of two values of it; their starting interval cancels out
(and with it the question which primes the print of eq 5 has lost). Each torque bound allows the x
between two roots, or forbids those between two roots; what all joints allow is a few ranges, and
the shortest time is the top of the highest one.

"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device
from tramnet_workers.kernels.book import (
    GAP_END,
    GAP_START,
    LOW,
    TOP,
    TORQUE,
    A,
    B,
    Book,
    C,
    last_row,
)
from tramnet_workers.kernels.dynamics import LANES

Array = NDArray[np.float64]

_TINY = 1e-300
_SLACK = 1e-9  # a torque that touches its bound, and exceeds it by rounding only, leaves no gap


@device
def bound_torques(limits: Array, j: int, book: Book) -> None:
    """Narrow a range to the highest part of it in which all torques keep within their bounds.

    Args:
        limits: What the joints may do, of shape (LIMIT_ROWS, n_joints).
        j: Index of the segment.
        book: Holds A, B and C of the torques, row i those of joint i modulo the number of joints,
            and the range; afterwards TOP is below LOW where no x will do.
    """
    for row in range(last_row(book)):
        _bound_torque(limits[TORQUE, row % limits.shape[1]], j, row, book)
    # A pass which moves nothing is harmless: what a lane becomes does not depend on its neighbours.
    while _descend_gaps(j, book):
        pass
    _raise_low(j, book)


@device
def _bound_torque(bound: float, j: int, row: int, book: Book) -> None:
    """Apply the bound that ends the range from above, and note the gap the other one leaves."""
    last = last_row(book)
    for lane in range(LANES):
        # Mirrored, if need be, so that the parabola p opens upwards: p <= bound holds between two
        # roots, and p >= -bound outside two roots, if there are any.
        slope = book[j, row, B + lane]
        a = book[j, row, A + lane]
        mirrored = (a < 0.0) | ((a == 0.0) & (slope < 0.0))
        a = abs(a)
        b = -slope if mirrored else slope
        c = -book[j, row, C + lane] if mirrored else book[j, row, C + lane]
        over, under = c - bound, c + bound
        outer, inner = b * b - a * over, b * b - a * under
        # The stable form of the roots: m / a and constant / m, with no difference of near equals.
        m_outer = max(abs(b) + np.sqrt(max(outer, 0.0)), _TINY)
        m_inner = max(abs(b) + np.sqrt(max(inner, 0.0)), _TINY)
        falls = b <= 0.0
        dips = (inner > _SLACK * a * bound) | (under < 0.0)
        near, far = over / m_outer, m_outer / a
        start, end = under / m_inner, m_inner / a
        book[j, last, LOW + lane] = max(book[j, last, LOW + lane], near if falls else -far)
        highest = far if falls else -near
        book[j, last, TOP + lane] = min(
            book[j, last, TOP + lane], highest if outer >= 0.0 else -1.0
        )
        book[j, row, GAP_START + lane] = start if falls else -end
        book[j, row, GAP_END + lane] = (end if falls else -start) if dips else 0.0


@device
def _descend_gaps(j: int, book: Book) -> bool:
    """Take tops out of the gaps they lie in, downwards; return whether any was moved."""
    moved = 0
    last = last_row(book)
    for row in range(last):
        for lane in range(LANES):
            top, start = book[j, last, TOP + lane], book[j, row, GAP_START + lane]
            inside = (start < top) & (top < book[j, row, GAP_END + lane])
            book[j, last, TOP + lane] = start if inside else top
            moved += 1 if inside else 0
    return moved > 0


@device
def _raise_low(j: int, book: Book) -> None:
    """Begin the range above the gaps that lie below its top."""
    last = last_row(book)
    for row in range(last):
        for lane in range(LANES):
            low, end = book[j, last, LOW + lane], book[j, row, GAP_END + lane]
            below = (low < end) & (end <= book[j, last, TOP + lane])
            book[j, last, LOW + lane] = end if below else low
