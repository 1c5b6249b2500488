"""What the scheduler is told, and what it tells the dispatcher to do.

Everything here is a frozen value, so that the life of a farm is a list: events in, instructions out. A story
in a test, a fault in the simulation and a frame from the wire are the same event to the scheduler.

A worker is always named by its ``Tram``: the seat alone would confuse a worker with its successor.
"""

import enum
from collections.abc import Mapping
from typing import NamedTuple, TypeAlias

from msgspec import Struct

from tramnet_protocol.messages import WorkId


class Tram(NamedTuple):
    """One life of a worker.

    Attributes:
        seat: Its seat; seats are reused.
        incarnation: Which life on that seat.
    """

    seat: int
    incarnation: int


class WorkSubmitted(Struct, frozen=True):
    """The engine wants this work done.

    Open works must not overlap. Submitting a work again after ``Orphaned`` releases it; it must then carry
    the state it needs, for it may go to any worker.

    Attributes:
        work: Identity; its slots are the individuals, populations or points from ``first`` to ``last``.
        bytes_each: Size of one slot on the wire [byte].
        divisible: Whether it may be cut between its slots.
        affinity: The TRAM that holds the state it needs, or None where any will do.
        generations: How many of them each slot takes to compute: more than one where a restored state is replayed.
    """

    work: WorkId
    bytes_each: int = 0
    divisible: bool = True
    affinity: Tram | None = None
    generations: int = 1


class WorkerReady(Struct, frozen=True):
    """A worker has built the problem and can take work.

    Attributes:
        tram: The worker.
        fresh: Whether its process never had work; one that was cut off and has come back had.
    """

    tram: Tram
    fresh: bool = True


class WorkerLeaving(Struct, frozen=True):
    """The root has asked this worker to go: its work goes elsewhere and its end is nobody's fault."""

    tram: Tram


class WorkerLost(Struct, frozen=True):
    """The worker is gone: its token or its transport has disappeared.

    Attributes:
        tram: The worker.
        others: Those lost together with it: a machine, or a supervisor's all. Nothing is given to one of them for
            being told of it a moment later.
    """

    tram: Tram
    others: tuple[Tram, ...] = ()


class Answered(Struct, frozen=True):
    """An outcome has arrived and has the shape it should have.

    Attributes:
        tram: Who answers.
        work: The chunk answered.
        seconds: Compute time as the worker states it [s].
        bad: Slots whose values are unusable, NaN for one.
    """

    tram: Tram
    work: WorkId
    seconds: float
    bad: tuple[int, ...] = ()


class Raised(Struct, frozen=True):
    """The evaluation of a chunk raised an error, or its outcome is of the wrong shape.

    Attributes:
        tram: Who says so.
        work: The chunk.
        error: The error, in words.
    """

    tram: Tram
    work: WorkId
    error: str


class Rewired(Struct, frozen=True):
    """There is a new wiring; to be told before the worker that joined or was lost.

    Attributes:
        routes: For each live worker that is not linked with the root, the TRAMs that frames pass on their way to it
            or back, those nearest the root first.
    """

    routes: Mapping[Tram, tuple[Tram, ...]]


class Tick(Struct, frozen=True):
    """Time has passed. Deliver first what has arrived: an answer in the inbox is not overdue.

    Attributes:
        silent: Live workers whose heartbeat is missing.
    """

    silent: frozenset[Tram] = frozenset()


Event: TypeAlias = (
    WorkSubmitted | WorkerReady | WorkerLeaving | WorkerLost | Answered | Raised | Rewired | Tick
)


class Cause(enum.Enum):
    """Why a worker is to be replaced."""

    OVERDUE = "its chunk is overdue"
    STALLED = "it has fallen silent while work is overdue that it has or passes on"
    FRESH_PROCESS = "a suspect needs a process that never had other work"


class Reason(enum.Enum):
    """Why an answer was dropped."""

    CLOSED = "the work is not open"
    STRANGER = "this worker was not given the work"
    DUPLICATE = "this worker has answered before"
    LATE_ERROR = "an error from a worker the work was taken from"


class Send(Struct, frozen=True):
    """Send this chunk to that worker."""

    tram: Tram
    work: WorkId


class Repeat(Struct, frozen=True):
    """Send this chunk to that worker once more: a TRAM on the way was lost, perhaps with it or with the answer.

    Whoever has it already goes on, and whoever has answered it answers again.
    """

    tram: Tram
    work: WorkId


class Accept(Struct, frozen=True):
    """Keep a part of the outcome that has just arrived: copy the slots of ``part`` out of ``work``'s."""

    tram: Tram
    work: WorkId
    part: WorkId


class Drop(Struct, frozen=True):
    """Ignore the answer that has just arrived, and count it."""

    tram: Tram
    work: WorkId
    reason: Reason


class Replace(Struct, frozen=True):
    """Have the worker's supervisor end it and start another; one that has stalled is wired out at once.

    Attributes:
        tram: The worker; it is given no more work.
        cause: Why.
        work: The overdue chunk, where there is one.
    """

    tram: Tram
    cause: Cause
    work: WorkId | None = None


class Condemn(Struct, frozen=True):
    """Give this work up: alone, in fresh processes, it has failed too often.

    Attributes:
        work: One individual, or an indivisible work.
        reason: What happened to it last.
    """

    work: WorkId
    reason: str


class Resolved(Struct, frozen=True):
    """Every slot of a submitted work has been accepted or condemned."""

    work: WorkId


class Orphaned(Struct, frozen=True):
    """The state a work needs is lost or under suspicion: submit it again, with the state.

    Attributes:
        work: The submitted work; it stays open, but waits for the engine.
        tram: Who held the state.
    """

    work: WorkId
    tram: Tram


class Waiting(Struct, frozen=True):
    """There is open work and no worker to do it."""


class Resumed(Struct, frozen=True):
    """There is a worker again, or nothing left to wait for."""


Instruction: TypeAlias = (
    Send | Repeat | Accept | Drop | Replace | Condemn | Resolved | Orphaned | Waiting | Resumed
)
