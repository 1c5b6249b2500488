"""The multi-population genetic algorithm on the network: workers hold the populations, the root what connects them.

Kim & Khosla (1992), section 4. In each generation a worker sends the connecting values of its populations and is
sent those of all; no individual crosses a link. A run is one *search* or, in Progressive Design, several: what the
next one searches follows from what the last one found.

Fitness is maximised; objectives, here and in ``history.csv``, are its negative: the best and the worst of the
populations' best individuals, and the mean of all individuals.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tramnet_master.engines.engine import Best, GenerationRow, HoldsPopulations, State, scalar
from tramnet_master.engines.population_search import RunningSearch, Search, floats
from tramnet_protocol.messages import Evolve, Outcome, PopulationMeans, PopulationSnapshot, Work

Floats = NDArray[np.float64]


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
    """

    def __init__(self, follow: Follow) -> None:
        self._follow = follow
        self._finals: list[Floats] = []  # traits of the best individuals at the end of each search
        self._done: list[Found] = []
        self._evaluations = self._generations = 0  # of the searches that are done
        first = follow([])
        assert first is not None, "there is something to search"
        self._current: RunningSearch | None = RunningSearch(0, first)
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
        searches = int(scalar(state["searches"]))
        for i in range(searches):
            assert self._current is not None, "the searches of a run are those of its checkpoint"
            self._current.rankings = list(floats(state[f"rankings_{i}"]))
            self._note_best(self._current.rankings)
            self._close(self._current)
        if "last_genomes" in state:
            self._last = np.asarray(state["last_genomes"]), np.asarray(state["last_fitness"])
        if self._current is not None:
            self._current.restore(state)
            if self._current.rankings:
                self._note_best(self._current.rankings)

    def _conclude(self, current: RunningSearch) -> None:
        self._last = current.saved, current.fitness
        self._close(current)

    def _close(self, current: RunningSearch) -> None:
        """Note what a search found, and begin the next one."""
        search = current.search
        found = Found(search.name, np.array(current.rankings), search.n_traits)
        self._done.append(found)
        self._finals.append(found.traits[-1])
        self._evaluations += current.evaluations
        self._generations += current.completed
        following = self._follow(self._finals)
        self._current = RunningSearch(len(self._done), following) if following is not None else None

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
