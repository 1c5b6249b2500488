"""Where the TRAMs of a shape stand in a drawing: in a lattice, on a circle, or around the root.

Places are pure geometry, the same for the terminal and for figures; y points down, as lines are written.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from tramnet_protocol.messages import ROOT
from tramnet_protocol.shapes import width_of_lattice
from tramnet_protocol.topology import Graph

LINE = 10
"""Longest line of a pipeline, which turns at its end, and of a ring [TRAM]."""

GRAY = (0, 1, 3, 2)
"""Bits of a place in a row or column of a hypercube: neighbours differ in one."""


class Cell(NamedTuple):
    """A place in a lattice."""

    row: int
    column: int


class Point(NamedTuple):
    """A place in the plane."""

    x: float
    y: float


def _snake(n: int) -> list[Cell]:
    rows = (divmod(i, LINE) for i in range(n))
    return [Cell(row, column if row % 2 == 0 else LINE - 1 - column) for row, column in rows]


def _around(n: int) -> list[Cell]:
    """The rim of a rectangle; where the number is odd, a place on its last straight side stays free."""
    if n < 4:
        return [Cell(0, i) for i in range(n)]
    half = (n + 1) // 2
    width = min(half, LINE)
    bottom = half + 1 - width
    rim = [Cell(0, column) for column in range(width)]
    rim += [Cell(row, width - 1) for row in range(1, bottom)]
    rim += [Cell(bottom, column) for column in range(width - 1, -1, -1)]
    rim += [Cell(row, 0) for row in range(bottom - 1, 0, -1)]
    if n % 2:
        del rim[-2 if bottom == 1 else -1]
    return rim


def _rows(n: int) -> list[Cell]:
    return [Cell(*divmod(i, width_of_lattice(n))) for i in range(n)]


def _cube(n: int) -> list[Cell]:
    return [Cell(GRAY.index(i >> 2), GRAY.index(i & 3)) for i in range(n)]


_LATTICES: Mapping[str, Callable[[int], list[Cell]]] = MappingProxyType(
    {
        "pipeline": _snake,
        "ring": _around,
        "grid": _rows,
        "torus": _rows,
        "hypercube": _cube,
    }
)


def lattice(topology: str, seats: Sequence[int]) -> dict[int, Cell] | None:
    """Return the cells of live TRAMs in a lattice, or None where the shape is none.

    Args:
        topology: Name of the shape.
        seats: The live TRAMs in ascending order.
    """
    place = _LATTICES.get(topology)
    return dict(zip(seats, place(len(seats)), strict=True)) if place else None


def circle(seats: Sequence[int]) -> dict[int, Point]:
    """Return places on a circle, the first at the top, clockwise, neighbours one apart."""
    radius = 0.5 / math.sin(math.pi / max(3, len(seats)))
    turns = (2.0 * math.pi * i / len(seats) for i in range(len(seats)))
    return {
        seat: Point(radius * math.sin(turn), -radius * math.cos(turn))
        for seat, turn in zip(seats, turns, strict=True)
    }


def around_the_root(graph: Graph) -> dict[int, Point]:
    """Return places around the root, each TRAM on the circle of its hops and within its parent's sector."""
    before = graph.predecessors(ROOT)
    children: dict[int, list[int]] = {seat: [] for seat in graph.seats}
    for seat, parent in before.items():
        children[parent].append(seat)
    leaves = {seat: 1 for seat in graph.seats}
    for seat in reversed(before):  # the farthest first
        below = children[seat]
        leaves[seat] = sum(leaves[child] for child in below) if below else 1
    turns = {ROOT: (0.0, 2.0 * math.pi)}
    for parent in (ROOT, *before):
        at, end = turns[parent]
        share = (end - at) / max(1, sum(leaves[child] for child in children[parent]))
        for child in children[parent]:
            turns[child] = at, at + share * leaves[child]
            at = turns[child][1]
    hops = graph.distances(ROOT)
    apart = max(1.0, max(_crowding(hops, turns), default=1.0))
    return {seat: _on_circle(apart * hops[seat], sum(turns[seat]) / 2.0) for seat in graph.seats}


def _crowding(hops: Mapping[int, int], turns: Mapping[int, tuple[float, float]]) -> list[float]:
    """Return the distance between circles that each TRAM would need for 0.8 of room on its own."""
    return [0.8 / (hops[s] * (b - a)) for s, (a, b) in turns.items() if hops[s]]


def _on_circle(radius: float, turn: float) -> Point:
    return Point(radius * math.sin(turn), -radius * math.cos(turn))
