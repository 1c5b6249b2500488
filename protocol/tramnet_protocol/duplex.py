"""One link with both its ways, and the messages that meet on it.

A pure state machine: it is told when a message is offered and says when one has gone. Nothing here knows an event
loop or a clock; whoever owns a link calls ``advance`` when the time that ``next_time`` gave has come, or before an
offer.

Each way is first come first served and never interrupted. A message is set up, then its bytes move, each taking
``byte_alone``, or ``byte_opposed`` while the other way's move too: a fluid model, exact for messages that begin
together and to the next whole nanosecond for others. Work is counted in units, ``byte_alone * byte_opposed`` to a
byte, so that both rates are whole numbers of units.
"""

from collections import deque
from typing import Generic, NamedTuple, TypeVar

from tramnet_protocol.links import LinkTiming

Item = TypeVar("Item")

_NEVER = 2**63


class Gone(NamedTuple, Generic[Item]):
    """A message whose last byte has been acknowledged.

    Attributes:
        way: On which way, 0 or 1.
        item: What was offered.
        size: Its length [B].
        offered: When it was offered [ns].
        began: When its set-up began [ns].
        ended: When its way became free again; the receiver runs ``wake_up`` later [ns].
    """

    way: int
    item: Item
    size: int
    offered: int
    began: int
    ended: int


class _Message(Generic[Item]):
    """A message on its way or in wait for it.

    Attributes:
        moves: When its first byte moves [ns].
        left: What is left of it [unit].
    """

    __slots__ = ("began", "item", "left", "moves", "offered", "size")

    def __init__(self, item: Item, size: int, offered: int) -> None:
        self.item = item
        self.size = size
        self.offered = offered
        self.began = 0
        self.moves = 0
        self.left = 0


class DuplexLink(Generic[Item]):
    """Both ways of a link.

    Args:
        timing: What a message costs.
    """

    def __init__(self, timing: LinkTiming) -> None:
        self._timing = timing
        self._unit = timing.byte_alone * timing.byte_opposed  # [unit/B]
        self._now = 0
        self._current: list[_Message[Item] | None] = [None, None]
        self._waiting: tuple[deque[_Message[Item]], deque[_Message[Item]]] = (deque(), deque())

    def offer(self, way: int, item: Item, size: int, now: int) -> None:
        """Put a message behind those of its way; what has gone by now must have been taken by ``advance``.

        Args:
            way: 0 or 1.
            item: Whatever names the message.
            size: Its length [B]; at least 1.
            now: Time [ns]; never earlier than in any call before.
        """
        self._move(now)
        message = _Message(item, size, now)
        if self._current[way] is None:
            self._begin(way, message)
        else:
            self._waiting[way].append(message)

    def next_time(self) -> int | None:
        """Return a time before which no message will have gone [ns], or None while there is none."""
        earliest = _NEVER
        for way in (0, 1):
            message = self._current[way]
            if message is None:
                continue
            if message.moves > self._now:
                time = message.moves + message.size * self._timing.byte_alone
            else:
                time = self._end_of(message, way)
            earliest = min(earliest, time)
        return earliest if earliest < _NEVER else None

    def advance(self, now: int) -> list[Gone[Item]]:
        """Return the messages that have gone since the last call, up to ``now`` [ns], in that order."""
        gone: list[Gone[Item]] = []
        while True:
            time, way = self._next_change()
            if time > now:
                break
            self._move(time)
            message = self._current[way]
            assert message is not None
            if message.left:  # its first byte moves now
                continue
            ended = Gone(way, message.item, message.size, message.offered, message.began, time)
            gone.append(ended)
            self._current[way] = None
            if self._waiting[way]:
                self._begin(way, self._waiting[way].popleft())
        self._move(now)
        return gone

    def _begin(self, way: int, message: _Message[Item]) -> None:
        message.began = self._now
        message.moves = self._now + self._timing.set_up
        message.left = message.size * self._unit
        self._current[way] = message

    def _next_change(self) -> tuple[int, int]:
        """When and where the next message begins to move or has gone."""
        found, where = _NEVER, 0
        for way in (0, 1):
            message = self._current[way]
            if message is not None:
                moving = message.moves <= self._now
                time = self._end_of(message, way) if moving else message.moves
                if time < found:
                    found, where = time, way
        return found, where

    def _end_of(self, message: _Message[Item], way: int) -> int:
        """When a moving message will have gone if nothing changes on the other way."""
        return self._now - -message.left // self._rate(way)

    def _rate(self, way: int) -> int:
        """Units a nanosecond on a way that moves."""
        other = self._current[1 - way]
        opposed = other is not None and other.moves <= self._now
        return self._timing.byte_alone if opposed else self._timing.byte_opposed

    def _move(self, now: int) -> None:
        """Let the time pass in which nothing changes."""
        passed = now - self._now
        assert passed >= 0, "time does not go back"
        if not passed:
            return
        done = [
            passed * self._rate(way) if message is not None and message.moves <= self._now else 0
            for way, message in enumerate(self._current)
        ]
        for message, units in zip(self._current, done, strict=True):
            if message is not None and units:
                message.left = max(0, message.left - units)
        self._now = now
