"""Exact rates and sizes of link topics: every frame counted as it passes, and those that were missed as well.

The price is that the root sends every frame once more, to whoever sniffs, and that each is looked at here. Both are
measured: ``cost`` says what a sniffer took so far.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from msgspec import Struct

from tramnet_master.traffic.rows import LINK_BYTES_PER_SECOND, TopicRow, link_name, mean
from tramnet_protocol.codec import decode
from tramnet_protocol.errors import MalformedFrame, UnknownKey
from tramnet_protocol.keys import parse
from tramnet_protocol.sequences import SequenceChecker

WINDOW = 1.0
"""Shortest time over which a rate is taken [s]."""


class Cost(Struct, frozen=True):
    """What a sniffer took.

    Attributes:
        seconds: How long it sniffed [s].
        frames: Frames seen.
        bytes: Their payload bytes, each sent once more by the root [B].
        missed: Frames that links carried and it did not see.
        malformed: Payloads seen that were no frames.
        cpu: Compute time of this process over the time passed: shares of one core.
        bytes_per_s: What the root sent here in the last second [B/s].
    """

    seconds: float
    frames: int
    bytes: int
    missed: int
    malformed: int
    cpu: float
    bytes_per_s: float


@dataclass(slots=True)
class _Topic:
    source: int
    destination: int
    frames: int = 0
    bytes: int = 0
    least: int = 0
    most: int = 0
    checker: SequenceChecker = field(default_factory=lambda: SequenceChecker(from_start=False))
    before: tuple[int, int] = (0, 0)  # frames and bytes when the window began
    rates: tuple[float, float] = (0.0, 0.0)


class Sniffer:
    """Counts frames by link topic; they may come on another thread.

    Args:
        clock: Monotonic time [s].
        cpu_clock: Compute time of this process [s].
    """

    def __init__(
        self,
        clock: Callable[[], float] = time.monotonic,
        cpu_clock: Callable[[], float] = time.process_time,
    ) -> None:
        self._clock = clock
        self._cpu_clock = cpu_clock
        self._lock = threading.Lock()
        self._topics: dict[str, _Topic] = {}
        self._malformed = 0
        self._began = self._window = clock()
        self._cpu_began = cpu_clock()

    def take(self, key: str, payload: bytes) -> None:
        """Count a frame."""
        try:
            frame = decode(payload)
            source, destination = parse(key).seats
        except (MalformedFrame, UnknownKey, ValueError):
            self._malformed += 1
            return
        size = len(payload)
        with self._lock:
            topic = self._topics.get(key)
            if topic is None:
                topic = self._topics[key] = _Topic(source, destination, least=size)
            topic.frames += 1
            topic.bytes += size
            topic.least, topic.most = min(topic.least, size), max(topic.most, size)
            topic.checker.arrived(frame.header.sequence)

    def topics(self) -> list[TopicRow]:
        """Return the link topics in the order of seats."""
        with self._lock:
            self._close_window()
            rows = [_row(topic) for topic in self._topics.values()]
        return sorted(rows, key=lambda row: (row.source, row.destination))

    def cost(self) -> Cost:
        """Return what sniffing took so far."""
        rows = self.topics()
        passed = max(self._clock() - self._began, 1e-9)
        return Cost(
            seconds=passed,
            frames=sum(row.frames for row in rows),
            bytes=sum(row.bytes for row in rows),
            missed=sum(row.missed for row in rows),
            malformed=self._malformed,
            cpu=(self._cpu_clock() - self._cpu_began) / passed,
            bytes_per_s=sum(row.bytes_per_s for row in rows),
        )

    def _close_window(self) -> None:
        now = self._clock()
        passed = now - self._window
        if passed < WINDOW:
            return
        self._window = now
        for topic in self._topics.values():
            frames, size = topic.frames - topic.before[0], topic.bytes - topic.before[1]
            topic.rates = (frames / passed, size / passed)
            topic.before = (topic.frames, topic.bytes)


def _row(topic: _Topic) -> TopicRow:
    frames_per_s, bytes_per_s = topic.rates
    return TopicRow(
        link=link_name(topic.source, topic.destination),
        source=topic.source,
        destination=topic.destination,
        frames=topic.frames,
        bytes=topic.bytes,
        frames_per_s=frames_per_s,
        bytes_per_s=bytes_per_s,
        mean_bytes=mean(topic.bytes, topic.frames),
        least_bytes=topic.least,
        most_bytes=topic.most,
        utilisation=bytes_per_s / LINK_BYTES_PER_SECOND,
        missed=topic.checker.missed,
    )
