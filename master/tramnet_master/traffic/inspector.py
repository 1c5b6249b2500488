"""What the heartbeats of a network tell: TRAMs, links and kinds of messages, with rates between two heartbeats."""

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tramnet_master.traffic.rows import (
    LINK_BYTES_PER_SECOND,
    LinkRow,
    TagRow,
    TramRow,
    link_name,
    mean,
)
from tramnet_protocol.codec import decode
from tramnet_protocol.errors import MalformedFrame
from tramnet_protocol.messages import ROOT, LinkCounters, Stats, TagCounters

SILENT = 2.5
"""Age of a heartbeat from which a TRAM counts as silent [s]."""


@dataclass(slots=True)
class _Heard:
    stats: Stats
    at: float
    before: Stats | None = None

    @property
    def passed(self) -> float:
        """Time between the two heartbeats, or 0 if there is only one [s]."""
        return max(self.stats.uptime - self.before.uptime, 1e-9) if self.before else 0.0

    def rate(self, gained: float) -> float:
        """What was gained between the two heartbeats, per second."""
        return max(0.0, gained) / self.passed if self.passed else 0.0


class Inspector:
    """Collects heartbeats; they may come on another thread.

    Args:
        clock: Monotonic time [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._heard: dict[int, _Heard] = {}

    @property
    def rated(self) -> frozenset[tuple[int, int]]:
        """Seat and incarnation of the TRAMs whose rates are known: two heartbeats were heard."""
        return frozenset(
            (seat, heard.stats.incarnation)
            for seat, heard in self._snapshot().items()
            if heard.before
        )

    def take(self, payload: bytes) -> None:
        """Note a heartbeat; what is none is ignored."""
        try:
            stats = decode(payload).message()
        except MalformedFrame:
            return
        if not isinstance(stats, Stats):
            return
        with self._lock:
            last = self._heard.get(stats.seat)
            same = last is not None and last.stats.incarnation == stats.incarnation
            before = last.stats if last is not None and same else None
            self._heard[stats.seat] = _Heard(stats, self._clock(), before)

    def keep(self, present: Mapping[int, int]) -> None:
        """Forget the TRAMs that are gone.

        Args:
            present: Incarnations of those that are there, by seat.
        """
        with self._lock:
            self._heard = {
                seat: heard
                for seat, heard in self._heard.items()
                if seat == ROOT or present.get(seat) == heard.stats.incarnation
            }

    def trams(self) -> list[TramRow]:
        """Return the TRAMs in the order of seats."""
        now = self._clock()
        return [_tram(heard, now) for _, heard in sorted(self._snapshot().items())]

    def links(self) -> list[LinkRow]:
        """Return the directed links that have carried frames: what was sent, and what became of it."""
        everybody = self._snapshot()
        received = {
            (counters.source, counters.destination): counters
            for heard in everybody.values()
            for counters in heard.stats.links
            if counters.destination == heard.stats.seat
        }
        rows = [
            _link(sent, received.get((sent.source, sent.destination)), heard)
            for heard in everybody.values()
            for sent in heard.stats.links
            if sent.source == heard.stats.seat
        ]
        return sorted(rows, key=lambda row: (row.source, row.destination))

    def tags(self, generations: int) -> list[TagRow]:
        """Return the kinds of messages that the root has sent and taken.

        Args:
            generations: Generations done so far.
        """
        heard = self._snapshot().get(ROOT)
        if heard is None:
            return []
        before = {seen.tag: seen for seen in heard.before.tags} if heard.before else {}
        return [
            row
            for seen in heard.stats.tags
            for row in _tags(seen, before.get(seen.tag), heard, generations)
        ]

    def _snapshot(self) -> dict[int, _Heard]:
        with self._lock:
            return dict(self._heard)


def _tram(heard: _Heard, now: float) -> TramRow:
    stats = heard.stats
    earlier = heard.before or stats
    busy = min(1.0, heard.rate(stats.busy - earlier.busy))
    blocked = min(1.0 - busy, heard.rate(stats.blocked - earlier.blocked))
    age = now - heard.at
    return TramRow(
        seat=stats.seat,
        incarnation=stats.incarnation,
        host=stats.host,
        pid=stats.pid,
        state="silent" if age > SILENT else stats.state,
        chunks=stats.chunks,
        evaluations=stats.evaluations,
        evaluations_per_s=heard.rate(stats.evaluations - earlier.evaluations),
        busy=busy,
        idle=1.0 - busy - blocked if heard.before else 0.0,
        blocked=blocked,
        queued=stats.queued,
        heard_s=age,
    )


def _link(sent: LinkCounters, received: LinkCounters | None, heard: _Heard) -> LinkRow:
    frames, size = sent.frames, sent.bytes
    if heard.before is not None:
        for old in heard.before.links:
            if (old.source, old.destination) == (sent.source, sent.destination):
                frames, size = frames - old.frames, size - old.bytes
    per_second = heard.rate(size)
    return LinkRow(
        link=link_name(sent.source, sent.destination),
        source=sent.source,
        destination=sent.destination,
        frames=sent.frames,
        bytes=sent.bytes,
        frames_per_s=heard.rate(frames),
        bytes_per_s=per_second,
        mean_bytes=mean(size, frames) if frames else mean(sent.bytes, sent.frames),
        utilisation=per_second / LINK_BYTES_PER_SECOND,
        queued=sent.queued + (received.queued if received else 0),
        dropped=sent.dropped + (received.dropped if received else 0),
        gaps=received.gaps if received else 0,
    )


def _tags(
    seen: TagCounters, before: TagCounters | None, heard: _Heard, generations: int
) -> list[TagRow]:
    old = before or TagCounters(seen.tag, 0, 0, 0, 0)
    ways = (
        ("from root", seen.sent, seen.sent_bytes, old.sent, old.sent_bytes),
        ("to root", seen.received, seen.received_bytes, old.received, old.received_bytes),
    )
    return [
        TagRow(
            tag=seen.tag,
            way=way,
            frames=frames,
            bytes=size,
            frames_per_generation=mean(frames, generations),
            frames_per_s=heard.rate(frames - old_frames),
            bytes_per_s=heard.rate(size - old_size),
            mean_bytes=mean(size, frames),
        )
        for way, frames, size, old_frames, old_size in ways
        if frames
    ]
