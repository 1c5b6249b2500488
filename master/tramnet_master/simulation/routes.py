"""The ways between the root and each worker, as frames take them."""

from typing import NamedTuple, TypeAlias

from tramnet_protocol.messages import ROOT
from tramnet_protocol.topology import Graph

Route: TypeAlias = tuple[int, ...]
"""The TRAMs a message passes, both ends included."""


class RoundTrip(NamedTuple):
    """The ways between the root and a worker.

    Attributes:
        out: From the root to the worker.
        back: From the worker to the root; it may be another way of the same length.
    """

    out: Route
    back: Route


def round_trips(graph: Graph) -> dict[int, RoundTrip]:
    """Return the ways to and from every TRAM that the root can reach, all found in two searches."""
    before, onward = graph.predecessors(ROOT), graph.hops_towards(ROOT)
    return {seat: RoundTrip(_follow(before, seat)[::-1], _follow(onward, seat)) for seat in before}


def _follow(steps: dict[int, int], seat: int) -> Route:
    way = [seat]
    while way[-1] != ROOT:
        way.append(steps[way[-1]])
    return tuple(way)
