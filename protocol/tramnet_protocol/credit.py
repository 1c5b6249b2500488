"""Credit of the links: how much may wait at a receiver, so that no sender can fill its memory.

A transport's ``deliver`` asks ``admit`` before it enqueues, and the node calls ``release`` when it has taken a
message out. A sender within its credit of unacknowledged bytes never meets the bound.
"""

import threading
from collections import Counter
from collections.abc import Mapping

from tramnet_protocol.limits import CREDIT_BYTES

MESSAGE_COST = 64
"""What a waiting message counts beside its bytes [B], so that empty ones are bounded too."""

RECEIVE_BYTES = 4 * CREDIT_BYTES
"""What may wait from one source by default [B]: its credit, in messages however small."""


class ReceiveCredit:
    """Counts what waits at a receiver, by source.

    Args:
        limit: Bytes that may wait from one source [B]; one message may be larger when none waits.

    Attributes:
        limit: As above; it may change.
    """

    def __init__(self, limit: int = RECEIVE_BYTES) -> None:
        self.limit = limit
        self._lock = threading.Lock()
        self._waiting: dict[str, int] = {}  # source -> bytes that wait, never 0
        self._messages: Counter[str] = Counter()  # source -> messages that wait
        self._dropped: dict[str, int] = {}  # source -> messages refused

    @property
    def dropped(self) -> Mapping[str, int]:
        """Messages refused so far, by source."""
        with self._lock:
            return dict(self._dropped)

    @property
    def waiting(self) -> Mapping[str, int]:
        """Messages that wait now, by source."""
        with self._lock:
            return {source: n for source, n in self._messages.items() if n}

    def admit(self, source: str, size: int) -> bool:
        """Count a message that arrived and return whether it may wait; one that may not is counted as dropped.

        Args:
            source: Whose credit it uses: the key of its link.
            size: Length of its payload [B].
        """
        cost = size + MESSAGE_COST
        with self._lock:
            waiting = self._waiting.get(source, 0)
            if waiting and waiting + cost > self.limit:
                self._dropped[source] = self._dropped.get(source, 0) + 1
                return False
            self._waiting[source] = waiting + cost
            self._messages[source] += 1
            return True

    def release(self, source: str, size: int) -> None:
        """Give back the credit of a message that was admitted and is taken out now."""
        with self._lock:
            self._messages[source] -= 1
            left = self._waiting[source] - size - MESSAGE_COST
            if left:
                self._waiting[source] = left
            else:
                del self._waiting[source]
