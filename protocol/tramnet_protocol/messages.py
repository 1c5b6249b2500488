"""The messages of the network: frozen values, checked once, where they arrive.

Every message is a frozen struct. On the wire it is a MessagePack map of its fields, no more and no fewer than
those without a default; the frame's header names its tag (see ``codec.py`` and the normative
``protocol/README.md``). Nothing here knows a socket or a clock.

The root tells workers what to do (``Setup``, the three kinds of ``Work``, ``Stop``); workers answer
(``Evaluated``, ``PopulationMeans``, ``Tracked`` or ``Failed``). A worker enters by ``JoinRequest`` and is answered
by ``JoinReply`` or ``Refusal``; people steer by ``ControlRequest``.
"""

import enum
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta, Struct

from tramnet_protocol.arrays import Array

PROTOCOL_VERSION = 2
MAX_WORD = 2**63 - 1

Count: TypeAlias = Annotated[int, Meta(ge=0, le=2**32 - 1)]
Seat: TypeAlias = Annotated[int, Meta(ge=0, le=4095)]
Word: TypeAlias = Annotated[int, Meta(ge=0, le=MAX_WORD)]
Seconds: TypeAlias = Annotated[float, Meta(ge=0.0, le=1e12)]
Name: TypeAlias = Annotated[str, Meta(min_length=1, max_length=120)]
Text: TypeAlias = Annotated[str, Meta(max_length=4000)]

Pace: TypeAlias = Literal[0, 5, 10, 20]

ROOT: Seat = 0
NOBODY: Seat = 4095
"""Stands in a header where there is no seat: a worker that asks for one, a person, everybody who listens."""


class Kind(enum.IntEnum):
    """What a piece of work asks for."""

    EVALUATE = 0
    EVOLVE = 1
    TRACK = 2


class WorkId(Struct, frozen=True, order=True, array_like=True):
    """Identity of a piece of work inside a run; equal identities ask for equal results.

    Attributes:
        kind: What is asked.
        population: Index of the population, or of the scene or sub-population in tracking.
        step: Generation, or tracking step.
        first: First individual, population or tracking point, inclusive.
        last: Last one, exclusive; more than ``first``.
    """

    kind: Kind
    population: Count
    step: Count
    first: Count
    last: Count

    def __post_init__(self) -> None:
        if self.last <= self.first:
            raise ValueError(f"found the empty range {self.first} to {self.last}")

    @property
    def size(self) -> int:
        """Number of individuals, populations or points."""
        return self.last - self.first


class Evaluate(Struct, frozen=True, forbid_unknown_fields=True):
    """Evaluate chromosomes ``first`` to ``last`` of a generation.

    Attributes:
        work: Identity.
        genomes: Chromosomes, of shape (size, *genome shape).
    """

    work: WorkId
    genomes: Array


class Evolve(Struct, frozen=True, forbid_unknown_fields=True):
    """Bring populations ``first`` to ``last`` one generation further, with everybody's connecting values.

    Attributes:
        work: Identity; ``population`` counts the searches of a run, and ``step`` is the generation to evaluate: 0
            begins. A worker that holds the populations is sent the rest without state.
        means: Connecting values of all populations in generations ``step - n`` to ``step - 1``, of shape
            (n, populations, values); one generation where the worker holds the state.
        snapshot: Whether a ``PopulationSnapshot`` shall come with the answer.
        populations: Snapshot of generation ``step - n`` to go on from, or None to begin anew or go on.
        problem: What the populations evolve on, for a worker that holds nothing of it, else None.
    """

    work: WorkId
    means: Array
    snapshot: bool = False
    populations: Array | None = None
    problem: dict[str, object] | None = None


class Track(Struct, frozen=True, forbid_unknown_fields=True):
    """Follow tracking points ``first`` to ``last`` from a posture.

    Attributes:
        work: Identity; ``population`` is the sub-population or the scene.
        posture: Joint angles at the point before ``first`` [rad], of shape (joints,).
    """

    work: WorkId
    posture: Array


class Evaluated(Struct, frozen=True, forbid_unknown_fields=True):
    """Answer to ``Evaluate``.

    Attributes:
        work: Identity of the work answered.
        objectives: Objective of each chromosome, minimised, of shape (size,), float64.
        seconds: Compute time on the worker [s].
    """

    work: WorkId
    objectives: Array
    seconds: Seconds


class PopulationMeans(Struct, frozen=True, forbid_unknown_fields=True):
    """Answer to ``Evolve``: all that populations tell of themselves; no individual crosses a link.

    Attributes:
        work: Identity of the work answered.
        means: The populations' own connecting values in generation ``step``, of shape (size, values): mean, median
            or best, as configured (Kim & Khosla 1992, eqs 9-11); no row after the last generation.
        ranking: Of generation ``step - 1``: largest and mean fitness, then traits and terms of the best individual,
            of shape (size, columns); no row in step 0.
        seconds: Compute time on the worker [s].
    """

    work: WorkId
    means: Array
    ranking: Array
    seconds: Seconds


class PopulationSnapshot(Struct, frozen=True, forbid_unknown_fields=True):
    """State of populations, kept by the root to restore them elsewhere; sent ahead of the answer it belongs to.

    Attributes:
        work: Identity of the ``Evolve`` that asked for it.
        populations: Packed chromosomes after that work, of shape (size, individuals, bytes).
        fitness: Fitness of the generation rated last, of shape (size, individuals).
    """

    work: WorkId
    populations: Array
    fitness: Array


class Tracked(Struct, frozen=True, forbid_unknown_fields=True):
    """Answer to ``Track``.

    Attributes:
        work: Identity of the work answered.
        path: Joint angles at each point [rad], of shape (size, joints).
        cost: Cost at each point, of shape (size,).
        seconds: Compute time on the worker [s].
    """

    work: WorkId
    path: Array
    cost: Array
    seconds: Seconds


class Failed(Struct, frozen=True, forbid_unknown_fields=True):
    """The worker could not answer: the evaluation raised an error.

    Attributes:
        work: Identity of the work.
        error: The error, in words.
        seconds: Time spent on it [s].
    """

    work: WorkId
    error: Text
    seconds: Seconds = 0.0


class Setup(Struct, frozen=True, forbid_unknown_fields=True):
    """The problem, once per worker: a registered name and plain parameters, never code.

    Attributes:
        problem: Name in the registry of problems.
        parameters: Numbers, strings, lists and maps of these.
    """

    problem: Name
    parameters: dict[str, object]


class Stop(Struct, frozen=True, forbid_unknown_fields=True):
    """Ask a worker to end.

    Attributes:
        reason: Why, for its log.
    """

    reason: Text


class LinkCounters(Struct, frozen=True, forbid_unknown_fields=True):
    """Traffic of one directed link, as its sender or receiver counted it.

    Attributes:
        source: Sending TRAM.
        destination: Receiving TRAM.
        frames: Number of frames since the start.
        bytes: Number of payload bytes since the start.
        dropped: Frames dropped for any reason.
        gaps: Sequence numbers missed.
        queued: Frames that wait at the end that counts: to be sent, or arrived and not yet taken.
    """

    source: Seat
    destination: Seat
    frames: Word
    bytes: Word
    dropped: Word = 0
    gaps: Word = 0
    queued: Word = 0


class TagCounters(Struct, frozen=True, forbid_unknown_fields=True):
    """Messages of one kind that a TRAM made or took, each counted once at either end, however many hops it made.

    Attributes:
        tag: Name of the message.
        sent: Messages made here and sent.
        sent_bytes: Their payload bytes.
        received: Messages addressed to this TRAM that arrived.
        received_bytes: Their payload bytes.
    """

    tag: Name
    sent: Word
    sent_bytes: Word
    received: Word
    received_bytes: Word


class Stats(Struct, frozen=True, forbid_unknown_fields=True):
    """The 1 Hz heartbeat of a TRAM, sent from Python, so that a hung interpreter falls silent.

    Attributes:
        seat: The TRAM.
        incarnation: Its incarnation.
        state: What it is doing: ``idle``, ``busy``, ``stopping`` ...
        uptime: Since it joined [s].
        busy: Time spent computing [s].
        blocked: Time spent waiting to send [s].
        evaluations: Individuals evaluated.
        chunks: Chunks answered.
        queued: Chunks held and not begun.
        malformed: Frames that could not be decoded.
        links: Counters of its links.
        pid: Process id.
        host: Host name.
        tags: Counters of its messages by tag, in alphabetical order; what routers pass on is not among them.
    """

    seat: Seat
    incarnation: Count
    state: Name
    uptime: Seconds
    busy: Seconds
    blocked: Seconds
    evaluations: Word
    chunks: Word
    queued: Count
    malformed: Word
    links: tuple[LinkCounters, ...]
    pid: Count
    host: Name
    tags: tuple[TagCounters, ...] = ()


class Event(Struct, frozen=True, forbid_unknown_fields=True):
    """Something that happened, published by the root for dashboards.

    Attributes:
        name: ``generation``, ``joined``, ``lost``, ``rewired``, ``waiting``, ``finished`` ...
        time: Seconds since the root started.
        detail: Plain values that belong to it.
    """

    name: Name
    time: Seconds
    detail: dict[str, object]


class Wiring(Struct, frozen=True, forbid_unknown_fields=True):
    """The current wiring: which TRAMs are live and which links join them.

    Attributes:
        epoch: Number of this wiring; it selects routes, never validity.
        topology: Name of the shape.
        incarnations: Incarnation of each live TRAM by seat.
        edges: Undirected links as pairs of seats.
    """

    epoch: Count
    topology: Name
    incarnations: dict[Seat, Count]
    edges: tuple[tuple[Seat, Seat], ...]


class JoinRequest(Struct, frozen=True, forbid_unknown_fields=True):
    """A worker asks for a seat.

    Attributes:
        protocol: Its protocol version.
        version: Its tramnet version.
        fingerprint: SHA-256 of its kernels' outputs on fixed vectors.
        host: Its host name.
        pid: Its process id.
        supervisor: Name of the supervisor that can replace it.
    """

    protocol: Count
    version: Name
    fingerprint: Name
    host: Name
    pid: Count
    supervisor: Name


class JoinReply(Struct, frozen=True, forbid_unknown_fields=True):
    """The root gives a seat.

    Attributes:
        run: Number of the run; frames of other runs are dropped.
        seat: The TRAM the worker is now.
        incarnation: Incarnation of that seat.
        root_incarnation: Incarnation of the root.
        setup: The problem; ahead of the wiring, for its bulk has to be among the first values.
        wiring: The wiring in force; one that includes the worker follows its token.
        pace: Speed of the links whose pace frames shall have [Mbaud], or 0 for their own.
    """

    run: Word
    seat: Seat
    incarnation: Count
    root_incarnation: Count
    setup: Setup
    wiring: Wiring
    pace: Pace = 0


class Refusal(Struct, frozen=True, forbid_unknown_fields=True):
    """The root does not do what was asked.

    Attributes:
        reason: What was found and what was expected.
        final: Whether asking again is useless.
    """

    reason: Text
    final: bool


class ControlRequest(Struct, frozen=True, forbid_unknown_fields=True):
    """People steer a running network.

    Attributes:
        action: ``scale``, ``stop`` or ``status``.
        workers: Wanted number of local workers, for ``scale``.
    """

    action: Name
    workers: Count | None = None


class ControlReply(Struct, frozen=True, forbid_unknown_fields=True):
    """What the root did, in words, and its status as plain values.

    Attributes:
        text: One line for people.
        status: Plain values for programs.
    """

    text: Text
    status: dict[str, object]


Work: TypeAlias = Evaluate | Evolve | Track
Outcome: TypeAlias = Evaluated | PopulationMeans | Tracked
Message: TypeAlias = (
    Evaluate
    | Evolve
    | Track
    | Evaluated
    | PopulationMeans
    | PopulationSnapshot
    | Tracked
    | Failed
    | Setup
    | Stop
    | Stats
    | Event
    | Wiring
    | JoinRequest
    | JoinReply
    | Refusal
    | ControlRequest
    | ControlReply
)
