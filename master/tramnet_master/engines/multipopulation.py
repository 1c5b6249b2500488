"""The multi-population genetic algorithm on the network: workers hold the populations, the root what connects them.

Kim & Khosla (1992), section 4. In each generation a worker sends the connecting values of its populations and is
sent those of all; no individual crosses a link. A run is one *search* or, in Progressive Design, several: what the
next one searches follows from what the last one found. Step g of a search evaluates generation g and rates
generation g - 1, so a search of G generations has steps 0 to G.

So that populations can be restored elsewhere, the root keeps their last snapshot, taken every ``SNAPSHOT_PERIOD``
generations, and all values since. Fitness is maximised; objectives, here and in ``history.csv``, are its negative:
the best and the worst of the populations' best individuals, and the mean of all individuals.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from tramnet_master.engines.engine import Best, GenerationRow, HoldsPopulations, State
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import (
    Evolve,
    Kind,
    Outcome,
    PopulationMeans,
    PopulationSnapshot,
    Work,
    WorkId,
)

SNAPSHOT_PERIOD = 10
"""Generations between two snapshots of all populations."""

Floats = NDArray[np.float64]


class Search(NamedTuple):
    """What is to be searched.

    Attributes:
        name: What it is called, ``design`` for one.
        populations: Number t of populations.
        population_size: Number m of individuals in each.
        generations: Number G of generations.
        n_traits: Number of traits of an individual.
        n_terms: Number of terms of its fitness.
        problem: What the populations evolve on, as plain values for workers.
    """

    name: str
    populations: int
    population_size: int
    generations: int
    n_traits: int
    n_terms: int
    problem: dict[str, object]


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found.

    Attributes:
        name: What it is called.
        rankings: Of each generation and population: largest and mean fitness, then traits and terms of the best
            individual, of shape (G, t, 2 + n_traits + n_terms).
        n_traits: Number of traits.
    """

    name: str
    rankings: Floats
    n_traits: int

    @property
    def best(self) -> Floats:
        """Largest fitness F_i,max, of shape (G, t); Fig. 9."""
        return self.rankings[:, :, 0]

    @property
    def mean(self) -> Floats:
        """Mean fitness F_i,mean, of shape (G, t)."""
        return self.rankings[:, :, 1]

    @property
    def traits(self) -> Floats:
        """Traits of the best individuals, of shape (G, t, n_traits); Fig. 10 is the sum of their link lengths."""
        return self.rankings[:, :, 2 : 2 + self.n_traits]

    @property
    def terms(self) -> Floats:
        """Terms of the best individuals of the last generation, of shape (t, n_terms)."""
        return self.rankings[-1, :, 2 + self.n_traits :]


Follow = Callable[[Sequence[Floats]], Search | None]
"""Returns the next search, given the final traits of all searches before it, or None at the end."""


class MultiPopulationEngine(HoldsPopulations):
    """Evolve connected populations, in one search after the other.

    Args:
        follow: Tells what to search.
        generations: Number of generations that are foreseen, for progress.
    """

    def __init__(self, follow: Follow) -> None:
        self._follow = follow
        self._finals: list[Floats] = []  # traits of the best individuals at the end of each search
        self._done: list[Found] = []
        self._evaluations = self._generations = 0  # of the searches that are done
        first = follow([])
        assert first is not None, "there is something to search"
        self._current: _Current | None = _Current(0, first)
        self._workers = 1
        self._last: tuple[NDArray[np.generic], NDArray[np.generic]] | None = None
        self._best: Best | None = None

    @property
    def finished(self) -> bool:
        """Whether no search is left."""
        return self._current is None

    @property
    def generation(self) -> int:
        """Number of generations completed, over all searches."""
        return self._generations + (self._current.completed if self._current else 0)

    @property
    def evaluations(self) -> int:
        """Number of individuals evaluated in completed generations."""
        return self._evaluations + (self._current.evaluations if self._current else 0)

    @property
    def best(self) -> Best:
        """The generation of the latest search with the best mean of the populations' best, and their traits."""
        assert self._best is not None, "no generation is complete yet"
        return self._best

    @property
    def found(self) -> Sequence[Found]:
        """What the searches found that are done."""
        return self._done

    @property
    def finals(self) -> Sequence[Floats]:
        """Traits of the populations' best individuals at the end of each search, each of shape (t, n_traits)."""
        return self._finals

    def spread(self, workers: int) -> None:
        """Divide the populations among so many workers, from the next generation on."""
        self._workers = workers

    def ask(self) -> list[Work]:
        """Return the next step of every share of the populations, once."""
        if self._current is None or self._current.waiting:
            return []
        return list(self._current.begin_step(self._workers))

    def tell(self, work: Work, outcome: Outcome) -> list[GenerationRow]:
        """Take what some populations tell; the last of a generation completes it."""
        assert isinstance(outcome, PopulationMeans)
        current = self._current
        assert current is not None, "nothing was asked for"
        if not current.take(work.work, outcome):
            return []
        if current.step == 1:
            return []  # generation 0 is evaluated and not yet rated
        row = self._row(current.rankings[-1])
        if current.finished:
            self._conclude(current)
        return [row]

    def restate(self, work: Evolve) -> Evolve:
        """Return work with the last snapshot, the values since and what the populations evolve on."""
        assert self._current is not None, "nothing was asked for"
        return self._current.restate(work)

    def keep(self, snapshot: PopulationSnapshot) -> None:
        """Keep a snapshot until all populations of its generation have told."""
        assert self._current is not None, "nothing was asked for"
        self._current.snapshots[snapshot.work.first] = snapshot

    def final_arrays(self) -> Sequence[NDArray[np.generic]]:
        """Return chromosomes, of shape (t, m, bytes), and fitness of the last populations, of shape (t, m)."""
        assert self._last is not None, "no search is done yet"
        return self._last

    def state(self) -> State:
        """Return what has been found, the last snapshot and the values since."""
        state: State = {"searches": len(self._done)}
        for i, found in enumerate(self._done):
            state[f"rankings_{i}"] = found.rankings
        if self._last is not None:
            state["last_genomes"], state["last_fitness"] = self._last
        if self._current is not None:
            state |= self._current.state()
        return state

    def restore(self, state: Mapping[str, int | float | str | NDArray[np.generic]]) -> None:
        """Go on from a saved generation."""
        searches = int(_scalar(state["searches"]))
        for i in range(searches):
            assert self._current is not None, "the searches of a run are those of its checkpoint"
            self._current.rankings = list(_floats(state[f"rankings_{i}"]))
            self._note_best(self._current.rankings)
            self._close(self._current)
        if "last_genomes" in state:
            self._last = np.asarray(state["last_genomes"]), np.asarray(state["last_fitness"])
        if self._current is not None:
            self._current.restore(state)
            self._note_best(self._current.rankings)

    def _conclude(self, current: "_Current") -> None:
        self._last = current.saved, current.fitness
        self._close(current)

    def _close(self, current: "_Current") -> None:
        """Note what a search found, and begin the next one."""
        search = current.search
        found = Found(search.name, np.array(current.rankings), search.n_traits)
        self._done.append(found)
        self._finals.append(found.traits[-1])
        self._evaluations += current.evaluations
        self._generations += current.completed
        following = self._follow(self._finals)
        self._current = _Current(len(self._done), following) if following is not None else None

    def _note_best(self, rankings: Sequence[Floats]) -> None:
        """Find the best generation of a search anew: other searches have other terms."""
        self._best = None
        for i, ranking in enumerate(rankings):
            self._compare(ranking, self._generations + i + 1)

    def _compare(self, ranking: Floats, generation: int) -> float:
        objective = -math.fsum(ranking[:, 0].tolist()) / len(ranking)
        if self._best is None or objective < self._best.objective:
            traits = ranking[:, 2:].copy()
            traits.setflags(write=False)
            self._best = Best(objective, generation, traits)
        return self._best.objective

    def _row(self, ranking: Floats) -> GenerationRow:
        assert self._current is not None
        if self._current.completed == 1:
            self._best = None
        so_far = self._compare(ranking, self.generation)
        best, mean = ranking[:, 0].tolist(), math.fsum(ranking[:, 1].tolist()) / len(ranking)
        return GenerationRow(
            self.generation, self.evaluations, -max(best), -mean, -min(best), so_far
        )


class _Current:
    """A search on its way.

    Attributes:
        step: Next step to be begun, or the one on its way.
        rankings: Rankings of the generations completed, each of shape (t, columns).
        snapshots: Snapshots of the step on its way, by first population.
        saved: Snapshot of all populations, packed, or an empty array.
        fitness: Fitness that came with it.
    """

    def __init__(self, number: int, search: Search) -> None:
        self.search, self._number = search, number
        self.step = 0
        self.rankings: list[Floats] = []
        self.snapshots: dict[int, PopulationSnapshot] = {}
        self.saved: NDArray[np.generic] = np.empty((0, 0, 0), np.uint8)
        self.fitness: NDArray[np.generic] = np.empty((0, 0))
        self._saved_step = 0  # generation of ``saved``; 0 stands for the beginning
        self._values: list[Floats] = []  # of generations from ``_saved_step`` on
        self._expected: dict[int, int] = {}  # first and last population of the shares on their way
        self._told: dict[int, PopulationMeans] = {}

    @property
    def waiting(self) -> bool:
        """Whether a step is on its way."""
        return bool(self._expected)

    @property
    def completed(self) -> int:
        """Number of generations rated."""
        return len(self.rankings)

    @property
    def evaluations(self) -> int:
        """Number of individuals in them."""
        return self.completed * self.search.populations * self.search.population_size

    @property
    def finished(self) -> bool:
        """Whether all generations are rated."""
        return self.completed == self.search.generations

    def begin_step(self, workers: int) -> list[Evolve]:
        """Return the next step of each share of the populations, for workers that hold them."""
        t, shares = self.search.populations, min(workers, self.search.populations)
        cuts = [t * i // shares for i in range(shares + 1)]
        self._expected = dict(pairwise(cuts))
        last = self.step == self.search.generations
        due = last or (self.step > 0 and self.step % SNAPSHOT_PERIOD == 0)
        values = np.array(self._values[-1:]).reshape(-1, t, self.search.n_traits)
        means = Array.pack(values)
        return [
            Evolve(WorkId(Kind.EVOLVE, self._number, self.step, first, end), means, due)
            for first, end in self._expected.items()
        ]

    def take(self, work: WorkId, told: PopulationMeans) -> bool:
        """Take what a share tells; return whether that completes the step."""
        self._told[work.first] = told
        if len(self._told) < len(self._expected):
            return False
        order = sorted(self._told)
        self._keep_all([self.snapshots[first] for first in order if first in self.snapshots])
        if self.step > 0:
            self.rankings.append(self._joined([self._told[first].ranking for first in order]))
        if self.step < self.search.generations:
            self._values.append(self._joined([self._told[first].means for first in order]))
        self._told, self._expected, self.snapshots = {}, {}, {}
        self.step += 1
        return True

    def restate(self, work: Evolve) -> Evolve:
        """Return work with all that is needed to do it from scratch."""
        step, t = work.work.step, self.search.populations
        values = np.array(self._values[: step - self._saved_step])
        populations = None
        if len(self.saved):
            populations = Array.pack(self.saved[work.work.first : work.work.last])
        return replace(
            work,
            means=Array.pack(values.reshape(-1, t, self.search.n_traits)),
            populations=populations,
            problem=self.search.problem,
        )

    def state(self) -> State:
        """Return everything needed to go on from the last completed step."""
        t, n_traits = self.search.populations, self.search.n_traits
        return {
            "step": self.step,
            "saved": self.saved,
            "saved_step": self._saved_step,
            "saved_fitness": self.fitness,
            "values": np.array(self._values).reshape(-1, t, n_traits),
            "rankings": np.array(self.rankings).reshape(len(self.rankings), t, -1)
            if self.rankings
            else np.empty((0, 0, 0)),
        }

    def restore(self, state: Mapping[str, int | float | str | NDArray[np.generic]]) -> None:
        """Take back what ``state`` returned."""
        self.step = int(_scalar(state["step"]))
        self.saved, self.fitness = np.asarray(state["saved"]), np.asarray(state["saved_fitness"])
        self._saved_step = int(_scalar(state["saved_step"]))
        self._values = list(_floats(state["values"]))
        self.rankings = list(_floats(state["rankings"]))

    def _keep_all(self, snapshots: list[PopulationSnapshot]) -> None:
        """Replace the saved populations by snapshots of all of them, and forget the values before."""
        if len(snapshots) < len(self._expected):
            return
        self.saved = np.concatenate([s.populations.unpack() for s in snapshots])
        self.fitness = np.concatenate([s.fitness.unpack() for s in snapshots])
        self._values = self._values[self.step - self._saved_step :]
        self._saved_step = self.step

    @staticmethod
    def _joined(arrays: list[Array]) -> Floats:
        rows: Floats = np.concatenate([array.unpack() for array in arrays]).astype(np.float64)
        return rows


def _floats(value: int | float | str | NDArray[np.generic]) -> Floats:
    return np.asarray(value, dtype=np.float64)


def _scalar(value: int | float | str | NDArray[np.generic]) -> int | float:
    assert isinstance(value, int | float), f"{value!r} is not a number"
    return value
