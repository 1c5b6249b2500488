"""One submitted work, slot by slot: what waits, what was given, what is closed.

A slot (individual, population or point) is WAITING, GIVEN or CLOSED. Each waiting slot lies either in the
uncut tail of the batch or in one *piece* that was given before and came back; each given slot lies in one
*live* assignment. An answer closes the slots it brings, wherever they are: a piece that waits and a chunk that
another worker computes may lose slots, or all of them, without being told. They find out when the piece is cut
or the chunk answered. That is what makes late answers to chunks long since cut differently come out right.
"""

from collections import deque
from collections.abc import Iterable, Iterator

from msgspec import Struct

from tramnet_master.farm.events import Tram, WorkSubmitted
from tramnet_protocol.messages import WorkId

WAITING, GIVEN, CLOSED = range(3)


class Piece(Struct, frozen=True):
    """A range of slots that travels together, with its history.

    Attributes:
        first: First slot.
        last: Last slot, exclusive.
        failures: Deaths and overruns since it has its present size and standing.
        resends: How often its deadline has doubled.
        suspect: Whether it has failed alone and may go to fresh processes only.
        error: What happened to it last.
    """

    first: int
    last: int
    failures: int = 0
    resends: int = 0
    suspect: bool = False
    error: str = ""

    @property
    def size(self) -> int:
        """Number of slots."""
        return self.last - self.first


class Assignment(Struct, eq=False):
    """A piece given to a worker.

    Attributes:
        batch: Where the piece comes from.
        piece: The piece.
        work: Its identity on the wire.
        tram: The worker.
        sent: When it was sent [s].
        live: The slots are this worker's to compute: neither answered, nor lost, nor overdue.
        answered: Whether this worker has answered it; it can do so once.
        via: TRAMs that it or its answer may pass, by any wiring since it was sent last.
        epoch: Number of wirings there had been when it was sent last.
    """

    batch: "Batch"
    piece: Piece
    work: WorkId
    tram: Tram
    sent: float
    live: bool = True
    answered: bool = False
    via: frozenset[Tram] = frozenset()
    epoch: int = 0

    @property
    def cost(self) -> int:
        """What it takes to compute, in slots of one generation."""
        return self.piece.size * self.batch.generations

    @property
    def bytes(self) -> int:
        """Size on the wire [byte]."""
        return self.batch.bytes_each * self.piece.size

    def answer(self) -> bool:
        """Count it as answered; whether it was live until now."""
        self.answered = True
        return self.recall()

    def recall(self) -> bool:
        """Take it from the worker; whether it was live until now."""
        was_live, self.live = self.live, False
        return was_live

    def spoilt(self, bad: tuple[int, ...]) -> tuple[int, ...]:
        """Slots not to be accepted: the bad ones, or all where they stand and fall together."""
        if bad and not self.batch.divisible:
            return tuple(range(self.piece.first, self.piece.last))
        return bad


class Batch:
    """The slots of a submitted work.

    Attributes:
        work: Its identity.
        bytes_each: Size of a slot on the wire [byte].
        divisible: Whether it may be cut.
        affinity: The TRAM it must go to, or None.
        generations: How many of them each slot takes to compute.
        parked: Whether it waits for the engine to submit it again.
        queued: Whether the scheduler has it in a queue of batches to cut.
        open: Number of slots not closed.
        chunks: Identities under which parts of it were given.
    """

    def __init__(self, submitted: WorkSubmitted) -> None:
        self.work = submitted.work
        self.bytes_each = submitted.bytes_each
        self.divisible = submitted.divisible
        self.affinity = submitted.affinity
        self.generations = submitted.generations
        self.parked = False
        self.queued = False
        self.open = self.work.size
        self.chunks: list[WorkId] = []
        self.slots = bytearray(self.work.size)  # state of slot first + i
        self.uncut = self.work.first  # all slots from here on are WAITING
        self.returned: deque[Piece] = deque()  # pieces that came back; suspects only while parked

    @property
    def least_bytes(self) -> int:
        """Size of the smallest chunk it can be cut into [byte]."""
        return self.bytes_each if self.divisible else self.bytes_each * self.work.size

    @property
    def exhausted(self) -> bool:
        """Whether nothing is left to cut."""
        return self.uncut == self.work.last and not self.returned

    def part(self, first: int, last: int) -> WorkId:
        """Identity of a range of its slots."""
        work = self.work
        if first == work.first and last == work.last:
            return work
        return WorkId(work.kind, work.population, work.step, first, last)

    def is_atomic(self, piece: Piece) -> bool:
        """Whether a piece cannot be cut further."""
        return not self.divisible or piece.size == 1

    def cut(self, size: int) -> Piece | None:
        """Take the next piece to give away: one that came back, else ``size`` slots of the tail."""
        while self.returned:
            waiting = self.trim(self.returned.popleft())
            if waiting:
                self.returned.extendleft(reversed(waiting[1:]))
                return waiting[0]
        if self.uncut == self.work.last:
            return None
        first = self.uncut
        self.uncut = min(first + size, self.work.last) if self.divisible else self.work.last
        return Piece(first, self.uncut)

    def take_suspects(self) -> list[Piece]:
        """Take away the suspects among the pieces that came back."""
        if not self.returned:
            return []
        suspects = [piece for piece in self.returned if piece.suspect]
        if suspects:
            self.returned = deque(piece for piece in self.returned if not piece.suspect)
        return suspects

    def give(self, piece: Piece) -> None:
        """Mark the slots of a piece as given."""
        self._mark(piece.first, piece.last, GIVEN)

    def trim(self, piece: Piece) -> list[Piece]:
        """What is left of a piece after some of its slots were closed."""
        i, j = piece.first - self.work.first, piece.last - self.work.first
        if self.slots.find(CLOSED, i, j) < 0:
            return [piece]
        left = (slot for slot in range(piece.first, piece.last) if not self._is_closed(slot))
        return [
            Piece(first, last, piece.failures, piece.resends, piece.suspect, piece.error)
            for first, last in runs(left)
        ]

    def take_back(self, piece: Piece) -> list[Piece]:
        """Let what is still open of a given piece wait again."""
        waiting = self.trim(piece)
        for part in waiting:
            self._mark(part.first, part.last, WAITING)
        return waiting

    def close(self, piece: Piece, bad: tuple[int, ...] = ()) -> list[WorkId]:
        """Close the slots of a piece that are neither closed nor bad.

        Returns:
            The parts that were closed by this.
        """
        i, j = piece.first - self.work.first, piece.last - self.work.first
        if not bad and self.slots.find(CLOSED, i, j) < 0:
            return [self._close(piece.first, piece.last)]
        slots = set(range(piece.first, piece.last)).difference(bad)
        ranges = list(runs(slot for slot in sorted(slots) if not self._is_closed(slot)))
        return [self._close(first, last) for first, last in ranges]

    def _close(self, first: int, last: int) -> WorkId:
        self._mark(first, last, CLOSED)
        self.open -= last - first
        return self.part(first, last)

    def _is_closed(self, slot: int) -> bool:
        return self.slots[slot - self.work.first] == CLOSED

    def _mark(self, first: int, last: int, state: int) -> None:
        self.slots[first - self.work.first : last - self.work.first] = bytes((state,)) * (
            last - first
        )


def runs(slots: Iterable[int]) -> Iterator[tuple[int, int]]:
    """Maximal ranges (first, last exclusive) of ascending slots."""
    first = last = None
    for slot in slots:
        if slot != last:
            if first is not None and last is not None:
                yield first, last
            first = slot
        last = slot + 1
    if first is not None and last is not None:
        yield first, last
