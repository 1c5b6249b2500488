"""The links of each shape over live TRAMs, given in ascending order of seats, the root first.

A shape is laid over the live TRAMs in their order, whatever their seats, so that every number of TRAMs is joined,
and any subset of them: a grid, torus or cube that is not full lacks its last places. Functions here return each
link at least once, in any direction; each takes time in proportion to its links.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

Edge: TypeAlias = tuple[int, int]

BRANCHES = 3
"""Children of a TRAM in a tree: its fourth link goes to its parent, the root's to the host."""

LINKS_OF_THE_ROOT = 3
"""Links of the root that join TRAMs; its fourth is the host's."""


def star(seats: Sequence[int]) -> list[Edge]:
    """Join every worker to the root: one hop everywhere."""
    return [(seats[0], seat) for seat in seats[1:]]


def pipeline(seats: Sequence[int]) -> list[Edge]:
    """Join each TRAM to the next."""
    return list(pairwise(seats))


def ring(seats: Sequence[int]) -> list[Edge]:
    """Join each TRAM to the next, and the last to the first."""
    return [*pairwise(seats), (seats[-1], seats[0])] if len(seats) > 2 else pipeline(seats)


def tree(seats: Sequence[int]) -> list[Edge]:
    """Join each TRAM to three below it, level by level."""
    return [(seats[(i - 1) // BRANCHES], seats[i]) for i in range(1, len(seats))]


def grid(seats: Sequence[int]) -> list[Edge]:
    """Join the neighbours in a lattice as square as can be, filled row by row."""
    return [edge for line in _lines(seats) for edge in pipeline(line)]


def torus(seats: Sequence[int]) -> list[Edge]:
    """Close every row and column of a grid to a ring; a root of four links gives one to the host."""
    return _cut_for_host(seats, [edge for line in _lines(seats) for edge in ring(line)])


def hypercube(seats: Sequence[int]) -> list[Edge]:
    """Join the TRAMs whose numbers differ in one bit; a root of four links gives one to the host."""
    n = len(seats)
    bits = [1 << k for k in range(n.bit_length())]
    edges = [(seats[i], seats[i | b]) for i in range(n) for b in bits if i < (i | b) < n]
    return _cut_for_host(seats, edges)


def width_of_lattice(n_trams: int) -> int:
    """Return how many TRAMs stand in a full row of a grid or torus."""
    return math.isqrt(n_trams - 1) + 1


def _lines(seats: Sequence[int]) -> list[Sequence[int]]:
    """Return the rows and the columns of the lattice."""
    width = width_of_lattice(len(seats))
    rows = [seats[i : i + width] for i in range(0, len(seats), width)]
    return rows + [seats[i::width] for i in range(width)]


def _cut_for_host(seats: Sequence[int], edges: list[Edge]) -> list[Edge]:
    """Take the root's link to the next TRAM away if it has one too many; other ways lead there."""
    links = {frozenset(edge) for edge in edges if seats[0] in edge}
    if len(links) <= LINKS_OF_THE_ROOT:
        return edges
    cut = {seats[0], seats[1]}
    return [edge for edge in edges if set(edge) != cut]
