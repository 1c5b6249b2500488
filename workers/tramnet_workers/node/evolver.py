"""Populations that this worker holds, and the work of bringing them one generation further.

Step 0 of an ``Evolve`` begins; step g rates generation g - 1 with everybody's values of it and evaluates
generation g; the last step rates the last generation. Work that brings the problem along is for a worker that
need not hold anything: it begins, or restores a snapshot, and replays the generations since with the values that
come with it. The answers are the same bits either way.
"""

import time
from collections.abc import Mapping

import msgspec
import numpy as np
from msgspec import Struct

from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import (
    Evolve,
    Outcome,
    PopulationMeans,
    PopulationSnapshot,
    Word,
    Work,
)
from tramnet_workers.errors import InvalidParameters, UnsuitableWork
from tramnet_workers.evolution.coupling import CoupledProblem
from tramnet_workers.evolution.population import Advance, Floats, PopulationState
from tramnet_workers.mpga_settings import Connect, GeneticSettings
from tramnet_workers.problems.registry import build

_NOTHING = np.empty((0, 0))


class Colony(Struct, frozen=True, forbid_unknown_fields=True):
    """What populations evolve on, and how; travels with work for whoever holds nothing.

    Attributes:
        problem: Name of the problem in the registry.
        parameters: Its parameters.
        genetic: Settings of the genetic algorithm.
        seed: Seed of the run.
        stream: Number of the first population's random stream.
    """

    problem: str
    parameters: dict[str, object]
    genetic: dict[str, object]
    seed: Word
    stream: Word

    def plain(self) -> dict[str, object]:
        """Return it as plain values, for the wire."""
        values: dict[str, object] = msgspec.to_builtins(self)
        return values

    @classmethod
    def from_plain(cls, values: Mapping[str, object]) -> "Colony":
        """Return what ``plain`` described.

        Raises:
            InvalidParameters: It is no colony.
        """
        try:
            return msgspec.convert(dict(values), cls, strict=True)
        except msgspec.ValidationError as error:
            raise InvalidParameters("mpga", str(error)) from error

    def populations(self, first: int, last: int) -> PopulationState:
        """Return populations ``first`` to ``last``, exclusive, before their first generation.

        Raises:
            UnknownProblem: The problem is not installed here.
            InvalidParameters: A parameter or setting is wrong.
            UnsuitableWork: It has no such populations.
        """
        problem = build(self.problem, self.parameters)
        if not isinstance(problem, CoupledProblem) or last > problem.n_populations:
            raise UnsuitableWork(
                self.problem, f"populations {first} to {last - 1}", "populations of the problem"
            )
        genetic = GeneticSettings.from_parameters(self.genetic)
        return PopulationState(problem, genetic, self.seed, first, last, self.stream)


class Evolver:
    """Holds populations; ``Evolve`` is its kind of work.

    Args:
        name: Name of the problem this worker was set up for.
        problem: That problem; what comes with the work may be another of its kind.
    """

    def __init__(self, name: str, problem: CoupledProblem) -> None:
        self._name = name
        self._held: dict[tuple[int, int, int], PopulationState] = {}  # (run of the method, range)
        _warm_up(problem)

    def compute(self, work: Work) -> Outcome:
        """Bring populations one generation further; see ``Evaluator.compute``."""
        if not isinstance(work, Evolve):
            raise UnsuitableWork(self._name, type(work).__name__, "Evolve")
        started = time.perf_counter()
        state = self._hold(work)
        values = _values(work, self._name)
        first = work.work.step == 0
        advance = Advance(_NOTHING, state.begin()) if first else state.advance(values[-1])
        told = _NOTHING if advance.values is None else advance.values
        seconds = time.perf_counter() - started
        return PopulationMeans(work.work, Array.pack(told), Array.pack(advance.ranking), seconds)

    def snapshot(self, work: Work) -> PopulationSnapshot | None:
        """Return the populations that the work has brought further, if it asks for them."""
        if not isinstance(work, Evolve) or not work.snapshot:
            return None
        state = self._held[_place(work)]
        return PopulationSnapshot(
            work.work, Array.pack(state.snapshot()), Array.pack(state.fitness)
        )

    def _hold(self, work: Evolve) -> PopulationState:
        """Return the populations as they are before the step that is asked for."""
        if work.problem is not None:
            self._held[_place(work)] = self._restore(work, Colony.from_plain(work.problem))
        state = self._held.get(_place(work))
        if state is None or state.generation != work.work.step - 1:
            at = "none of them" if state is None else f"generation {state.generation}"
            which = f"populations {work.work.first} to {work.work.last - 1}"
            expected = f"{which} at generation {work.work.step - 1}"
            raise UnsuitableWork(self._name, at, expected)
        return state

    def _restore(self, work: Evolve, colony: Colony) -> PopulationState:
        for place in [place for place in self._held if _overlap(place, _place(work))]:
            del self._held[place]
        state = colony.populations(work.work.first, work.work.last)
        step, values = work.work.step, _values(work, self._name)
        if step == 0:
            return state
        known = step - len(values)  # the generation that is restored
        if work.populations is None:
            if known != 0:
                raise UnsuitableWork(self._name, f"{len(values)} generations", f"{step}")
            state.begin()
        else:
            state.restore(known, np.asarray(work.populations.unpack("|u1"), np.uint8))
        for row in values[:-1]:
            state.advance(row)
        return state


def _place(work: Evolve) -> tuple[int, int, int]:
    return work.work.population, work.work.first, work.work.last


def _overlap(place: tuple[int, int, int], other: tuple[int, int, int]) -> bool:
    """Whether one replaces the other: of two runs of the method, only the later is still wanted."""
    same_run = place[0] == other[0]
    return not same_run or (place[1] < other[2] and other[1] < place[2])


def _values(work: Evolve, name: str) -> Floats:
    """Return the values that come with work, of shape (generations, populations, traits)."""
    values = work.means.unpack()
    least = 1 if work.work.step > 0 else 0
    if values.ndim != 3 or values.dtype != np.float64 or len(values) < least:
        found = f"values of {values.dtype} and shape {values.shape}"
        raise UnsuitableWork(name, found, "float64 of shape (generations, populations, traits)")
    return values.astype(np.float64, copy=False)


def _warm_up(problem: CoupledProblem) -> None:
    """Evolve small populations for nothing, so that the compiled kernels are loaded."""
    for connect in Connect:
        genetic = GeneticSettings(population_size=4, generations=2, connect=connect)
        state = PopulationState(problem, genetic, 0, 0, 1)
        values = np.repeat(state.begin(), problem.n_populations, axis=0)
        values.setflags(write=False)
        state.advance(values)
        state.snapshot()
