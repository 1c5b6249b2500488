"""Decoding of grid trajectories: from levels to intervals and velocities.

Wang & Zalzala (1995), section 4.2: segment after segment, each from the velocity that the one before
left. A trajectory accelerates up to its *switch* sigma in [0, n] and brakes from there; the segment
in which a fractional switch falls blends both.

Trajectories are decoded in lane blocks; the lanes left over in the last block repeat its first
trajectory, so every one is computed by the same instructions wherever it stands.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.book import (
    CHOSEN,
    FAILED,
    IMPULSE,
    LOST,
    NODE,
    RATE,
    SHARE,
    STEP,
    SUM,
    TIME,
    TORQUE,
    A,
    B,
    Book,
    C,
    last_row,
    n_segments,
)
from tramnet_workers.kernels.dynamics import LANES
from tramnet_workers.kernels.phases import choose_interval
from tramnet_workers.kernels.segment import move_segment, rest_segments

Array = NDArray[np.float64]
Levels = NDArray[np.int16]


class Rules(NamedTuple):
    """How trajectories are decoded and what they are worth.

    Attributes:
        posture: START, MIDDLE or EXACT of ``kernels.segment``.
        switch: LITERAL or CONTINUOUS of ``kernels.switching``.
        scan_points: Switches per segment that the search scans.
        refinements: Steps of the golden section.
        slowest: Least x that braking may choose [1/s].
        time: Weight of the motion time [1/s].
        torque: Weight of the torque impulse [1/s].
        end_velocity: Weight of the end velocities [s/rad].
    """

    posture: int
    switch: int
    scan_points: int
    refinements: int
    slowest: float
    time: float
    torque: float
    end_velocity: float


@kernel
def lay_out(genomes: Levels, first: int, placement: Array, book: Book) -> None:
    """Place the nodes of LANES trajectories side by side, at rest at the start.

    Args:
        genomes: Levels of the inner nodes, of shape (k, n_joints, n - 1).
        first: Index of the first trajectory.
        placement: Start, goal, line and step of each joint, of shape (4, n_joints) [rad]: a joint's
            angle at node j is start + line * j + step * level.
        book: Receives NODE and STEP of all pages, and what holds at the start.
    """
    n, last = n_segments(book), last_row(book)
    for row in range(last):
        i = row % genomes.shape[1]
        start, goal = placement[0, i], placement[1, i]
        line, step = placement[2, i], placement[3, i]
        for lane in range(LANES):
            at = first + lane if first + lane < genomes.shape[0] else first
            book[0, row, NODE + lane] = start
            book[0, row, RATE + lane] = 0.0
            book[n, row, NODE + lane] = goal
            for j in range(1, n):
                book[j, row, NODE + lane] = start + line * j + step * genomes[at, i, j - 1]
        for j in range(n):
            for lane in range(LANES):
                after = book[j + 1, row, NODE + lane]
                book[j, row, STEP + lane] = after - book[j, row, NODE + lane]
    for lane in range(LANES):
        book[0, last, TIME + lane] = 0.0
        book[0, last, IMPULSE + lane] = 0.0
        book[0, last, FAILED + lane] = 0.0


@kernel
def prepare(
    arm: Array, gravity: Array, posture: int, book: Book, chain: Array, links: Array
) -> None:
    """Compute for all segments what does not depend on velocities; see ``rest_segments``."""
    rest_segments(arm, gravity, posture, book, chain, links)


@kernel
def travel(
    arm: Array,
    gravity: Array,
    limits: Array,
    rules: Rules,
    first: int,
    switch: Array,
    worst: Array,
    book: Book,
    chain: Array,
    links: Array,
) -> bool:
    """Go from a node to the end, or until no lane can come to anything.

    Args:
        arm: Table of the arm, of shape (n_joints, ARM_COLUMNS).
        gravity: Acceleration of gravity in the base frame, of shape (3,) [m/s²].
        limits: What the joints may do, of shape (LIMIT_ROWS, n_joints).
        rules: How to decode.
        first: Node to go from; what the book says of it holds for these switches.
        switch: A switch for each lane, of shape (LANES,).
        worst: Costs from which on a lane is hopeless, of shape (LANES,); may be inf.
        book: The trajectories.
        chain: Scratch; see ``kernels.inertia``.
        links: Scratch; see ``kernels.inertia``.

    Returns:
        Whether the end was reached.
    """
    last = last_row(book)
    for j in range(first, n_segments(book)):
        for lane in range(LANES):
            book[j, last, SHARE + lane] = min(max(switch[lane] - j, 0.0), 1.0)
        move_segment(arm, gravity, rules.posture, j, book, chain, links)
        choose_interval(limits, rules.slowest, j, book)
        _advance(limits, rules.torque > 0.0, j, book)
        if _all_hopeless(rules, j + 1, worst, book):
            return False
    return True


@device
def _advance(limits: Array, torques_count: bool, j: int, book: Book) -> None:
    """Note what holds at the end of a segment."""
    last = last_row(book)
    for lane in range(LANES):
        h = 1.0 / book[j, last, CHOSEN + lane]
        book[j + 1, last, TIME + lane] = book[j, last, TIME + lane] + h
        failed = max(book[j, last, FAILED + lane], book[j, last, LOST + lane])
        book[j + 1, last, FAILED + lane] = failed
    for row in range(last):
        for lane in range(LANES):
            gain = 2.0 * book[j, row, STEP + lane] * book[j, last, CHOSEN + lane]
            book[j + 1, row, RATE + lane] = gain - book[j, row, RATE + lane]
    if torques_count:
        _add_impulse(limits, j, book)


@device
def _add_impulse(limits: Array, j: int, book: Book) -> None:
    """Add h * mean_i |tau_i| / bound_i, over all postures at which torques are bounded."""
    last = last_row(book)
    for lane in range(LANES):
        book[j, last, SUM + lane] = 0.0
    for row in range(last):
        bound = limits[TORQUE, row % limits.shape[1]]
        for lane in range(LANES):
            x = book[j, last, CHOSEN + lane]
            slope = book[j, row, A + lane] * x + 2.0 * book[j, row, B + lane]
            book[j, last, SUM + lane] += abs(slope * x + book[j, row, C + lane]) / bound
    for lane in range(LANES):
        share = book[j, last, SUM + lane] / (last * book[j, last, CHOSEN + lane])
        book[j + 1, last, IMPULSE + lane] = book[j, last, IMPULSE + lane] + share


@device
def _all_hopeless(rules: Rules, j: int, worst: Array, book: Book) -> bool:
    last = last_row(book)
    hopeful = 0
    for lane in range(LANES):
        cost = rules.time * book[j, last, TIME + lane]
        # The impulse is not kept up where it does not count.
        cost += rules.torque * book[j, last, IMPULSE + lane] if rules.torque > 0.0 else 0.0
        hopeful += 1 if cost < worst[lane] else 0
    return hopeful == 0
