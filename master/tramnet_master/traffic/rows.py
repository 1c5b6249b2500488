"""The tables of ``tramnet inspect``: what a row says. Programs read the same names as people sort and filter by."""

from typing import TypeAlias

from msgspec import Struct

LINK_BYTES_PER_SECOND = 1_740_000
"""What a 20 Mbaud link carries in one direction (INMOS Transputer Databook, 3rd ed., table 8.1) [B/s]."""


class TramRow(Struct, frozen=True):
    """A TRAM between two heartbeats.

    Attributes:
        seat: Its seat; 0 is the root.
        incarnation: Its incarnation.
        host: Its host.
        pid: Its process.
        state: What it was doing; ``silent`` when its heartbeat is overdue, ``building`` before it can take work.
        chunks: Chunks answered, or for the root accepted.
        evaluations: Individuals evaluated.
        evaluations_per_s: Rate since the heartbeat before [1/s].
        busy: Share of the time it computed since then.
        idle: Share of the time it waited for work.
        blocked: Share of the time it waited to send.
        queued: Chunks held and not begun.
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
    idle: float
    blocked: float
    queued: int
    heard_s: float


class LinkRow(Struct, frozen=True):
    """A directed link between two heartbeats of its sender.

    Attributes:
        link: Its name, ``link/0/1``.
        source: Sending TRAM.
        destination: Receiving TRAM.
        frames: Frames sent so far.
        bytes: Payload bytes sent so far [B].
        frames_per_s: Rate since the heartbeat before [1/s].
        bytes_per_s: Rate since the heartbeat before [B/s].
        mean_bytes: Mean payload since then, or so far where nothing was sent since [B].
        utilisation: Rate over that of one direction of a 20 Mbaud link.
        queued: Frames that wait at either end, to be sent or to be taken.
        dropped: Frames the receiver dropped.
        gaps: Frames the receiver missed.
    """

    link: str
    source: int
    destination: int
    frames: int
    bytes: int
    frames_per_s: float
    bytes_per_s: float
    mean_bytes: float
    utilisation: float
    queued: int
    dropped: int
    gaps: int


class TagRow(Struct, frozen=True):
    """Messages of one kind that the root sent or took, between two of its heartbeats.

    Attributes:
        tag: The kind.
        way: ``from root`` or ``to root``.
        frames: Messages so far.
        bytes: Their payload bytes [B].
        frames_per_generation: Messages so far over generations so far.
        frames_per_s: Rate since the heartbeat before [1/s].
        bytes_per_s: Rate since the heartbeat before [B/s].
        mean_bytes: Mean payload so far [B].
    """

    tag: str
    way: str
    frames: int
    bytes: int
    frames_per_generation: float
    frames_per_s: float
    bytes_per_s: float
    mean_bytes: float


class TopicRow(Struct, frozen=True):
    """A link topic as a sniffer saw it.

    Attributes:
        link: Its name, ``link/0/1``.
        source: Sending TRAM.
        destination: Receiving TRAM.
        frames: Frames seen so far.
        bytes: Their payload bytes [B].
        frames_per_s: Rate in the last second [1/s].
        bytes_per_s: Rate in the last second [B/s].
        mean_bytes: Mean payload so far [B].
        least_bytes: Smallest payload [B].
        most_bytes: Largest payload [B].
        utilisation: Rate over that of one direction of a 20 Mbaud link.
        missed: Frames the link carried and the sniffer did not see.
    """

    link: str
    source: int
    destination: int
    frames: int
    bytes: int
    frames_per_s: float
    bytes_per_s: float
    mean_bytes: float
    least_bytes: int
    most_bytes: int
    utilisation: float
    missed: int


Row: TypeAlias = TramRow | LinkRow | TagRow | TopicRow

TABLES: dict[str, type[Row]] = {
    "trams": TramRow,
    "links": LinkRow,
    "tags": TagRow,
    "topics": TopicRow,
}
"""The tables by name, in the order in which they are shown."""


def link_name(source: int, destination: int) -> str:
    """Return the name of a directed link."""
    return f"link/{source}/{destination}"


def mean(total: float, count: int) -> float:
    """Return a mean, or 0 of nothing."""
    return total / count if count else 0.0
