"""One link with both its ways, and the messages that meet on it.

A pure state machine: it is told when a message is offered and says when one has gone. Nothing here knows an event
loop or a clock; whoever owns a link calls ``advance`` at ``next_time``, or before an offer.

Each way is first come first served and never interrupted. A message is set up, then its bytes move, each taking
``byte_alone``, or ``byte_opposed`` while the other way's move too: a fluid model, exact for messages that begin
together and to the next whole nanosecond for others. Work is counted in units, ``byte_alone * byte_opposed`` to a
byte, so that both rates are whole numbers of units.
"""

from collections import deque
from typing import Generic, NamedTuple, TypeVar

from tramnet_protocol.links import LinkTiming

Item = TypeVar("Item")

NEVER = 2**63
"""Later than any time."""


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
        left: What was left of it when things changed last [unit].
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

    Attributes:
        next_time: When ``advance`` is to be called next [ns], or ``NEVER``.
    """

    def __init__(self, timing: LinkTiming) -> None:
        self.next_time = NEVER
        self._alone = timing.byte_opposed  # units a nanosecond of a way that moves alone
        self._opposed = timing.byte_alone  # the same of one that does not
        self._unit = self._alone * self._opposed  # units a byte
        self._set_up = timing.set_up
        self._since = 0  # when things changed last: between changes, all rates are constant
        self._changes = 0  # the way that changes at next_time
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
        assert self._since <= now < self.next_time, "time does not go back, nor past what has gone"
        message = _Message(item, size, now)
        if self._current[way] is not None:
            self._waiting[way].append(message)
            return
        self._move(now)
        self._begin(way, message)
        self._plan()

    def advance(self, now: int) -> list[Gone[Item]]:
        """Return the messages that have gone since the last call, up to ``now`` [ns], in that order."""
        gone: list[Gone[Item]] = []
        while self.next_time <= now:
            self._move(self.next_time)
            message = self._current[self._changes]
            assert message is not None, "only a message changes anything"
            if not message.left:
                gone.append(self._end(self._changes, message))
            self._plan()
        return gone

    def _begin(self, way: int, message: _Message[Item]) -> None:
        message.began = self._since
        message.moves = self._since + self._set_up
        message.left = message.size * self._unit
        self._current[way] = message

    def _end(self, way: int, message: _Message[Item]) -> Gone[Item]:
        self._current[way] = None
        if self._waiting[way]:
            self._begin(way, self._waiting[way].popleft())
        return Gone(way, message.item, message.size, message.offered, message.began, self._since)

    def _plan(self) -> None:
        """Find the next change: a message that meets another begins to move, or one has gone."""
        one, other = self._current
        if one is None or other is None:
            self.next_time = NEVER
            for way, message in ((0, one), (1, other)):
                if message is not None:  # alone, it moves evenly from its first byte on
                    start = max(message.moves, self._since)
                    self.next_time = start - -message.left // self._alone
                    self._changes = way
            return
        times = [self._change_of(one, other), self._change_of(other, one)]
        self.next_time = min(times)
        self._changes = times.index(self.next_time)

    def _change_of(self, message: _Message[Item], other: _Message[Item]) -> int:
        if message.moves > self._since:
            return message.moves
        rate = self._opposed if other.moves <= self._since else self._alone
        return self._since - -message.left // rate

    def _move(self, now: int) -> None:
        """Let the time pass in which nothing changes."""
        one, other = self._current
        if one is not None and other is not None:
            moving = [message for message in (one, other) if message.moves <= self._since]
            rate = self._opposed if len(moving) == 2 else self._alone
            for message in moving:
                message.left = max(0, message.left - (now - self._since) * rate)
        else:
            message_alone = one or other
            if message_alone is not None:
                passed = now - max(message_alone.moves, self._since)
                if passed > 0:
                    message_alone.left = max(0, message_alone.left - passed * self._alone)
        self._since = now
