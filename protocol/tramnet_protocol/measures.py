"""What a shape costs: links, degree, diameter and mean hops of its graph.

Means are over ordered pairs of different TRAMs, as in the tables of the transputer's time.
"""

from typing import NamedTuple

from tramnet_protocol.messages import ROOT
from tramnet_protocol.topology import Graph


class Measures(NamedTuple):
    """Measures of a connected graph.

    Attributes:
        trams: Number of TRAMs, the root included.
        links: Number of links.
        degree: Most links at one TRAM.
        diameter: Most hops between two TRAMs.
        mean_from_root: Mean hops from the root; 0 where it is alone.
        mean: Mean hops over all pairs; 0 where there is none.
    """

    trams: int
    links: int
    degree: int
    diameter: int
    mean_from_root: float
    mean: float


def measure(graph: Graph) -> Measures:
    """Return the measures of a connected graph that has the root."""
    n = len(graph.seats)
    hops = graph.distances(ROOT)
    assert len(hops) == n, "the graph is not connected"
    farther = _pairs_farther_than(graph)
    return Measures(
        n,
        len(graph.edges),
        max(map(len, graph.neighbours.values())),
        len(farther),
        sum(hops.values()) / max(1, n - 1),
        sum(farther) / max(1, n * (n - 1)),
    )


def _pairs_farther_than(graph: Graph) -> list[int]:
    """Return the number of ordered pairs more than 0, 1, 2, ... hops apart, up to the last that is not 0.

    All TRAMs search at once; the sets of those they have reached are the bits of integers.
    """
    n = len(graph.seats)
    place = {seat: i for i, seat in enumerate(graph.seats)}
    near = [[place[other] for other in graph.neighbours[seat]] for seat in graph.seats]
    reached = [1 << i for i in range(n)]
    farther = []
    while left := n * n - sum(mask.bit_count() for mask in reached):
        farther.append(left)
        reached = [_union(reached, i, others) for i, others in enumerate(near)]
    return farther


def _union(masks: list[int], own: int, others: list[int]) -> int:
    mask = masks[own]
    for other in others:
        mask |= masks[other]
    return mask
