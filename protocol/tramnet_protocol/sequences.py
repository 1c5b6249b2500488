"""Sequence numbers of directed links: the sender counts, the receiver finds what is missing.

Each sender numbers the frames of each of its links 0, 1, 2, ... and begins again when the link opens anew, which is
when either end has another incarnation. The order on one key is kept, so a number that jumps means lost frames.
"""

import enum
from typing import NamedTuple


class Order(enum.Enum):
    """How a sequence number fits those before it."""

    IN_ORDER = "in order"
    GAP = "gap"
    REOPENED = "re-opened"
    REPEATED = "repeated"


class Arrival(NamedTuple):
    """What a sequence number tells.

    Attributes:
        order: How it fits.
        missed: Number of frames lost before it.
    """

    order: Order
    missed: int


_NEXT = Arrival(Order.IN_ORDER, 0)


class SequenceCounter:
    """Numbers the frames of the links on which this node sends."""

    def __init__(self) -> None:
        self._next: dict[int, int] = {}  # destination -> number of the next frame

    def take(self, destination: int) -> int:
        """Return the number of the next frame on the link to a TRAM."""
        number = self._next.get(destination, 0)
        self._next[destination] = number + 1
        return number

    def reopen(self, destination: int) -> None:
        """Begin again at 0 on the link to a TRAM, which has another incarnation."""
        self._next.pop(destination, None)


class SequenceChecker:
    """Watches the numbers that arrive on one directed link.

    Args:
        from_start: Whether the first frame seen should be the link's first. An observer that comes later takes
            whatever number it sees first.

    Attributes:
        missed: Frames lost so far.
        reopened: Times the link began again.
        repeated: Frames that came twice or late.
    """

    def __init__(self, from_start: bool = True) -> None:
        self._from_start = from_start
        self._opening: tuple[int, int] | None = None
        self._expected: int | None = 0 if from_start else None
        self.missed = 0
        self.reopened = 0
        self.repeated = 0

    def arrived(self, sequence: int, opening: tuple[int, int] = (0, 0)) -> Arrival:
        """Compare a frame's number with those before it.

        Args:
            sequence: The number.
            opening: Incarnations at both ends of the link; where they are unknown, a 0 out of turn tells as well.
        """
        if sequence == self._expected and opening == self._opening:
            self._expected = sequence + 1
            return _NEXT
        if self._opening is None:
            self._opening = opening
        if opening != self._opening or (sequence == 0 and self._expected):
            return self._reopen(sequence, opening)
        expected = sequence if self._expected is None else self._expected
        if sequence < expected:
            self.repeated += 1
            return Arrival(Order.REPEATED, 0)
        return self._count(sequence, expected, Order.IN_ORDER)

    def _reopen(self, sequence: int, opening: tuple[int, int]) -> Arrival:
        self._opening = opening
        self.reopened += 1
        expected = 0 if self._from_start else sequence
        return self._count(sequence, expected, Order.REOPENED)

    def _count(self, sequence: int, expected: int, order: Order) -> Arrival:
        missed = sequence - expected
        self.missed += missed
        self._expected = sequence + 1
        return Arrival(Order.GAP if missed and order is Order.IN_ORDER else order, missed)
