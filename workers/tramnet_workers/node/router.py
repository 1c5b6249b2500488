"""Passes frames on for other TRAMs while this one computes.

What happens to a frame is decided by ``Transit``, which owns no thread and no channel; ``Router`` is the thread. A
router always takes a frame in: its queue holds the credit of all TRAMs, so that no two can wait for each other. It
needs little of the interpreter, and kernels let go of that (``benchmarks/routing.py`` measures what is left).

A frame of a wiring that is not known here yet waits for it, whomever it is for, so that whoever answers a frame
sends the answer by the wiring of the question or a newer one. What waits is bounded in number and bytes: beyond
that the oldest of the link on which most waits are dropped. So who sends frames of wirings that never come holds
up nobody on other links, and nobody at all whose wiring is known.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from tramnet_protocol.codec import Frame
from tramnet_protocol.exchange import Exchange
from tramnet_protocol.inbox import Inbox

MOST_WAITING = 1024
"""Frames that wait for their wiring, at most."""

MOST_WAITING_BYTES = 4 * 1024 * 1024
"""What they may hold [B]."""

_LONG = 3600.0

_log = logging.getLogger(__name__)


class Arrived(NamedTuple):
    """A frame, the link topic it came on and the length of its payload [B]."""

    key: str
    frame: Frame
    size: int

    @property
    def epoch(self) -> int:
        """The wiring it goes by."""
        return self.frame.header.epoch


@dataclass(slots=True)
class _Queue:
    """What waits on one link, in order of arrival."""

    frames: deque[Arrived] = field(default_factory=deque)
    bytes: int = 0

    @property
    def share(self) -> float:
        """How much of what may wait on all links it holds."""
        return max(len(self.frames) / MOST_WAITING, self.bytes / MOST_WAITING_BYTES)

    def put(self, arrived: Arrived) -> None:
        self.frames.append(arrived)
        self.bytes += arrived.size

    def take(self) -> Arrived:
        arrived = self.frames.popleft()
        self.bytes -= arrived.size
        return arrived


class Transit:
    """Decides what happens to frames that cannot be taken in at once.

    Args:
        exchange: This node's end of its links.

    Attributes:
        overflown: Frames dropped because too many waited.
    """

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._queues: dict[str, _Queue] = {}  # by link topic, none empty
        self.overflown = 0

    def ready(self, arrived: Arrived | None) -> list[Arrived]:
        """Return the frames that can go on now; those of one wiring and link are in order of arrival.

        Args:
            arrived: A frame that has just come, or None where a wiring may have.
        """
        newest = (
            self._exchange.wiring.epoch
        )  # looked at once: another thread may bring the next one
        ready = self._let_go(newest)
        if arrived is not None:
            if arrived.epoch <= newest:
                ready.append(arrived)
            else:
                self._wait(arrived)
        return ready

    def _let_go(self, newest: int) -> list[Arrived]:
        ready: list[Arrived] = []
        waiting, self._queues = self._queues, {}
        for key, queue in waiting.items():
            for one in queue.frames:
                if one.epoch <= newest:
                    ready.append(one)
                else:
                    self._queues.setdefault(key, _Queue()).put(one)
        return ready

    def _wait(self, arrived: Arrived) -> None:
        self._queues.setdefault(arrived.key, _Queue()).put(arrived)
        while self._is_too_much():
            key, fullest = max(self._queues.items(), key=lambda item: item[1].share)
            fullest.take()
            if not fullest.frames:
                del self._queues[key]
            self.overflown += 1
            self._exchange.drop(key)

    def _is_too_much(self) -> bool:
        n_frames = sum(len(queue.frames) for queue in self._queues.values())
        n_bytes = sum(queue.bytes for queue in self._queues.values())
        return n_frames > MOST_WAITING or (n_frames > 1 and n_bytes > MOST_WAITING_BYTES)


class Rewired(NamedTuple):
    """A wiring has come."""


class Closed(NamedTuple):
    """Nothing will come any more."""


class Router:
    """The thread that passes frames on.

    Args:
        exchange: This node's end of its links.
        pass_on: Sends a frame for another TRAM, given the topic it came on.
        take: Takes a frame for this one.
    """

    def __init__(
        self,
        exchange: Exchange,
        pass_on: Callable[[str, Frame], None],
        take: Callable[[Frame], None],
    ) -> None:
        self.inbox: Inbox[Arrived | Rewired | Closed] = Inbox()
        self._exchange = exchange
        self._transit = Transit(exchange)
        self._pass_on = pass_on
        self._take = take
        self._thread = threading.Thread(target=self._run, name="router", daemon=True)
        self._thread.start()

    def put(self, key: str, frame: Frame, size: int) -> None:
        """Take in a frame of a link; may be called from any thread.

        Args:
            key: The link topic it came on.
            frame: The frame.
            size: Length of its payload [B].
        """
        if not self.inbox.offer(key, size, Arrived(key, frame, size)):
            self._exchange.drop(key)

    def rewired(self) -> None:
        """Let go on what has waited for a wiring that is known now."""
        self.inbox.widen(len(self._exchange.wiring.incarnations))
        self.inbox.put(Rewired())

    def close(self) -> None:
        """Pass on what is here, and end."""
        self.inbox.put(Closed())
        self._thread.join()

    def _run(self) -> None:
        while True:
            match self.inbox.get(_LONG):
                case Closed():
                    return
                case Arrived() as arrived:
                    self._let_go(arrived)
                case Rewired():
                    self._let_go(None)

    def _let_go(self, arrived: Arrived | None) -> None:
        for one in self._transit.ready(arrived):
            try:
                if not self._exchange.admits(one.key, one.frame):
                    continue
                if self._exchange.is_ours(one.frame):
                    self._take(one.frame)
                else:
                    self._pass_on(one.key, one.frame)
            except Exception:
                _log.exception("could not pass on a frame of TRAM %d", one.frame.header.source)
