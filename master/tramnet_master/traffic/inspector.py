"""What the heartbeats of a network tell: TRAMs and links, with rates between one heartbeat and the next."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from msgspec import Struct

from tramnet_protocol.codec import decode
from tramnet_protocol.errors import MalformedFrame
from tramnet_protocol.messages import ROOT, LinkCounters, Stats

LINK_BYTES_PER_SECOND = 1_740_000
"""What a 20 Mbaud link carries in one direction (INMOS Transputer Databook, 3rd ed., table 8.1) [B/s]."""


class TramRow(Struct, frozen=True):
    """A TRAM between two heartbeats.

    Attributes:
        seat: Its seat; 0 is the root.
        incarnation: Its incarnation.
        host: Its host.
        pid: Its process.
        state: What it was doing.
        chunks: Chunks answered, or for the root accepted.
        evaluations: Individuals evaluated.
        evaluations_per_s: Rate since the heartbeat before [1/s].
        busy: Share of the time it computed since then.
        blocked: Share of the time it waited to send.
        heard_s: Age of the heartbeat [s].
    """

    seat: int
    incarnation: int
    host: str
    pid: int
    state: str
    chunks: int
    evaluations: int
    evaluations_per_s: float
    busy: float
    blocked: float
    heard_s: float


class LinkRow(Struct, frozen=True):
    """A directed link between two heartbeats of its sender.

    Attributes:
        source: Sending TRAM.
        destination: Receiving TRAM.
        frames: Frames sent so far.
        bytes: Payload bytes sent so far [B].
        frames_per_s: Rate since the heartbeat before [1/s].
        bytes_per_s: Rate since the heartbeat before [B/s].
        mean_bytes: Mean payload since then [B].
        utilisation: Rate over that of one direction of a 20 Mbaud link.
    """

    source: int
    destination: int
    frames: int
    bytes: int
    frames_per_s: float
    bytes_per_s: float
    mean_bytes: float
    utilisation: float


@dataclass(slots=True)
class _Heard:
    stats: Stats
    at: float
    before: Stats | None = None


class Inspector:
    """Collects heartbeats.

    Args:
        clock: Monotonic time [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._heard: dict[int, _Heard] = {}

    @property
    def seats(self) -> frozenset[int]:
        """TRAMs heard so far."""
        return frozenset(self._heard)

    @property
    def complete(self) -> bool:
        """Whether every TRAM heard has sent two heartbeats, so that all rates are known."""
        return bool(self._heard) and all(heard.before for heard in self._heard.values())

    def take(self, payload: bytes) -> None:
        """Note a heartbeat; what is none is ignored."""
        try:
            stats = decode(payload).message()
        except MalformedFrame:
            return
        if not isinstance(stats, Stats):
            return
        last = self._heard.get(stats.seat)
        same = last is not None and last.stats.incarnation == stats.incarnation
        before = last.stats if last is not None and same else None
        self._heard[stats.seat] = _Heard(stats, self._clock(), before)

    def trams(self) -> list[TramRow]:
        """Return the TRAMs in the order of seats."""
        now = self._clock()
        return [_tram(self._heard[seat], now) for seat in sorted(self._heard)]

    def links(self) -> list[LinkRow]:
        """Return the directed links that have carried frames, as their senders counted them."""
        rows = [
            _link(counters, heard)
            for heard in self._heard.values()
            for counters in heard.stats.links
            if counters.source == heard.stats.seat
        ]
        return sorted(rows, key=lambda row: (row.source, row.destination))


def _tram(heard: _Heard, now: float) -> TramRow:
    stats, before = heard.stats, heard.before
    passed = max(stats.uptime - before.uptime, 1e-9) if before is not None else 0.0

    def rate(after: float, earlier: float) -> float:
        return (after - earlier) / passed if passed else 0.0

    earlier = before if before is not None else stats
    return TramRow(
        seat=stats.seat,
        incarnation=stats.incarnation,
        host=stats.host,
        pid=stats.pid,
        state="root" if stats.seat == ROOT and stats.state == "running" else stats.state,
        chunks=stats.chunks,
        evaluations=stats.evaluations,
        evaluations_per_s=rate(stats.evaluations, earlier.evaluations),
        busy=min(1.0, rate(stats.busy, earlier.busy)),
        blocked=min(1.0, rate(stats.blocked, earlier.blocked)),
        heard_s=now - heard.at,
    )


def _link(counters: LinkCounters, heard: _Heard) -> LinkRow:
    frames = size = 0
    passed = 0.0
    if heard.before is not None:
        passed = max(heard.stats.uptime - heard.before.uptime, 1e-9)
        for old in heard.before.links:
            if (old.source, old.destination) == (counters.source, counters.destination):
                frames, size = old.frames, old.bytes
    new_frames, new_bytes = counters.frames - frames, counters.bytes - size
    per_second = new_bytes / passed if passed else 0.0
    return LinkRow(
        source=counters.source,
        destination=counters.destination,
        frames=counters.frames,
        bytes=counters.bytes,
        frames_per_s=new_frames / passed if passed else 0.0,
        bytes_per_s=per_second,
        mean_bytes=new_bytes / new_frames if new_frames else 0.0,
        utilisation=per_second / LINK_BYTES_PER_SECOND,
    )
