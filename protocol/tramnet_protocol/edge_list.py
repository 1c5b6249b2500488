"""A user's own shape: links between seats, whichever of these are taken.

Links between two live TRAMs are used as they stand. What is cut off from the root then, because a TRAM on the way
is not there or because the list does not know a seat, is attached by one rule: part by part, in the order of their
lowest seats, the lowest TRAM of the part with a link to spare is joined to the lowest TRAM with a link to spare
among those that reach the root.

There always is such a pair. A part that lost its way has a TRAM whose link led to a missing one. And not all TRAMs
that reach the root are full: a root of 3 links and n others of 4 have 3 + 4 n ends of links, an odd number, and
every link has two.
"""

import heapq
from collections.abc import Iterable, Sequence
from itertools import islice

from tramnet_protocol.errors import BadTopology
from tramnet_protocol.limits import MAX_SEATS
from tramnet_protocol.messages import ROOT
from tramnet_protocol.shapes import Edge
from tramnet_protocol.topology import Graph, Shape, links_of

MOST_NAMED = 8
"""TRAMs that an error names."""


def edge_list_shape(name: str, links: Iterable[Edge]) -> Shape:
    """Return the shape of a user's links.

    Args:
        name: What it is called.
        links: Pairs of seats, in any order.

    Raises:
        BadTopology: A link is no link, is there twice, is one too many for a TRAM, or a TRAM cannot reach the root.
    """
    edges = _checked(list(links))
    return Shape(name, lambda seats: _join(edges, seats), links=edges)


def _checked(links: Sequence[Edge]) -> tuple[Edge, ...]:
    seats = {ROOT} | {seat for link in links for seat in link}
    for seat in seats:
        if not 0 <= seat < MAX_SEATS:
            raise BadTopology(f"found TRAM {seat} in a link; expected 0 to {MAX_SEATS - 1}")
    graph = Graph.of(seats, links)
    if len(graph.edges) < len(links):
        doubled = next(link for i, link in enumerate(links) if set(link) in map(set, links[:i]))
        raise BadTopology(f"found the link {list(doubled)} twice; expected each link once")
    graph.check_links()
    lost = seats - graph.distances(ROOT).keys()
    if lost:
        named = ", ".join(map(str, islice(sorted(lost), MOST_NAMED)))
        raise BadTopology(f"found no way from the root to TRAM {named}; add a link to it")
    return graph.edges


def _join(edges: Sequence[Edge], seats: Sequence[int]) -> list[Edge]:
    """Return the links over live TRAMs, the attaching ones last."""
    there = frozenset(seats)
    graph = Graph.of(seats, (edge for edge in edges if there.issuperset(edge)))
    spare = {seat: links_of(seat) - len(graph.neighbours[seat]) for seat in seats}
    first, *others = _parts(graph)
    hosts = [seat for seat in first if spare[seat]]  # sorted, so a heap
    attached = []
    for part in others:
        own = next(seat for seat in part if spare[seat])
        while not spare[hosts[0]]:
            heapq.heappop(hosts)
        attached.append((hosts[0], own))
        spare[hosts[0]] -= 1
        spare[own] -= 1
        for seat in part:
            if spare[seat]:
                heapq.heappush(hosts, seat)
    return [*graph.edges, *attached]


def _parts(graph: Graph) -> list[list[int]]:
    """Return the TRAMs that reach each other, ascending; that of the root first, the others by their lowest."""
    parts: list[list[int]] = []
    found: set[int] = set()
    for seat in graph.seats:
        if seat not in found:
            parts.append(sorted(graph.distances(seat)))
            found.update(parts[-1])
    return parts
