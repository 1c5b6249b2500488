"""What each TRAM did when, from the frames it was seen to take and to send: the rows of a space-time picture.

What is known of a worker are three things: when its work passed, how long it says that it computed, and when its
answer passed. It computed from when the work had passed and the answer before was computed, for as long as it says;
from then until its answer passed, it was sending (or, on a machine that is full, waiting for a processor to send
on). The rest of the time it waited. A frame that a TRAM passes on for others is *passing* from when it came until
it went on.

The root is sending while its frames follow one another, and computes while no work is out.
"""

import enum
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from tramnet_master.traffic.recording import RecordedWork, SeenFrame
from tramnet_protocol.messages import ROOT

BURST = 0.001
"""Longest time between two frames of the root that count as sent in one go [s]."""

_ASKS = frozenset(("evaluate", "evolve", "track"))


class Doing(enum.Enum):
    """What a TRAM does."""

    COMPUTING = "computing"
    SENDING = "sending"
    PASSING = "passing on"


class Stretch(NamedTuple):
    """A time in which a TRAM did one thing.

    Attributes:
        doing: What.
        begin: From when [s].
        end: Until when [s].
    """

    doing: Doing
    begin: float
    end: float


def stretches_of(frames: Sequence[SeenFrame]) -> dict[int, list[Stretch]]:
    """Return what each TRAM did when it did not wait.

    Args:
        frames: Frames on links, in the order of time.
    """
    met: dict[int, list[SeenFrame]] = {ROOT: []}
    for frame in frames:
        for seat in frame.link:
            met.setdefault(seat, []).append(frame)
    done = {seat: _worker(seat, seen) for seat, seen in met.items() if seat != ROOT}
    done[ROOT] = _root(met[ROOT])
    for seat, stretch in _passing(frames):
        done[seat].append(stretch)
    return {seat: sorted(done[seat], key=lambda stretch: stretch.begin) for seat in sorted(done)}


@dataclass
class _Worker:
    """A worker whose frames are gone through.

    Attributes:
        came: When its work passed.
        free: When its last answer was computed.
    """

    came: dict[RecordedWork, float] = field(default_factory=dict)
    free: float = -float("inf")

    def answer(self, work: RecordedWork, seconds: float, passed: float) -> list[Stretch]:
        """What it did until an answer passed."""
        begin = max(self.came.pop(work, passed - seconds), self.free)
        # The time of passing is that of the observer, so that it may come out a little early.
        end = min(begin + seconds, passed)
        begin = max(min(begin, passed - seconds), self.free)
        self.free = end
        return [Stretch(Doing.COMPUTING, begin, end), Stretch(Doing.SENDING, end, passed)]


def _worker(seat: int, frames: Iterable[SeenFrame]) -> list[Stretch]:
    worker, stretches = _Worker(), []
    for frame in frames:
        if frame.work is None:
            continue
        if frame.link[1] == frame.destination == seat and frame.tag in _ASKS:
            worker.came[frame.work] = frame.time
        elif frame.link[0] == frame.source == seat and frame.seconds is not None:
            stretches += worker.answer(frame.work, frame.seconds, frame.time)
    return stretches


def _root(frames: Iterable[SeenFrame]) -> list[Stretch]:
    stretches: list[Stretch] = []
    out: set[RecordedWork] = set()
    since: float | None = None  # when the last work came back
    for frame in frames:
        if frame.link[0] == ROOT:
            if frame.work is not None:
                out.add(frame.work)
            if since is not None:
                stretches.append(Stretch(Doing.COMPUTING, since, frame.time))
                since = None
            _send_on(stretches, frame.time)
        elif frame.link[1] == ROOT and frame.work in out:
            out.discard(frame.work)
            since = frame.time if not out else None
    return stretches


def _send_on(stretches: list[Stretch], time: float) -> None:
    """Let the root send at a time: on, where it was just sending."""
    last = stretches[-1] if stretches else None
    if last is not None and last.doing is Doing.SENDING and time - last.end <= BURST:
        stretches[-1] = last._replace(end=time)
    else:
        stretches.append(Stretch(Doing.SENDING, time, time))


def _passing(frames: Iterable[SeenFrame]) -> Iterable[tuple[int, Stretch]]:
    on_the_way: dict[tuple[int, int, str, RecordedWork | None], float] = {}
    for frame in frames:
        name = (frame.source, frame.destination, frame.tag, frame.work)
        came = on_the_way.pop(name, None)
        if came is not None and frame.link[0] != frame.source:
            yield frame.link[0], Stretch(Doing.PASSING, came, frame.time)
        if frame.link[1] != frame.destination:
            on_the_way[name] = frame.time
