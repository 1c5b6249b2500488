"""One search of the multi-population genetic algorithm: its steps, what was told, and what can restore it.

Step g of a search evaluates generation g and rates generation g - 1, so a search of G generations has steps 0 to G.
The last snapshot of all populations and all values since then are kept, so that any share of the populations can be
restored on another worker.
"""

from collections.abc import Mapping
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from tramnet_master.engines.engine import State, scalar
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evolve, Kind, PopulationMeans, PopulationSnapshot, WorkId

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


class RunningSearch:
    """A search on its way.

    Args:
        number: Number of the search in its run.
        search: What is to be searched.

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
            self.rankings.append(_joined([self._told[first].ranking for first in order]))
        if self.step < self.search.generations:
            self._values.append(_joined([self._told[first].means for first in order]))
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
        self.step = int(scalar(state["step"]))
        self.saved, self.fitness = np.asarray(state["saved"]), np.asarray(state["saved_fitness"])
        self._saved_step = int(scalar(state["saved_step"]))
        self._values = list(floats(state["values"]))
        self.rankings = list(floats(state["rankings"]))

    def _keep_all(self, snapshots: list[PopulationSnapshot]) -> None:
        """Replace the saved populations by snapshots of all of them, and forget the values before."""
        if len(snapshots) < len(self._expected):
            return
        self.saved = np.concatenate([s.populations.unpack() for s in snapshots])
        self.fitness = np.concatenate([s.fitness.unpack() for s in snapshots])
        self._values = self._values[self.step - self._saved_step :]
        self._saved_step = self.step


def _joined(arrays: list[Array]) -> Floats:
    rows: Floats = np.concatenate([array.unpack() for array in arrays]).astype(np.float64)
    return rows


def floats(value: int | float | str | NDArray[np.generic]) -> Floats:
    """Return an array of a saved state."""
    return np.asarray(value, dtype=np.float64)
