"""The statistics of a recording: what each link and each kind of message carried, in all and over time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from tramnet_master.traffic.recording import Recording, SeenFrame
from tramnet_master.traffic.rows import LINK_BYTES_PER_SECOND, link_name, mean
from tramnet_protocol.sequences import SequenceChecker

MOST_BINS = 240
LEAST_BIN = 0.02
"""Shortest time over which a rate is drawn [s]."""

_PEAK = 1.0
"""Time over which a peak is taken [s]."""


class LinkTraffic(Struct, frozen=True):
    """What a directed link carried.

    Attributes:
        link: Its name.
        source: Sending TRAM.
        destination: Receiving TRAM.
        frames: Frames.
        bytes: Their payload bytes [B].
        mean_bytes: Mean payload [B].
        frames_per_s: Mean rate over the recording [1/s].
        bytes_per_s: Mean rate over the recording [B/s].
        peak_bytes_per_s: Rate in the fullest second [B/s].
        utilisation: Mean rate over that of one direction of a 20 Mbaud link.
        peak_utilisation: The same of the fullest second.
        missed: Frames of the link that the recorder did not see.
    """

    link: str
    source: int
    destination: int
    frames: int
    bytes: int
    mean_bytes: float
    frames_per_s: float
    bytes_per_s: float
    peak_bytes_per_s: float
    utilisation: float
    peak_utilisation: float
    missed: int


class TagTraffic(Struct, frozen=True):
    """Messages of one kind, each counted once however many links it passed.

    Attributes:
        tag: The kind.
        frames: Messages.
        bytes: Their payload bytes [B].
        mean_bytes: Mean payload [B].
        hops: Mean number of links that each passed.
    """

    tag: str
    frames: int
    bytes: int
    mean_bytes: float
    hops: float


@dataclass(frozen=True)
class Utilisation:
    """How full links were over time.

    Attributes:
        links: Sending and receiving TRAM of each.
        edges: Times at which bins begin and end [s], of shape (bins + 1,).
        shares: Rates over that of one direction of a 20 Mbaud link, of shape (links, bins).
    """

    links: list[tuple[int, int]]
    edges: NDArray[np.float64]
    shares: NDArray[np.float64]


def links_of(recording: Recording) -> list[LinkTraffic]:
    """Return what each link carried, in the order of seats."""
    passed = max(recording.seconds, 1e-9)
    return [_link(link, frames, passed) for link, frames in sorted(_by_link(recording).items())]


def tags_of(recording: Recording) -> list[TagTraffic]:
    """Return what travelled, kind by kind."""
    rows = []
    for tag in sorted({frame.tag for frame in recording.frames}):
        passed = [frame for frame in recording.frames if frame.tag == tag]
        made = [frame for frame in passed if frame.link[0] == frame.source]
        size = sum(frame.bytes for frame in made)
        hops = mean(len(passed), len(made))
        rows.append(TagTraffic(tag, len(made), size, mean(size, len(made)), hops))
    return rows


def utilisation_of(recording: Recording) -> Utilisation:
    """Return how full each link was over time, in bins of equal length."""
    passed = max(recording.seconds, LEAST_BIN)
    edges = np.linspace(0.0, passed, _bins(passed, LEAST_BIN) + 1)
    links = sorted(_by_link(recording).items())
    shares = np.array(
        [_binned(frames, edges) / (edges[1] * LINK_BYTES_PER_SECOND) for _, frames in links]
    ).reshape(len(links), len(edges) - 1)
    return Utilisation([link for link, _ in links], edges, shares)


def _by_link(recording: Recording) -> dict[tuple[int, int], list[SeenFrame]]:
    links: dict[tuple[int, int], list[SeenFrame]] = {}
    for frame in recording.frames:
        links.setdefault(frame.link, []).append(frame)
    return links


def _link(link: tuple[int, int], frames: Sequence[SeenFrame], passed: float) -> LinkTraffic:
    checker = SequenceChecker(from_start=False)
    for frame in frames:
        checker.arrived(frame.sequence)
    size = sum(frame.bytes for frame in frames)
    whole = max(1, int(passed / _PEAK))
    seconds = _binned(frames, np.linspace(0.0, max(passed, _PEAK), whole + 1))
    peak = float(seconds.max()) / (max(passed, _PEAK) / whole)
    return LinkTraffic(
        link=link_name(*link),
        source=link[0],
        destination=link[1],
        frames=len(frames),
        bytes=size,
        mean_bytes=mean(size, len(frames)),
        frames_per_s=len(frames) / passed,
        bytes_per_s=size / passed,
        peak_bytes_per_s=peak,
        utilisation=size / passed / LINK_BYTES_PER_SECOND,
        peak_utilisation=peak / LINK_BYTES_PER_SECOND,
        missed=checker.missed,
    )


def _binned(frames: Sequence[SeenFrame], edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bytes of frames in each bin, of shape (bins,)."""
    times = np.array([frame.time for frame in frames])
    sizes = np.array([frame.bytes for frame in frames], np.float64)
    counts, _ = np.histogram(times, edges, weights=sizes)
    return counts


def _bins(seconds: float, least: float) -> int:
    return max(1, min(MOST_BINS, int(seconds / least)))
