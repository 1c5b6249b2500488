"""The routes of one node: where a frame goes next, by the wiring that the frame itself names.

An epoch selects routes, never validity. A node keeps several wirings, for a burst of joins and losses makes several
while one frame is on its way. A frame older than all of them goes by the oldest, and says so from then on: epochs
only grow along a way, and no wiring has loops, so no frame goes round for ever.
"""

from functools import cached_property
from typing import NamedTuple

from tramnet_protocol.messages import Wiring
from tramnet_protocol.topology import check_wiring, graph_of

KEPT = 16
"""Wirings a node remembers; two would do if they changed one at a time.

A frame can meet a node that has forgotten its wiring only when at least so many have come since; whoever looks for
what a lost TRAM took along has to reckon with any way then.
"""


class Step(NamedTuple):
    """One step of a frame.

    Attributes:
        hop: The TRAM at the other end of the next link.
        epoch: The wiring it goes by.
    """

    hop: int
    epoch: int


class _Table:
    """The next TRAMs by one wiring, looked for when the first frame goes by it: most wirings see none at a node."""

    def __init__(self, seat: int, wiring: Wiring) -> None:
        self.wiring = wiring
        self._seat = seat

    @cached_property
    def hops(self) -> dict[int, int]:
        """The next TRAM on the way to each destination."""
        graph = graph_of(self.wiring)
        return graph.next_hops(self._seat) if self._seat in graph.neighbours else {}

    @cached_property
    def neighbours(self) -> frozenset[int]:
        """The TRAMs at the other ends of the links of this one."""
        return frozenset(graph_of(self.wiring).neighbours.get(self._seat, ()))


class Routes:
    """The wirings a node knows.

    Args:
        seat: The node.
        wiring: The first wiring it knows; it need not be part of it.

    Raises:
        BadTopology: A link of it joins a TRAM that is not live.
    """

    def __init__(self, seat: int, wiring: Wiring) -> None:
        self._seat = seat
        check_wiring(wiring)
        self._wiring = wiring
        self._tables = {wiring.epoch: _Table(seat, wiring)}  # by epoch, ascending

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
        check_wiring(wiring)
        kept = dict(list(self._tables.items())[1 - KEPT :])
        # Other threads read while this one writes, so the tables are replaced, never changed.
        self._tables = {**kept, wiring.epoch: _Table(self._seat, wiring)}
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
        tables = self._tables
        own = epoch if epoch in tables else next(known for known in tables if known >= epoch)
        table = tables[own]
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
