"""What a round would have taken on a machine of transputers: one function from a trace to books, in virtual time.

The root sends what it sent, in the order of virtual time and then of seats; workers compute one chunk after another
in the order of arrival, each slot in a stated time; links do what ``tramnet_protocol.links`` says. Who took which
chunk is the run's doing, not the model's. Breeding between two rounds is not in the books.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import groupby

from tramnet_master.simulation.agenda import Agenda
from tramnet_master.simulation.network import Network, Traffic, Way
from tramnet_master.traffic.trace import Shipment
from tramnet_protocol.links import LinkTiming
from tramnet_protocol.messages import Kind


@dataclass(frozen=True)
class Round:
    """The books of one round.

    Attributes:
        time: From the first message to the last answer [ns].
        computing: Compute time of all workers, added up [ns].
        traffic: What each directed link has carried.
    """

    time: int
    computing: int
    traffic: Mapping[Way, Traffic]


def book(shipments: Sequence[Shipment], timing: LinkTiming, costs: Mapping[Kind, int]) -> Round:
    """Book one round.

    Args:
        shipments: What passed, by seats; each seat's in the order of sending.
        timing: What a message costs on a link.
        costs: Time of a slot, by kind of work [ns].
    """
    return _Booking(shipments, timing, costs).run()


@dataclass(slots=True)
class _Seat:
    to_send: deque[Shipment]
    answers: int = 0
    busy: bool = False
    to_compute: deque[Shipment] = field(default_factory=deque)


class _Booking:
    def __init__(
        self, shipments: Sequence[Shipment], timing: LinkTiming, costs: Mapping[Kind, int]
    ) -> None:
        self._agenda = Agenda()
        self._network = Network(self._agenda, timing)
        self._costs = costs
        self._seats = {
            seat: _Seat(deque(own)) for seat, own in groupby(shipments, lambda one: one.seat)
        }
        self._ready: list[Shipment] = []  # to be sent now
        self._end = 0
        self._computing = 0

    def run(self) -> Round:
        for seat in self._seats.values():
            self._release(seat)
        self._agenda.run()
        return Round(self._end or self._agenda.now, self._computing, self._network.traffic)

    def _release(self, seat: _Seat) -> None:
        """Let a seat's shipments go that wait for no more answers."""
        while seat.to_send and seat.to_send[0].after <= seat.answers:
            if not self._ready:  # after all else that happens at this time
                self._agenda.after(0, self._send, self._ready)
            self._ready.append(seat.to_send.popleft())

    def _send(self, ready: list[Shipment]) -> None:
        self._ready = []
        for shipment in sorted(ready, key=lambda one: one.seat):
            arrived = partial(self._receive, shipment)
            self._network.send(shipment.ways.out, shipment.out_bytes, arrived)

    def _receive(self, shipment: Shipment) -> None:
        if not shipment.back_bytes:
            return  # its worker was lost, or somebody else's answer came first
        seat = self._seats[shipment.seat]
        seat.to_compute.append(shipment)
        if not seat.busy:
            self._begin(seat)

    def _begin(self, seat: _Seat) -> None:
        shipment = seat.to_compute.popleft()
        seat.busy = True
        time = shipment.size * self._costs[shipment.kind]
        self._computing += time
        self._agenda.after(time, self._finish, shipment)

    def _finish(self, shipment: Shipment) -> None:
        seat = self._seats[shipment.seat]
        seat.busy = False
        if seat.to_compute:
            self._begin(seat)
        self._network.send(shipment.ways.back, shipment.back_bytes, lambda: self._take(seat))

    def _take(self, seat: _Seat) -> None:
        self._end = self._agenda.now
        seat.answers += 1
        self._release(seat)
