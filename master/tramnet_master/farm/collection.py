"""Puts the outcome of a work together from the answers to its chunks, and cuts the chunks' content out of it.

Every outcome from the wire is looked at here, once: whether it is of the kind and shape that its work asks for, and
which of its slots hold no usable number. The common case, a work that is answered in one piece, copies nothing.
"""

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from tramnet_protocol.arrays import Array
from tramnet_protocol.errors import ProtocolError
from tramnet_protocol.messages import (
    Evaluate,
    Evaluated,
    Evolve,
    Outcome,
    PopulationMeans,
    PopulationSnapshot,
    Track,
    Tracked,
    Work,
    WorkId,
)

_ANSWER = {Evaluate: Evaluated, Evolve: PopulationMeans, Track: Tracked}


class WrongOutcome(Exception):
    """An outcome is not what its work asks for; says what was found and what was expected."""


class Collection(Protocol):
    """A submitted work and what has come back of it.

    Attributes:
        seconds: Compute time of all accepted answers [s].
        condemned: Slots given up.
        snapshot: What came with the outcome of the populations, where the work asked for that.
    """

    seconds: float
    condemned: list[int]
    snapshot: PopulationSnapshot | None

    @property
    def work(self) -> Work:
        """The submitted work."""

    @property
    def bytes_each(self) -> int:
        """Size of one slot on the wire [B]."""

    @property
    def divisible(self) -> bool:
        """Whether the work may be cut between its slots."""

    def chunk(self, part: WorkId) -> Work:
        """Return the message that asks for a part."""

    def inspect(
        self, outcome: Outcome, snapshot: PopulationSnapshot | None = None
    ) -> tuple[int, ...]:
        """Return the slots of an outcome that hold no usable number.

        Args:
            outcome: What has arrived.
            snapshot: What came ahead of it from the same worker.

        Raises:
            WrongOutcome: It has another kind or shape than its work asks for.
        """

    def accept(self, outcome: Outcome, part: WorkId) -> None:
        """Keep some slots of an inspected outcome; each slot is kept once."""

    def condemn(self, part: WorkId) -> None:
        """Give some slots up."""

    def outcome(self) -> Outcome:
        """Return the whole, once every slot is accepted or condemned."""


def open_collection(work: Work) -> Collection:
    """Return an empty collection for a work."""
    if isinstance(work, Evaluate):
        return _Evaluations(work)
    return _Whole(work)


class _Evaluations:
    """Objectives of a population, slot by slot, or in the one outcome that brings all of them."""

    divisible = True
    snapshot: PopulationSnapshot | None = None

    def __init__(self, work: Evaluate) -> None:
        self.work = work
        self.seconds = 0.0
        self.condemned: list[int] = []
        self._whole: Outcome | None = None

    @property
    def bytes_each(self) -> int:
        return len(self.work.genomes.data) // self.work.work.size

    def chunk(self, part: WorkId) -> Work:
        if part == self.work.work:
            return self.work
        return Evaluate(part, Array.pack(self._genomes[self._slots(part)]))

    def inspect(
        self, outcome: Outcome, snapshot: PopulationSnapshot | None = None
    ) -> tuple[int, ...]:
        finite = np.isfinite(_objectives_of(outcome))
        if np.count_nonzero(finite) == len(finite):
            return ()
        return tuple((outcome.work.first + np.flatnonzero(~finite)).tolist())

    def accept(self, outcome: Outcome, part: WorkId) -> None:
        self.seconds += outcome.seconds * part.size / outcome.work.size
        if part == self.work.work == outcome.work:
            self._whole = outcome
            return
        inside = slice(part.first - outcome.work.first, part.last - outcome.work.first)
        self._objectives[self._slots(part)] = _objectives_of(outcome)[inside]

    def condemn(self, part: WorkId) -> None:
        self.condemned.extend(range(part.first, part.last))

    def outcome(self) -> Outcome:
        if self._whole is not None:
            return self._whole
        objectives = self._objectives
        if self.condemned:
            # The worst of the others: a finite number, and the same whoever evaluated them.
            objectives = np.nan_to_num(objectives, nan=_worst(objectives))
        return Evaluated(self.work.work, Array.pack(objectives), self.seconds)

    @cached_property
    def _genomes(self) -> NDArray[np.generic]:
        return self.work.genomes.unpack()

    @cached_property
    def _objectives(self) -> NDArray[np.float64]:
        """Objectives accepted so far, of shape (size,); NaN where there is none yet."""
        return np.full(self.work.work.size, np.nan)

    def _slots(self, part: WorkId) -> slice:
        first = self.work.work.first
        return slice(part.first - first, part.last - first)


class _Whole:
    """A work that one worker does in one piece."""

    divisible = False

    def __init__(self, work: Work) -> None:
        self.work = work
        self.seconds = 0.0
        self.condemned: list[int] = []
        self.snapshot: PopulationSnapshot | None = None
        self._outcome: Outcome | None = None

    @property
    def bytes_each(self) -> int:
        return sum(len(array.data) for array in _arrays(self.work)) // self.work.work.size

    def chunk(self, part: WorkId) -> Work:
        assert part == self.work.work, "an indivisible work is not cut"
        return self.work

    def inspect(
        self, outcome: Outcome, snapshot: PopulationSnapshot | None = None
    ) -> tuple[int, ...]:
        if not isinstance(outcome, _ANSWER[type(self.work)]):
            raise WrongOutcome(f"found {type(outcome).__name__} for {type(self.work).__name__}")
        wanted = isinstance(self.work, Evolve) and self.work.snapshot
        self.snapshot = _belonging(snapshot, outcome.work) if wanted else None
        try:
            usable = all(np.isfinite(a).all() for a in _told(self.work, outcome, self.snapshot))
        except ProtocolError as error:
            raise WrongOutcome(str(error)) from error
        work = outcome.work
        return () if usable else tuple(range(work.first, work.last))

    def accept(self, outcome: Outcome, part: WorkId) -> None:
        assert part == self.work.work, "an indivisible work is answered whole"
        self._outcome = outcome
        self.seconds += outcome.seconds

    def condemn(self, part: WorkId) -> None:
        self.condemned.extend(range(part.first, part.last))

    def outcome(self) -> Outcome:
        assert self._outcome is not None, "a condemned whole has no outcome"
        return self._outcome


def _objectives_of(outcome: Outcome) -> NDArray[np.float64]:
    if not isinstance(outcome, Evaluated):
        raise WrongOutcome(f"found {type(outcome).__name__}, expected Evaluated")
    try:
        objectives = outcome.objectives.unpack()
    except ProtocolError as error:
        raise WrongOutcome(str(error)) from error
    expected = (outcome.work.size,)
    if objectives.dtype != np.float64 or objectives.shape != expected:
        raise WrongOutcome(
            f"found {objectives.dtype} objectives of shape {objectives.shape}, "
            f"expected float64 of shape {expected}"
        )
    return cast("NDArray[np.float64]", objectives)


def _belonging(snapshot: PopulationSnapshot | None, work: WorkId) -> PopulationSnapshot:
    """Return a snapshot that is there and of that work.

    Raises:
        WrongOutcome: It is not.
    """
    if snapshot is None or snapshot.work != work:
        found = "none" if snapshot is None else f"that of {snapshot.work}"
        raise WrongOutcome(f"found {found}, expected the snapshot that {work} asks for")
    return snapshot


def _told(
    work: Work, outcome: Outcome, snapshot: PopulationSnapshot | None
) -> Iterator[NDArray[np.generic]]:
    """Return what an outcome and its snapshot tell, as arrays of the types and shapes that the work asks for.

    Raises:
        MalformedFrame: One has another.
    """
    size = work.work.size
    if isinstance(work, Track) and isinstance(outcome, Tracked):
        yield outcome.path.unpack("<f8", (size, *work.posture.shape))
        yield outcome.cost.unpack("<f8", (size,))
    if isinstance(work, Evolve) and isinstance(outcome, PopulationMeans):
        over = work.snapshot and outcome.means.shape[:1] == (
            0,
        )  # nobody is told after the last generation
        if not over:
            yield outcome.means.unpack("<f8", (size, work.means.shape[2]))
        if work.work.step > 0:
            yield outcome.ranking.unpack("<f8", (size, None))
    if snapshot is not None:
        populations = snapshot.populations.unpack("|u1", (size, None, None))
        yield populations
        yield snapshot.fitness.unpack("<f8", (size, populations.shape[1]))


def _arrays(message: Work) -> Sequence[Array]:
    fields = (getattr(message, name) for name in message.__struct_fields__)
    return [field for field in fields if isinstance(field, Array)]


def _worst(objectives: NDArray[np.float64]) -> float:
    usable = objectives[np.isfinite(objectives)]
    return float(usable.max()) if len(usable) else float(np.finfo(np.float64).max)
