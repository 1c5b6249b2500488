"""Lets frames take as long on a link as they would on a transputer's: for demonstration, in real time.

The wait is that of the link, not of whoever sends: like a transputer's link engine, ``Pacer`` takes a frame at once
and delivers it when its last byte would have arrived, so that neither the farm nor a computing worker nor a router
ever sleeps. Frames of one directed link follow each other; links do not know of each other. Times come from when a
link was free last, not from when this process was awake, so that a late wake-up slows nothing down for good.

Counted are the bytes of the frame itself. What goes the other way on the same link is not known here, so every byte
takes the time of one that moves alone.
"""

import heapq
import threading
import time
from types import TracebackType
from typing import NamedTuple, Self

from tramnet_protocol.channel import Lane, Publisher
from tramnet_protocol.errors import ChannelClosed
from tramnet_protocol.links import LinkTiming

_NANOSECOND = 1e-9


class Departures:
    """When frames arrive at the other end of their links: pure bookkeeping.

    Args:
        timing: What a frame costs.
    """

    def __init__(self, timing: LinkTiming) -> None:
        self._timing = timing
        self._free: dict[str, int] = {}  # link -> when it has carried all that it was given [ns]

    def arrival(self, link: str, size: int, now: int) -> int:
        """Return when a frame that is given to a link now will have arrived.

        Args:
            link: The directed link.
            size: Length of the frame [B].
            now: Time [ns].
        """
        free = max(now, self._free.get(link, 0)) + self._timing.occupied(size)
        self._free[link] = free
        return free + self._timing.wake_up


class _Frame(NamedTuple):
    """A frame on its way; the earliest is delivered first, of equals the first that was sent."""

    arrival: int
    number: int
    key: str
    payload: bytes


class Pacer:
    """Publishes frames through a channel, each when a transputer's link would have delivered it.

    Args:
        channel: Where they are published; it is not closed here.
        timing: What a frame costs on a link.
    """

    def __init__(self, channel: Publisher, timing: LinkTiming) -> None:
        self._channel = channel
        self._departures = Departures(timing)
        self._frames: list[_Frame] = []  # heap
        self._number = 0
        self._closed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._deliver, name="pacer", daemon=True)
        self._thread.start()

    def publish(self, key: str, payload: bytes, lane: Lane) -> None:
        """Take a frame for a link; it is published when it would have arrived, and the caller goes on at once.

        Raises:
            ChannelClosed: The pacer was closed.
        """
        assert lane is Lane.LINK, "only links have a pace"
        with self._changed:
            if self._closed:
                raise ChannelClosed("publish")
            arrival = self._departures.arrival(key, len(payload), time.monotonic_ns())
            self._number += 1
            heapq.heappush(self._frames, _Frame(arrival, self._number, key, payload))
            self._changed.notify()

    def close(self) -> None:
        """Deliver at once what is still on its way, and end; a second call does nothing."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _deliver(self) -> None:
        while (frame := self._next()) is not None:
            try:
                self._channel.publish(frame.key, frame.payload, Lane.LINK)
            except ChannelClosed:  # nobody is there any more to be told
                return

    def _next(self) -> _Frame | None:
        """Wait for the next frame to arrive; return None when all have and nothing more will come."""
        with self._changed:
            while True:
                left = self._frames[0].arrival - time.monotonic_ns() if self._frames else 0
                if self._frames and (left <= 0 or self._closed):
                    return heapq.heappop(self._frames)
                if self._closed:
                    return None
                self._changed.wait(left * _NANOSECOND if self._frames else None)
