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

from tramnet_protocol import shapes
from tramnet_protocol.errors import BadTopology
from tramnet_protocol.limits import MAX_SEATS
from tramnet_protocol.messages import ROOT, Wiring
from tramnet_protocol.shapes import LINKS_OF_THE_ROOT, Edge

LINKS_PER_TRAM = 4
"""Links of a T805."""

LARGEST_HYPERCUBE = 16
"""TRAMs in the cube of as many dimensions as a TRAM has links."""


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

    def predecessors(self, source: int) -> dict[int, int]:
        """Return the TRAM before each other one on its route from a TRAM: all routes in one search."""
        before: dict[int, int] = {}
        waiting = deque([source])
        while waiting:
            seat = waiting.popleft()
            for other in self.neighbours[seat]:
                if other != source and other not in before:
                    before[other] = seat
                    waiting.append(other)
        return before

    def hops_towards(self, destination: int) -> dict[int, int]:
        """Return the next TRAM of each other one on its route to a TRAM: all routes in one search."""
        distances = self.distances(destination)
        return {
            seat: next(
                other for other in self.neighbours[seat] if distances[other] == distances[seat] - 1
            )
            for seat in distances
            if seat != destination
        }

    def route(self, source: int, destination: int) -> tuple[int, ...]:
        """Return the TRAMs a frame passes, both ends included.

        Raises:
            BadTopology: There is no way.
        """
        hops = self.hops_towards(destination)
        way = [source]
        while way[-1] != destination:
            hop = hops.get(way[-1])
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
            limit = links_of(seat)
            if len(others) > limit:
                given = "; its fourth is the host's" if seat == ROOT else ""
                raise BadTopology(
                    f"found {len(others)} links at TRAM {seat}; it has {limit}{given}"
                )


@dataclass(frozen=True)
class Shape:
    """A way to join TRAMs.

    Attributes:
        name: What it is called.
        join: Makes the links over live TRAMs, given in ascending order, the root first.
        virtual: Whether it may need more links than a TRAM has.
        max_trams: Largest number of TRAMs, the root included.
        larger: Name of a shape for more TRAMs, where there is one.
        links: The user's own links that it lays, or none.
    """

    name: str
    join: Callable[[Sequence[int]], Iterable[Edge]]
    virtual: bool = False
    max_trams: int = MAX_SEATS
    larger: str = ""
    links: tuple[Edge, ...] = ()

    def check_room(self, n_trams: int) -> None:
        """Check that so many TRAMs, the root included, can be joined.

        Raises:
            BadTopology: They cannot.
        """
        if n_trams > self.max_trams:
            instead = f"; use {self.larger} for more" if self.larger else ""
            raise BadTopology(
                f"found {n_trams - 1} workers; {self.name} joins the root and at most "
                f"{self.max_trams - 1}{instead}"
            )

    def connect(self, seats: Collection[int]) -> Graph:
        """Return the graph over live TRAMs.

        Args:
            seats: The live TRAMs, the root included.

        Raises:
            BadTopology: They cannot be joined.
        """
        if ROOT not in seats:
            raise BadTopology(f"found {len(seats)} TRAMs without the root; TRAM {ROOT} is missing")
        self.check_room(len(seats))
        graph = Graph.of(seats, self.join(sorted(seats)))
        if not self.virtual:
            graph.check_links()
        return graph


SHAPES: Mapping[str, Shape] = MappingProxyType(
    {
        shape.name: shape
        for shape in (
            Shape("star", shapes.star, virtual=True),
            Shape("pipeline", shapes.pipeline),
            Shape("ring", shapes.ring),
            Shape("tree", shapes.tree),
            Shape("grid", shapes.grid),
            Shape("torus", shapes.torus),
            Shape("hypercube", shapes.hypercube, max_trams=LARGEST_HYPERCUBE, larger="torus"),
        )
    }
)
"""The shapes by name."""


ALL_SEATS = range(1, MAX_SEATS)
"""Seats of workers."""


def links_of(seat: int) -> int:
    """Return how many links of a TRAM can join others."""
    return LINKS_OF_THE_ROOT if seat == ROOT else LINKS_PER_TRAM


def shape_named(name: str) -> Shape:
    """Return the shape of that name.

    Raises:
        BadTopology: There is none.
    """
    shape = SHAPES.get(name)
    if shape is None:
        raise BadTopology(
            f"found the topology {name!r}; expected one of {', '.join(SHAPES)}, or a file of your "
            "own links that ends in .toml"
        )
    return shape


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
    """Return the graph of a named shape over live TRAMs.

    Args:
        topology: Name of the shape.
        seats: The live TRAMs, the root included.

    Raises:
        BadTopology: The shape is unknown, or cannot join them.
    """
    return shape_named(topology).connect(seats)


def rewire(shape: Shape, incarnations: Mapping[int, int], epoch: int) -> Wiring:
    """Return the wiring over live TRAMs.

    Args:
        shape: How to join them.
        incarnations: Incarnation of each live TRAM by seat, the root included.
        epoch: Number of the wiring.

    Raises:
        BadTopology: The shape cannot join them.
    """
    graph = shape.connect(incarnations.keys())
    return Wiring(epoch, shape.name, dict(incarnations), graph.edges)


def check_wiring(wiring: Wiring) -> None:
    """Check the links of a wiring that arrived, in less time than its graph takes.

    Raises:
        BadTopology: A link of it joins a TRAM to itself or to one that is not live.
    """
    live = wiring.incarnations
    for one, other in wiring.edges:
        if one == other or one not in live or other not in live:
            raise BadTopology(f"found the link {one}-{other}; expected two different live TRAMs")


def graph_of(wiring: Wiring) -> Graph:
    """Return the graph of a wiring that arrived.

    Raises:
        BadTopology: A link of it joins a TRAM that is not live.
    """
    return Graph.of(wiring.incarnations, wiring.edges)
