"""Everything that reaches a node, in one queue: what the transport's threads enqueue, its own thread takes out.

A source that sends more than it may cannot fill the memory of the node: beyond its credit its messages are
dropped and counted. Whatever is not from the network (a process that ended, a wish to stop) always fits.
"""

import queue
from collections.abc import Mapping
from typing import Generic, TypeVar

from tramnet_protocol.credit import RECEIVE_BYTES, ReceiveCredit

Item = TypeVar("Item")


class Inbox(Generic[Item]):
    """A queue in which each source has its credit."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[tuple[str, int, Item]] = queue.SimpleQueue()
        self._credit = ReceiveCredit()

    @property
    def dropped(self) -> Mapping[str, int]:
        """Messages refused so far, by source."""
        return self._credit.dropped

    @property
    def waiting(self) -> Mapping[str, int]:
        """Messages that wait now, by source."""
        return self._credit.waiting

    def widen(self, n_trams: int) -> None:
        """Let each link bring the credit of so many TRAMs, all that may send through it."""
        self._credit.limit = RECEIVE_BYTES * max(1, n_trams)

    def put(self, item: Item) -> None:
        """Enqueue something of this process's own."""
        self._queue.put(("", 0, item))

    def put_from(self, source: str, size: int, item: Item) -> None:
        """Enqueue a message from the network, or drop it where its source is out of credit.

        Args:
            source: Key of the message.
            size: Length of its payload [B].
            item: What to enqueue.
        """
        self.offer(source, size, item)

    def offer(self, source: str, size: int, item: Item) -> bool:
        """Enqueue a message from the network if its source has credit left.

        Args:
            source: Key of the message.
            size: Length of its payload [B].
            item: What to enqueue.

        Returns:
            Whether it was enqueued.
        """
        admitted = self._credit.admit(source, size)
        if admitted:
            self._queue.put((source, size, item))
        return admitted

    def get(self, timeout: float) -> Item | None:
        """Take the next item out, or None if there is none in time.

        Args:
            timeout: Longest wait [s]; at most 0 takes only what is there.
        """
        try:
            source, size, item = self._queue.get(timeout > 0, max(0.0, timeout))
        except queue.Empty:
            return None
        if source:
            self._credit.release(source, size)
        return item

    @property
    def empty(self) -> bool:
        """Whether nothing waits."""
        return self._queue.empty()
