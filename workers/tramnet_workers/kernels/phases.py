"""The phase rule: which interval a segment gets, of those that its torques and limits allow.

"Choose the shortest" (Wang & Zalzala 1995, section 4.2, step 5), applied throughout, never brakes.
Since the starting interval h of the scaling cancels out, the paper's two values of it, 0.01 for the
first part of the motion and 0.5 for the second, can only mean which bound is aimed at:

* accelerate: the largest x = 1 / h, the shortest interval;
* brake: the x that leaves the least speed, sum_i |2 D_i x - v_i|, and the largest such x.

A *share* of 1 accelerates, 0 brakes, and one between blends the two x: all of them lie in one range
of allowed x, and so does every blend.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device
from tramnet_workers.kernels.book import (
    BRAKING,
    CHOSEN,
    GAP_END,
    GAP_START,
    LOST,
    LOW,
    LOWER,
    NODE,
    OUTSIDE,
    RATE,
    SHARE,
    SLOPE,
    STEP,
    TOP,
    UPPER,
    VELOCITY,
    Book,
    last_row,
)
from tramnet_workers.kernels.dynamics import LANES
from tramnet_workers.kernels.scaling import bound_torques

Array = NDArray[np.float64]

#: Largest x: a segment in which nothing moves takes a microsecond [1/s].
FASTEST = 1e6

# The brake rule comes after the gaps were left behind.
_KINK = GAP_START  # the x at which the joint would stop [1/s]
_WEIGHT = GAP_END  # half the slope of its speed on either side [rad]

_TINY = 1e-300
_SLACK = 1e-10  # a joint that stops at its limit has not passed it [rad]


@device
def choose_interval(limits: Array, slowest: float, j: int, book: Book) -> None:
    """Choose x of one segment.

    Args:
        limits: What the joints may do, of shape (LIMIT_ROWS, n_joints).
        slowest: Least x that braking may choose, if anything faster is allowed [1/s].
        j: Index of the segment.
        book: Holds NODE, STEP, RATE, the torques and SHARE; receives CHOSEN, and LOST = 1 in
            lanes where no interval is allowed.
    """
    _cap_velocities(limits, j, book)
    bound_torques(limits, j, book)
    _settle(slowest, j, book)
    if _any_brakes(j, book):
        _brake(limits.shape[1], j, book)
    _blend(j, book)
    if _look_outside(limits, j, book):
        _come_inside(j, book)
        _blend(j, book)


@device
def _cap_velocities(limits: Array, j: int, book: Book) -> None:
    """Open the range up to where an end velocity 2 D x - v reaches its bound."""
    last = last_row(book)
    for lane in range(LANES):
        book[j, last, LOW + lane] = 0.0
        book[j, last, TOP + lane] = FASTEST
    for i in range(limits.shape[1]):
        bound = limits[VELOCITY, i]
        if bound < np.inf:
            for lane in range(LANES):
                along = (
                    book[j, i, RATE + lane]
                    if book[j, i, STEP + lane] >= 0.0
                    else -book[j, i, RATE + lane]
                )
                cap = max(bound + along, 0.0) / max(2.0 * abs(book[j, i, STEP + lane]), _TINY)
                book[j, last, TOP + lane] = min(book[j, last, TOP + lane], cap)


@device
def _settle(slowest: float, j: int, book: Book) -> None:
    """Note the lanes without any x, and keep braking from lasting for ever."""
    last = last_row(book)
    for lane in range(LANES):
        low, top = book[j, last, LOW + lane], book[j, last, TOP + lane]
        lost = (top < low) | (top <= 0.0)
        book[j, last, LOST + lane] = 1.0 if lost else 0.0
        book[j, last, TOP + lane] = 1.0 if lost else top
        book[j, last, LOW + lane] = 1.0 if lost else max(low, min(slowest, top))


@device
def _any_brakes(j: int, book: Book) -> bool:
    last = last_row(book)
    braking = 0
    for lane in range(LANES):
        braking += 1 if book[j, last, SHARE + lane] < 1.0 else 0
    return braking > 0


@device
def _brake(n_joints: int, j: int, book: Book) -> None:
    """Find the largest x of least speed, whether it is allowed or not.

    The speed is convex and piecewise linear in x, with kinks at v_i / (2 D_i), so it is least at
    the last kink before which it does not rise. Where nothing moves, any x will do.
    """
    n, last = n_joints, last_row(book)
    for lane in range(LANES):
        book[j, last, BRAKING + lane] = -np.inf
    for i in range(n):
        _place_kink(j, i, book)
    for i in range(n):
        for k in range(i + 1, n):
            _compare_kinks(j, i, k, book)
    for i in range(n):
        for lane in range(LANES):
            kink = book[j, i, _KINK + lane]
            later = (book[j, i, SLOPE + lane] <= 0.0) & (kink > book[j, last, BRAKING + lane])
            book[j, last, BRAKING + lane] = kink if later else book[j, last, BRAKING + lane]
    for lane in range(LANES):
        kink = book[j, last, BRAKING + lane]
        book[j, last, BRAKING + lane] = kink if kink > -np.inf else np.inf


@device
def _place_kink(j: int, i: int, book: Book) -> None:
    """Begin with the slope of the joint's own speed, which falls just below its kink."""
    for lane in range(LANES):
        step = book[j, i, STEP + lane]
        kink = book[j, i, RATE + lane] / (2.0 * (step if step != 0.0 else 1.0))
        book[j, i, _KINK + lane] = kink if step != 0.0 else -np.inf
        book[j, i, _WEIGHT + lane] = abs(step)
        book[j, i, SLOPE + lane] = -abs(step)


@device
def _compare_kinks(j: int, i: int, k: int, book: Book) -> None:
    """Add to the slope just below either kink what the other joint's speed contributes there."""
    for lane in range(LANES):
        kink_i, kink_k = book[j, i, _KINK + lane], book[j, k, _KINK + lane]
        weight_i, weight_k = book[j, i, _WEIGHT + lane], book[j, k, _WEIGHT + lane]
        book[j, i, SLOPE + lane] += weight_k if kink_k < kink_i else -weight_k
        book[j, k, SLOPE + lane] += weight_i if kink_i < kink_k else -weight_i


@device
def _blend(j: int, book: Book) -> None:
    """Choose between the fastest and the braking x, by the shares."""
    last = last_row(book)
    for lane in range(LANES):
        fastest, share = book[j, last, TOP + lane], book[j, last, SHARE + lane]
        braking = min(max(book[j, last, BRAKING + lane], book[j, last, LOW + lane]), fastest)
        blend = braking + share * (fastest - braking)
        book[j, last, CHOSEN + lane] = fastest if share >= 1.0 else blend


@device
def _look_outside(limits: Array, j: int, book: Book) -> bool:
    """Find joints that turn beyond their range; both nodes lie within it."""
    last = last_row(book)
    found = 0
    for lane in range(LANES):
        book[j, last, OUTSIDE + lane] = 0.0
    for i in range(limits.shape[1]):
        found += _look_outside_joint(limits[LOWER, i], limits[UPPER, i], j, i, book)
    return found > 0


@device
def _look_outside_joint(lower: float, upper: float, j: int, i: int, book: Book) -> int:
    """Compare the turning point, v^2 / (4 x (v - D x)) beyond the node, with the room r there is.

    Where it is too far, the joint turns in time from x = v / (2 r (1 + sqrt(1 - D / r))) on.
    """
    last = last_row(book)
    found = 0
    for lane in range(LANES):
        forward = book[j, i, RATE + lane] > 0.0
        room = upper - book[j, i, NODE + lane] if forward else book[j, i, NODE + lane] - lower
        room += _SLACK
        ahead = book[j, i, STEP + lane] if forward else -book[j, i, STEP + lane]
        speed = abs(book[j, i, RATE + lane])
        x = book[j, last, CHOSEN + lane]
        turns = 2.0 * ahead * x < speed
        beyond = turns & (speed * speed > 4.0 * x * (speed - ahead * x) * room)
        some_room = max(room, _TINY)
        root = np.sqrt(max(1.0 - ahead / some_room, 0.0))
        needed = speed / (2.0 * some_room * (1.0 + root))
        book[j, last, OUTSIDE + lane] = max(
            book[j, last, OUTSIDE + lane], needed if beyond else 0.0
        )
        found += 1 if beyond else 0
    return found


@device
def _come_inside(j: int, book: Book) -> None:
    """Forbid the x at which a joint turns too late, in the lanes where that happened."""
    last = last_row(book)
    for lane in range(LANES):
        low, top = book[j, last, LOW + lane], book[j, last, TOP + lane]
        lost = book[j, last, OUTSIDE + lane] > top
        book[j, last, LOST + lane] = 1.0 if lost else book[j, last, LOST + lane]
        book[j, last, LOW + lane] = top if lost else max(low, book[j, last, OUTSIDE + lane])
