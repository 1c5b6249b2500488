"""Shapes of the network: which TRAMs are joined by links, and the shortest way from one to another.

A T805 has four links and the root gives one of its own to the host, so a shape keeps every TRAM at four links and
the root at three. A *virtual* shape is free of that: it stands for what a crossbar of switches would offer. All
routes are shortest; between equally short ones the lowest next seat is taken, so that all nodes agree.
"""

from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TypeAlias

from tramnet_protocol.errors import BadTopology
from tramnet_protocol.limits import MAX_SEATS
from tramnet_protocol.messages import ROOT, Wiring

LINKS_PER_TRAM = 4
LINKS_OF_THE_ROOT = 3

Edge: TypeAlias = tuple[int, int]


@dataclass(frozen=True)
class Graph:
    """TRAMs and the undirected links between them.

    Attributes:
        seats: The TRAMs, in ascending order.
        edges: The links, each once with its lower seat first, in ascending order.
    """

    seats: tuple[int, ...]
    edges: tuple[Edge, ...]

    @classmethod
    def of(cls, seats: Iterable[int], edges: Iterable[Edge]) -> "Graph":
        """Return the graph of some TRAMs and links, in any order and direction.

        Raises:
            BadTopology: A link joins a TRAM to itself or to one that is not there.
        """
        known = frozenset(seats)
        for edge in (links := {(min(edge), max(edge)) for edge in edges}):
            if edge[0] == edge[1] or not known.issuperset(edge):
                raise BadTopology(
                    f"found the link {edge}; expected two different TRAMs of the graph"
                )
        return cls(tuple(sorted(known)), tuple(sorted(links)))

    @cached_property
    def neighbours(self) -> Mapping[int, tuple[int, ...]]:
        """The TRAMs at the other ends of each TRAM's links, in ascending order."""
        found: dict[int, list[int]] = {seat: [] for seat in self.seats}
        for low, high in self.edges:
            found[low].append(high)
            found[high].append(low)
        return MappingProxyType({seat: tuple(sorted(others)) for seat, others in found.items()})

    def distances(self, source: int) -> dict[int, int]:
        """Return the number of links from a TRAM to each one it can reach, by breadth-first search."""
        hops = {source: 0}
        waiting = deque([source])
        while waiting:
            seat = waiting.popleft()
            for other in self.neighbours[seat]:
                if other not in hops:
                    hops[other] = hops[seat] + 1
                    waiting.append(other)
        return hops

    def next_hops(self, source: int) -> dict[int, int]:
        """Return the neighbour through which a TRAM reaches each other one on a shortest way."""
        first = {seat: seat for seat in self.neighbours[source]}
        waiting = deque(self.neighbours[source])
        while waiting:
            seat = waiting.popleft()
            for other in self.neighbours[seat]:
                if other != source and other not in first:
                    first[other] = first[seat]
                    waiting.append(other)
        return first

    def route(self, source: int, destination: int) -> tuple[int, ...]:
        """Return the TRAMs a frame passes, both ends included.

        Raises:
            BadTopology: There is no way.
        """
        way = [source]
        while way[-1] != destination:
            hop = self.next_hops(way[-1]).get(destination)
            if hop is None:
                raise BadTopology(f"found no way from TRAM {source} to TRAM {destination}")
            way.append(hop)
        return tuple(way)

    def check_links(self) -> None:
        """Check that no TRAM needs more links than it has.

        Raises:
            BadTopology: One does.
        """
        for seat, others in self.neighbours.items():
            limit = LINKS_OF_THE_ROOT if seat == ROOT else LINKS_PER_TRAM
            if len(others) > limit:
                raise BadTopology(f"found {len(others)} links at TRAM {seat}; it has {limit}")


@dataclass(frozen=True)
class Shape:
    """A way to join TRAMs.

    Attributes:
        join: Makes the links over live TRAMs, given in ascending order, the root first.
        virtual: Whether it may need more links than a TRAM has.
        max_trams: Largest number of TRAMs, the root included.
    """

    join: Callable[[Sequence[int]], Iterable[Edge]]
    virtual: bool = False
    max_trams: int = MAX_SEATS


def star(seats: Sequence[int]) -> list[Edge]:
    """Join every worker to the root: one hop everywhere."""
    return [(seats[0], seat) for seat in seats[1:]]


SHAPES: Mapping[str, Shape] = MappingProxyType({"star": Shape(star, virtual=True)})
"""The shapes by name."""


ALL_SEATS = range(1, MAX_SEATS)
"""Seats of workers."""


def lowest_free_seat(taken: Collection[int], among: range = ALL_SEATS) -> int:
    """Return the seat of the next worker to join.

    Args:
        taken: Seats that are taken.
        among: Seats it may have.

    Raises:
        BadTopology: All of these are taken.
    """
    for seat in among:
        if seat not in taken:
            return seat
    raise BadTopology(
        f"found all {len(among)} seats from {among.start} to {among.stop - 1} taken; "
        "remove a worker first"
    )


def connect(topology: str, seats: Collection[int]) -> Graph:
    """Return the graph of a shape over live TRAMs.

    Args:
        topology: Name of the shape.
        seats: The live TRAMs, the root included.

    Raises:
        BadTopology: The shape is unknown, or cannot join them.
    """
    shape = SHAPES.get(topology)
    if shape is None:
        raise BadTopology(f"found the topology {topology!r}; expected one of {', '.join(SHAPES)}")
    if ROOT not in seats or len(seats) > shape.max_trams:
        raise BadTopology(
            f"found {len(seats)} TRAMs{'' if ROOT in seats else ' without the root'}; "
            f"{topology} joins the root and at most {shape.max_trams - 1} workers"
        )
    graph = Graph.of(seats, shape.join(sorted(seats)))
    if not shape.virtual:
        graph.check_links()
    return graph


def rewire(topology: str, incarnations: Mapping[int, int], epoch: int) -> Wiring:
    """Return the wiring over live TRAMs.

    Args:
        topology: Name of the shape.
        incarnations: Incarnation of each live TRAM by seat, the root included.
        epoch: Number of the wiring.

    Raises:
        BadTopology: The shape is unknown, or cannot join them.
    """
    graph = connect(topology, incarnations.keys())
    return Wiring(epoch, topology, dict(incarnations), graph.edges)


def graph_of(wiring: Wiring) -> Graph:
    """Return the graph of a wiring that arrived.

    Raises:
        BadTopology: A link of it joins a TRAM that is not live.
    """
    return Graph.of(wiring.incarnations, wiring.edges)
