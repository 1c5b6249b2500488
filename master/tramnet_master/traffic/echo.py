"""Which frames ``tramnet echo`` shows, and what it says of each."""

from collections.abc import Set
from dataclasses import dataclass
from typing import Any

from tramnet_master.traffic.words import ArrayWords, describe
from tramnet_protocol.codec import Frame
from tramnet_protocol.errors import UnknownKey
from tramnet_protocol.keys import PREFIX, Topic, parse
from tramnet_protocol.sequences import SequenceChecker


def full_pattern(network: str, key: str) -> str:
    """Return the key pattern that a user means by a short one, such as ``link/**``."""
    return key if key.startswith(f"{PREFIX}/") else f"{PREFIX}/{network}/{key.strip('/')}"


@dataclass(frozen=True)
class Wanted:
    """The frames to show.

    Attributes:
        tags: Tags of their messages, or none for all; what is no frame has no tag and is shown only then.
        trams: TRAMs that made them, are meant by them or stand in their key, or none for all.
    """

    tags: Set[str] = frozenset()
    trams: Set[int] = frozenset()

    def covers(self, frame: Frame | None, seats: tuple[int, ...]) -> bool:
        """Return whether to show a frame, or what is none, that came on a key with these seats."""
        if frame is None:
            return not self.tags and (not self.trams or not self.trams.isdisjoint(seats))
        ends = {frame.header.source, frame.header.destination, *seats}
        return (not self.tags or frame.header.tag in self.tags) and (
            not self.trams or not self.trams.isdisjoint(ends)
        )


class Echo:
    """Turns payloads into plain values, and counts what this observer has missed.

    Args:
        wanted: What to show.
        run: Number of the run; frames of others are marked ``foreign``. None marks nothing.
        arrays: What to say of an array.

    Attributes:
        missed: Frames that links carried and this observer did not see.
    """

    def __init__(self, wanted: Wanted, run: int | None, arrays: ArrayWords) -> None:
        self.missed = 0
        self._wanted = wanted
        self._run = run
        self._arrays = arrays
        self._checkers: dict[str, SequenceChecker] = {}

    def describe(self, key: str, payload: bytes) -> dict[str, Any] | None:
        """Return a frame as plain values, or None if it is not wanted; what is no frame is described as such."""
        frame, values = describe(key, payload, self._arrays)
        try:
            topic, seats = parse(key)[1:]
        except UnknownKey:
            topic, seats = None, ()
        if frame is not None:
            if topic is Topic.LINK:
                checker = self._checkers.setdefault(key, SequenceChecker(from_start=False))
                self.missed += checker.arrived(frame.header.sequence).missed
            if self._run is not None and frame.header.run != self._run:
                values["foreign"] = True
        return values if self._wanted.covers(frame, seats) else None
