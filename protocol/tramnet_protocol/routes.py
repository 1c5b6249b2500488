"""The routes of one node: where a frame goes next, by the wiring that the frame itself names.

An epoch selects routes, never validity. A node keeps several wirings, for a burst of joins and losses makes several
while one frame is on its way. A frame older than all of them goes by the oldest, and says so from then on: epochs
only grow along a way, and no wiring has loops, so no frame goes round for ever.
"""

from typing import NamedTuple

from tramnet_protocol.messages import Wiring
from tramnet_protocol.topology import graph_of

KEPT = 8
"""Wirings a node remembers; two would do if they changed one at a time."""


class Step(NamedTuple):
    """One step of a frame.

    Attributes:
        hop: The TRAM at the other end of the next link.
        epoch: The wiring it goes by.
    """

    hop: int
    epoch: int


class _Table(NamedTuple):
    wiring: Wiring
    hops: dict[int, int]  # destination -> next TRAM
    neighbours: frozenset[int]


class Routes:
    """The wirings a node knows.

    Args:
        seat: The node.
        wiring: The first wiring it knows; it need not be part of it.
    """

    def __init__(self, seat: int, wiring: Wiring) -> None:
        self._seat = seat
        self._wiring = wiring
        self._tables = {wiring.epoch: self._table(wiring)}  # by epoch, ascending

    @property
    def wiring(self) -> Wiring:
        """The newest wiring."""
        return self._wiring

    def adopt(self, wiring: Wiring) -> None:
        """Take in a newer wiring; one that is not newer changes nothing.

        Raises:
            BadTopology: A link of it joins a TRAM that is not live.
        """
        if wiring.epoch <= self._wiring.epoch:
            return
        kept = dict(list(self._tables.items())[1 - KEPT :])
        # Other threads read while this one writes, so the tables are replaced, never changed.
        self._tables = {**kept, wiring.epoch: self._table(wiring)}
        self._wiring = wiring

    def knows(self, epoch: int) -> bool:
        """Return whether a frame of that epoch can go on; if not, its wiring is on the way."""
        return epoch <= self._wiring.epoch

    def step(self, epoch: int, destination: int) -> Step | None:
        """Return where a frame goes next, or None where its next TRAM is gone.

        Args:
            epoch: The wiring the frame names, which is known.
            destination: Seat it is meant for.
        """
        own = next(known for known in self._tables if known >= epoch)
        table = self._tables[own]
        hop = table.hops.get(destination)
        if hop is None:
            return None
        lives = self._wiring.incarnations.get(hop)
        return Step(hop, own) if lives == table.wiring.incarnations[hop] else None

    def admits(self, hop: int, source: int) -> bool:
        """Return whether a frame of a TRAM may come on the link from another one, by any wiring known here.

        Only neighbours have links here, and a neighbour's own frames come on its own.

        Args:
            hop: The TRAM at the other end of the link.
            source: The TRAM that is said to have made the frame.
        """
        return any(
            hop in table.neighbours and (hop == source or source not in table.neighbours)
            for table in self._tables.values()
        )

    def _table(self, wiring: Wiring) -> _Table:
        graph = graph_of(wiring)
        if self._seat not in graph.neighbours:
            return _Table(wiring, {}, frozenset())
        neighbours = frozenset(graph.neighbours[self._seat])
        return _Table(wiring, graph.next_hops(self._seat), neighbours)
