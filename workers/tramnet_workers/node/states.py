"""What a worker does next: a pure state machine, the counterpart of the root's scheduler.

Events in, instructions out; ``service.py`` owns the socket, the clock and the thread that computes.

Rules of this file:

1. A worker is OUTSIDE (it has no seat), BUILDING (it has one, and makes the problem ready), WORKING or GONE.
   It announces itself when the problem is ready, not before, so that nothing slow happens on the root's time.
2. It holds at most one chunk in work and one waiting. What comes beyond this credit, or is held already, is
   dropped and counted; the root's deadlines see to the rest.
3. Membership is (incarnation of the root, seat, incarnation). Work for another membership is dropped. So is the
   outcome of an evaluation that was begun in one: a computation cannot be interrupted, so it may outlive the
   root that asked for it, and meanwhile the evaluator is busy.
4. Every chunk begun is answered, by its outcome or its error, unless the membership ends first. The last outcomes
   are remembered: a chunk that comes again is answered again, for then the root knows that a TRAM on the way was
   lost, perhaps with the answer. A chunk that brings state of its own is computed again, which restores that state.
5. Losing the root ends the membership, not the process; ``Stop`` ends both. After GONE nothing happens.
"""

import enum
from collections import Counter
from typing import TypeAlias

from msgspec import Struct

from tramnet_protocol.messages import (
    Evolve,
    Failed,
    Outcome,
    PopulationSnapshot,
    Setup,
    Work,
    WorkId,
)

CREDIT = 2
REMEMBERED = 2 * CREDIT
"""Outcomes kept to be sent again; the root misses one while others arrive for a moment only."""


class Membership(Struct, frozen=True):
    """Who the worker is to which root.

    Attributes:
        root: Incarnation of the root.
        seat: The seat it was given.
        incarnation: Its incarnation on that seat.
    """

    root: int
    seat: int
    incarnation: int


class Joined(Struct, frozen=True):
    """The root has given a seat and the problem."""

    membership: Membership
    setup: Setup


class Built(Struct, frozen=True):
    """The problem is ready."""

    membership: Membership


class BuildFailed(Struct, frozen=True):
    """The problem cannot be made ready here."""

    membership: Membership
    error: str


class WorkReceived(Struct, frozen=True):
    """A chunk has arrived, addressed to a membership."""

    membership: Membership
    work: Work


class Finished(Struct, frozen=True):
    """The evaluator has an outcome, or the error instead of it."""

    membership: Membership
    answer: Outcome | Failed
    snapshot: PopulationSnapshot | None = None


class RootLost(Struct, frozen=True):
    """The root has fallen silent or closed its transport."""


class StopReceived(Struct, frozen=True):
    """The root or the supervisor wants the worker to end."""

    reason: str


Event: TypeAlias = Joined | Built | BuildFailed | WorkReceived | Finished | RootLost | StopReceived


class Build(Struct, frozen=True):
    """Make the problem ready."""

    membership: Membership
    setup: Setup


class Announce(Struct, frozen=True):
    """Show the root that this worker can take work."""

    membership: Membership


class Start(Struct, frozen=True):
    """Evaluate this chunk."""

    membership: Membership
    work: Work


class Answer(Struct, frozen=True):
    """Send this answer to the root, and ahead of it the snapshot that belongs to it."""

    membership: Membership
    answer: Outcome | Failed
    snapshot: PopulationSnapshot | None = None


class AnswerAgain(Struct, frozen=True):
    """Send an answer once more; whoever delivered the chunk must not wait for that.

    Attributes:
        answer: As it was sent before.
    """

    answer: Answer


class Why(enum.Enum):
    """Why a chunk or an outcome was dropped."""

    FOREIGN = "it belongs to another membership"
    HELD = "it is held already"
    BEYOND_CREDIT = "two chunks are held already"
    UNEXPECTED = "it was not begun"


class Reject(Struct, frozen=True):
    """Drop what has just come, and count it."""

    work: WorkId
    why: Why


class Rejoin(Struct, frozen=True):
    """Ask for a seat again, for as long as patience lasts."""


class Leave(Struct, frozen=True):
    """End the process.

    Attributes:
        reason: Why, for the log.
        failed: Whether it ends with an error.
    """

    reason: str
    failed: bool = False


Task: TypeAlias = Build | Start | Leave
Instruction: TypeAlias = Task | Announce | Answer | AnswerAgain | Reject | Rejoin


class Phase(enum.Enum):
    """Where in its life a worker is."""

    OUTSIDE = enum.auto()
    BUILDING = enum.auto()
    WORKING = enum.auto()
    GONE = enum.auto()


class WorkerStates:
    """The worker's decisions.

    Attributes:
        phase: Where in its life it is.
        membership: Who it is, or None while it is OUTSIDE.
        held: Chunks of this membership received and not answered, at most ``CREDIT``; the first one
            is in work, unless the evaluator is busy with another membership's.
        running: What the evaluator computes, or None.
        rejected: Chunks and outcomes dropped so far.
        remembered: The last answers of this membership by the chunk they belong to, oldest first.
    """

    def __init__(self) -> None:
        self.phase = Phase.OUTSIDE
        self.membership: Membership | None = None
        self.held: list[Work] = []
        self.running: tuple[Membership, WorkId] | None = None
        self.rejected: Counter[Why] = Counter()
        self.remembered: dict[WorkId, Answer] = {}

    def handle(self, event: Event) -> list[Instruction]:
        """Instructions that follow from an event."""
        if self.phase is Phase.GONE:
            return []
        match event:
            case WorkReceived():
                out = self._received(event)
            case Finished():
                out = self._finished(event)
            case Joined():
                out = self._joined(event)
            case Built():
                out = self._built(event.membership)
            case BuildFailed():
                out = self._build_failed(event)
            case RootLost():
                out = self._root_lost()
            case StopReceived():
                out = self._leave(event.reason, failed=False)
        return out

    def _enter(self, phase: Phase, membership: Membership | None) -> None:
        """Begin another part of life; what was held belonged to the last one."""
        self.phase = phase
        self.membership = membership
        self.held = []
        self.remembered = {}

    def _joined(self, event: Joined) -> list[Instruction]:
        if event.membership == self.membership:
            return []
        self._enter(Phase.BUILDING, event.membership)
        return [Build(event.membership, event.setup)]

    def _built(self, membership: Membership) -> list[Instruction]:
        if membership != self.membership or self.phase is not Phase.BUILDING:
            return []
        self.phase = Phase.WORKING
        return [Announce(membership), *self._start()]

    def _build_failed(self, event: BuildFailed) -> list[Instruction]:
        if event.membership != self.membership:
            return []
        return self._leave(event.error, failed=True)

    def _root_lost(self) -> list[Instruction]:
        if self.phase is Phase.OUTSIDE:
            return []
        self._enter(Phase.OUTSIDE, None)
        return [Rejoin()]

    def _leave(self, reason: str, failed: bool) -> list[Instruction]:
        self._enter(Phase.GONE, None)
        return [Leave(reason, failed)]

    def _received(self, event: WorkReceived) -> list[Instruction]:
        identity = event.work.work
        if event.membership != self.membership:
            return self._reject(identity, Why.FOREIGN)
        if any(work.work == identity for work in self.held):
            return self._reject(identity, Why.HELD)
        if identity in self.remembered and not _brings_state(event.work):
            return [AnswerAgain(self.remembered[identity])]
        if len(self.held) == CREDIT:
            return self._reject(identity, Why.BEYOND_CREDIT)
        self.held.append(event.work)
        return self._start()

    def _finished(self, event: Finished) -> list[Instruction]:
        identity = event.answer.work
        if self.running != (event.membership, identity):
            return self._reject(identity, Why.UNEXPECTED)
        self.running = None
        if not self.held or (event.membership, self.held[0].work) != (self.membership, identity):
            return [*self._reject(identity, Why.FOREIGN), *self._start()]
        del self.held[0]
        answer = Answer(event.membership, event.answer, event.snapshot)
        if not isinstance(event.answer, Failed):
            self._remember(identity, answer)
        # Decided first, begun after: the thread that computes sends the answer before it takes the next chunk.
        return [*self._start(), answer]

    def _remember(self, identity: WorkId, answer: Answer) -> None:
        self.remembered.pop(identity, None)
        self.remembered[identity] = answer
        if len(self.remembered) > REMEMBERED:
            del self.remembered[next(iter(self.remembered))]

    def _start(self) -> list[Instruction]:
        """Begin the first chunk held, if the evaluator is free and the problem ready."""
        if self.membership is None or self.phase is not Phase.WORKING:
            return []
        if self.running is not None or not self.held:
            return []
        work = self.held[0]
        self.running = (self.membership, work.work)
        return [Start(self.membership, work)]

    def _reject(self, identity: WorkId, why: Why) -> list[Instruction]:
        self.rejected[why] += 1
        return [Reject(identity, why)]


def _brings_state(work: Work) -> bool:
    """Whether what the worker holds follows from this work alone."""
    return isinstance(work, Evolve) and not (work.problem is None and work.populations is None)
