"""The trace of a run: each chunk's way out and its answer's, in modelled bytes, a round at a time.

A *round* is what passes from the moment work is open until none is: a generation, or a step of a tracking job.
What a worker was sent first in a round it was sent at once; everything else it was sent because it had answered,
and that is all the trace keeps of the order of things. So it holds for any machine, however fast it is.
"""

from operator import itemgetter
from typing import NamedTuple

from tramnet_master.farm.events import Tram
from tramnet_master.simulation.routes import RoundTrip
from tramnet_protocol.messages import Kind, Outcome, PopulationSnapshot, Work, WorkId
from tramnet_protocol.modelled import modelled_bytes


class Shipment(NamedTuple):
    """A chunk on its way out, and its answer on its way back.

    Attributes:
        seat: The worker.
        kind: Kind of work.
        size: Slots of the chunk.
        ways: The ways of both.
        out_bytes: Modelled length of the chunk's message [B].
        back_bytes: That of the answer, 0 where none came [B].
        after: How many of its earlier chunks of this round the worker had answered when this was sent.
    """

    seat: int
    kind: Kind
    size: int
    ways: RoundTrip
    out_bytes: int
    back_bytes: int
    after: int


_seat = itemgetter(0)


class Stated(NamedTuple):
    """What a worker said that a chunk took to compute; the larger the chunk, the less there is in it of all else.

    Attributes:
        slots: Size of the chunk.
        seconds: Compute time [s].
    """

    slots: int
    seconds: float

    def or_better(self, other: "Stated | None") -> "Stated":
        """Return which of the two tells more of a slot's cost: the larger one, or else the quicker."""
        if other is None or (self.slots, -self.seconds) > (other.slots, -other.seconds):
            return self
        return other


class Trace:
    """What has passed in one round.

    Attributes:
        stated: Compute time that workers stated for the largest chunk of each kind of work, and its slots.
    """

    def __init__(self) -> None:
        self.stated: dict[Kind, Stated] = {}
        self._sent: list[tuple[int, Kind, int, RoundTrip, int, int]] = []  # all but back_bytes
        self._back: list[int] = []  # back_bytes of each
        self._unanswered: dict[tuple[Tram, WorkId], int] = {}  # index in the list
        self._answers: dict[int, int] = {}  # number by seat

    def __len__(self) -> int:
        return len(self._sent)

    def sent(self, tram: Tram, work: Work, ways: RoundTrip) -> None:
        """Note a chunk that was sent."""
        identity = work.work
        self._unanswered[tram, identity] = len(self._sent)
        after = self._answers.get(tram.seat, 0)
        size = identity.last - identity.first
        self._sent.append((tram.seat, identity.kind, size, ways, modelled_bytes(work), after))
        self._back.append(0)

    def answered(self, tram: Tram, outcome: Outcome, snapshot: PopulationSnapshot | None) -> None:
        """Note an answer, with the snapshot that came with it; one to nothing sent in this round is left out."""
        index = self._unanswered.pop((tram, outcome.work), None)
        if index is None:
            return
        self._back[index] = modelled_bytes(outcome)
        if snapshot is not None:
            self._back[index] += modelled_bytes(snapshot)
        self._answers[tram.seat] = self._answers.get(tram.seat, 0) + 1
        stated = Stated(outcome.work.size, outcome.seconds)
        kind = outcome.work.kind
        self.stated[kind] = stated.or_better(self.stated.get(kind))

    def round(self) -> tuple[Shipment, ...]:
        """Return what has passed, by seats, each seat's shipments in the order of sending."""
        found = [
            Shipment(seat, kind, size, ways, out, back, after)
            for (seat, kind, size, ways, out, after), back in zip(
                self._sent, self._back, strict=True
            )
        ]
        return tuple(sorted(found, key=_seat))
