"""Objectives of grid trajectories, each with its switch from accelerating to braking.

J = time * sum_j h_j + torque * sum_j tau_j + end_velocity * sum_i |v_n^i|, Wang & Zalzala (1995),
eqs 7-10; a trajectory with a segment that no interval allows has J = HOPELESS.

``LITERAL`` switches after n // 2 segments, as the paper's two parts of the motion suggest;
``CONTINUOUS`` searches the switch that gives the best objective. J has several minima over the
switch and a kink where the arm can just stop: a scan finds the region, golden sections the place.
Where end velocities do not count, nothing ever brakes.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.book import (
    CHOSEN,
    FAILED,
    IMPULSE,
    RATE,
    TIME,
    A,
    B,
    Book,
    C,
    last_row,
    n_segments,
    new_book,
)
from tramnet_workers.kernels.dynamics import LANES
from tramnet_workers.kernels.inertia import new_chain, new_links
from tramnet_workers.kernels.motion import Levels, Rules, lay_out, prepare, travel
from tramnet_workers.kernels.segment import n_postures

Array = NDArray[np.float64]

LITERAL = 0
CONTINUOUS = 1

#: Objective of a trajectory with a segment that no interval allows: far above any other, and finite.
HOPELESS = 1e6

_GOLDEN = 0.6180339887498949

# Rows of a search, each of a number for every lane.
_BEST = 0  # the best switch so far
_BEST_J = 1
_TRIAL = 2  # the switch to try next
_TRIAL_J = 3
_LOW = 4  # ends of the bracket
_HIGH = 5
_LEFT = 6  # the two switches inside it
_LEFT_J = 7
_RIGHT = 8
_RIGHT_J = 9
_NEVER = 10  # inf
_SEARCH_ROWS = 11


class Decoder(NamedTuple):
    """Everything a kernel needs to decode trajectories.

    Attributes:
        arm: Table of the arm, of shape (n_joints, ARM_COLUMNS).
        gravity: Acceleration of gravity in the base frame, of shape (3,) [m/s²].
        limits: What the joints may do, of shape (LIMIT_ROWS, n_joints); see ``kernels.book``.
        placement: Where the levels are, of shape (4, n_joints); see ``motion.lay_out``.
        rules: How to decode and what counts.
    """

    arm: Array
    gravity: Array
    limits: Array
    placement: Array
    rules: Rules


class Room(NamedTuple):
    """Where one block after the other is decoded."""

    book: Book
    search: Array
    chain: Array
    links: Array


@kernel
def evaluate(decoder: Decoder, genomes: Levels, objectives: Array) -> None:
    """Compute the objectives of trajectories.

    Args:
        decoder: How to decode them.
        genomes: Levels of the inner nodes, of shape (k, n_joints, n - 1).
        objectives: Receives J, of shape (k,).
    """
    k = genomes.shape[0]
    room = _new_room(decoder.rules.posture, genomes)
    for first in range(0, k, LANES):
        _decode_block(decoder, genomes, first, room)
        for lane in range(min(LANES, k - first)):
            objectives[first + lane] = min(room.search[_BEST_J, lane], HOPELESS)


@kernel
def decode(decoder: Decoder, genome: Levels, x: Array, torques: Array) -> float:
    """Decode one trajectory exactly as ``evaluate`` does.

    Args:
        decoder: How to decode it.
        genome: Levels of the inner nodes, of shape (1, n_joints, n - 1).
        x: Receives 1 / h, of shape (n,) [1/s].
        torques: Receives the torques of each segment at the first posture at which they are
            bounded, of shape (n, n_joints) [N m].

    Returns:
        The switch, in [0, n]; nan if the trajectory cannot be decoded.
    """
    room = _new_room(decoder.rules.posture, genome)
    book, search = room.book, room.search
    _decode_block(decoder, genome, 0, room)
    search[_TRIAL] = search[_BEST]
    _attempt(decoder, 0, _NEVER, room)
    n, last = n_segments(book), last_row(book)
    for j in range(n):
        x[j] = book[j, last, CHOSEN]
        for i in range(genome.shape[1]):
            slope = book[j, i, A] * x[j] + 2.0 * book[j, i, B]
            torques[j, i] = slope * x[j] + book[j, i, C]
    return np.nan if book[n, last, FAILED] > 0.0 else search[_BEST, 0]


@kernel
def _new_room(posture: int, genomes: Levels) -> Room:
    n_joints = genomes.shape[1]
    book = new_book(genomes.shape[2] + 1, n_joints, n_postures(posture))
    return Room(book, np.full((_SEARCH_ROWS, LANES), np.inf), new_chain(), new_links(n_joints))


@kernel
def _decode_block(decoder: Decoder, genomes: Levels, first: int, room: Room) -> None:
    """Find the best switch of each lane, or take the one that the rules prescribe."""
    rules, book, search = decoder.rules, room.book, room.search
    lay_out(genomes, first, decoder.placement, book)
    prepare(decoder.arm, decoder.gravity, rules.posture, book, room.chain, room.links)
    n = n_segments(book)
    searches = rules.end_velocity > 0.0 and rules.switch == CONTINUOUS
    search[_BEST_J] = np.inf
    search[_BEST] = n
    search[_TRIAL] = n // 2 if rules.end_velocity > 0.0 and not searches else n
    _attempt(decoder, 0, _NEVER, room)
    if searches:
        _scan(decoder, room)
        _refine(decoder, room)


@kernel
def _scan(decoder: Decoder, room: Room) -> None:
    """Try all switches of a grid, the last first: what lies before a switch is then known.

    Once all lanes are worse than their best, nothing that may follow matters.
    """
    points = decoder.rules.scan_points
    for k in range(n_segments(room.book) * points - 1, 0, -1):
        room.search[_TRIAL] = k / points
        _attempt(decoder, k // points, _BEST_J, room)


@kernel
def _refine(decoder: Decoder, room: Room) -> None:
    """Narrow the bracket around the best switch of each lane by golden sections."""
    search = room.search
    first = _bracket(n_segments(room.book), 1.0 / decoder.rules.scan_points, search)
    search[_TRIAL] = search[_RIGHT]
    _attempt(decoder, 0, _NEVER, room)  # from the start: the scan has left early switches behind
    search[_RIGHT_J] = search[_TRIAL_J]
    search[_TRIAL] = search[_LEFT]
    _attempt(decoder, first, _NEVER, room)
    search[_LEFT_J] = search[_TRIAL_J]
    for _ in range(decoder.rules.refinements):
        _narrow(search)
        _attempt(decoder, first, _NEVER, room)
        _take_in(search)


@device
def _bracket(n: int, width: float, search: Array) -> int:
    """Put a bracket around the best switches; return the last node before all of them."""
    first = n
    for lane in range(LANES):
        low = max(search[_BEST, lane] - width, 0.0)
        high = min(search[_BEST, lane] + width, 1.0 * n)
        search[_LOW, lane], search[_HIGH, lane] = low, high
        search[_LEFT, lane] = high - _GOLDEN * (high - low)
        search[_RIGHT, lane] = low + _GOLDEN * (high - low)
        first = min(first, int(low))
    return first


@device
def _narrow(search: Array) -> None:
    """Drop the worse end of each bracket and propose the switch that is missing inside it."""
    for lane in range(LANES):
        if search[_LEFT_J, lane] <= search[_RIGHT_J, lane]:
            search[_HIGH, lane] = search[_RIGHT, lane]
            search[_RIGHT, lane], search[_RIGHT_J, lane] = (
                search[_LEFT, lane],
                search[_LEFT_J, lane],
            )
            width = search[_HIGH, lane] - search[_LOW, lane]
            search[_LEFT, lane] = search[_HIGH, lane] - _GOLDEN * width
            search[_TRIAL, lane] = search[_LEFT, lane]
            search[_LEFT_J, lane] = np.nan  # to come
        else:
            search[_LOW, lane] = search[_LEFT, lane]
            search[_LEFT, lane], search[_LEFT_J, lane] = (
                search[_RIGHT, lane],
                search[_RIGHT_J, lane],
            )
            width = search[_HIGH, lane] - search[_LOW, lane]
            search[_RIGHT, lane] = search[_LOW, lane] + _GOLDEN * width
            search[_TRIAL, lane] = search[_RIGHT, lane]
            search[_RIGHT_J, lane] = np.nan


@device
def _take_in(search: Array) -> None:
    """Put the objective of the trial where it is missing."""
    for lane in range(LANES):
        row = _LEFT_J if np.isnan(search[_LEFT_J, lane]) else _RIGHT_J
        search[row, lane] = search[_TRIAL_J, lane]


@kernel
def _attempt(decoder: Decoder, first: int, worst: int, room: Room) -> None:
    """Travel with the trial switch from a node that does not depend on it, and keep the best."""
    book, search = room.book, room.search
    arrived = travel(
        decoder.arm,
        decoder.gravity,
        decoder.limits,
        decoder.rules,
        first,
        search[_TRIAL],
        search[worst],
        book,
        room.chain,
        room.links,
    )
    if arrived:
        _score(decoder.rules, decoder.arm.shape[0], book, search)
        for lane in range(LANES):
            if search[_TRIAL_J, lane] < search[_BEST_J, lane]:
                search[_BEST, lane] = search[_TRIAL, lane]
                search[_BEST_J, lane] = search[_TRIAL_J, lane]


@device
def _score(rules: Rules, n_joints: int, book: Book, search: Array) -> None:
    n, last = n_segments(book), last_row(book)
    for lane in range(LANES):
        search[_TRIAL_J, lane] = 0.0
    for i in range(n_joints):
        for lane in range(LANES):
            search[_TRIAL_J, lane] += abs(book[n, i, RATE + lane])
    for lane in range(LANES):
        J = rules.end_velocity * search[_TRIAL_J, lane] + rules.time * book[n, last, TIME + lane]
        J += rules.torque * book[n, last, IMPULSE + lane] if rules.torque > 0.0 else 0.0
        search[_TRIAL_J, lane] = np.inf if book[n, last, FAILED + lane] > 0.0 else J
