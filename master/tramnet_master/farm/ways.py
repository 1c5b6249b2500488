"""Which TRAMs the frames between the root and each worker pass, by a wiring."""

from collections.abc import Iterator, Mapping

from tramnet_master.farm.events import Tram
from tramnet_protocol.messages import ROOT, Wiring
from tramnet_protocol.topology import graph_of


def ways(wiring: Wiring) -> dict[Tram, tuple[Tram, ...]]:
    """Return the TRAMs on the way from the root to each worker and back, those nearest the root first.

    Both ways are shortest but not always the same; who is linked with the root is left out.
    """
    graph = graph_of(wiring)
    hops = graph.distances(ROOT)
    there, back = graph.predecessors(ROOT), graph.hops_towards(ROOT)

    def tram(seat: int) -> Tram:
        return Tram(seat, wiring.incarnations[seat])

    return {
        tram(seat): tuple(
            tram(passed)
            for passed in sorted(
                {*_walk(there, seat), *_walk(back, seat)}, key=lambda one: (hops[one], one)
            )
        )
        for seat in there
        if hops[seat] > 1
    }


def _walk(steps: Mapping[int, int], seat: int) -> Iterator[int]:
    """Yield the TRAMs between a worker and the root."""
    while (seat := steps[seat]) != ROOT:
        yield seat
