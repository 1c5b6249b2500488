"""What waits between the transport's threads and a tool that works on it: bounded, with the time of arrival."""

import queue
import time
from collections.abc import Callable
from typing import NamedTuple

from tramnet_protocol.credit import ReceiveCredit

ROOM = 64 * 1024 * 1024
"""Bytes that may wait; what comes beyond is dropped and counted [B]."""

_EVERYTHING = "everything"


class Arrival(NamedTuple):
    """Something that arrived.

    Attributes:
        key: Where it was said.
        payload: What was said.
        time: When [ns since 1970].
    """

    key: str
    payload: bytes
    time: int


class Intake:
    """A bounded queue of arrivals.

    Args:
        room: Bytes that may wait [B].
        clock: Time [ns since 1970].
    """

    def __init__(self, room: int = ROOM, clock: Callable[[], int] = time.time_ns) -> None:
        self._queue: queue.SimpleQueue[Arrival] = queue.SimpleQueue()
        self._credit = ReceiveCredit(room)
        self._clock = clock

    @property
    def dropped(self) -> int:
        """Arrivals for which there was no room."""
        return self._credit.dropped.get(_EVERYTHING, 0)

    @property
    def empty(self) -> bool:
        """Whether nothing waits."""
        return self._queue.empty()

    def put(self, key: str, payload: bytes) -> None:
        """Take in what a transport delivers; never waits."""
        if self._credit.admit(_EVERYTHING, len(payload)):
            self._queue.put(Arrival(key, payload, self._clock()))

    def get(self, timeout: float) -> Arrival | None:
        """Take the next arrival out, or None if there is none in time.

        Args:
            timeout: Longest wait [s]; at most 0 takes only what is there.
        """
        try:
            arrival = self._queue.get(timeout > 0, max(0.0, timeout))
        except queue.Empty:
            return None
        self._credit.release(_EVERYTHING, len(arrival.payload))
        return arrival
