"""CMA-ES (package ``cma``) on the farm: it draws candidates, workers evaluate them, it is told what was found.

What it has drawn and learnt follows from its seed and from all objectives it was told, so these are its state; a
resumed run tells them again.
"""

from collections.abc import Callable, Mapping, Sequence

import cma
import numpy as np
from numpy.typing import NDArray

from tramnet_master.engines.engine import Best, Champion, GenerationRow, State
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evaluate, Evaluated, Kind, Outcome, Work, WorkId

Floats = NDArray[np.float64]


class CovarianceEngine:
    """Minimise by CMA-ES until it stops by itself or a budget is spent.

    Args:
        start: Begins the search anew.
        budget: Individuals to be evaluated, at most; at least one generation is.
    """

    def __init__(self, start: Callable[[], cma.CMAEvolutionStrategy], budget: int) -> None:
        self._strategy, self._budget = start(), budget
        self._size = int(self._strategy.popsize)
        self._candidates: list[Floats] = []
        self._genomes = np.empty((0, 0))
        self._told: list[Floats] = []
        self._champion = Champion()

    @property
    def population_size(self) -> int:
        """Individuals in a generation."""
        return self._size

    @property
    def generations(self) -> int:
        """Largest number of generations."""
        return max(1, self._budget // self._size)

    @property
    def finished(self) -> bool:
        """Whether the search has converged, or the budget is spent."""
        done = len(self._told)
        return done >= self.generations or (done > 0 and bool(self._strategy.stop()))

    @property
    def generation(self) -> int:
        """Number of generations completed."""
        return len(self._told)

    @property
    def evaluations(self) -> int:
        """Number of individuals evaluated."""
        return len(self._told) * self._size

    @property
    def best(self) -> Best:
        """The best individual so far."""
        assert self._champion.best is not None, "no generation is complete yet"
        return self._champion.best

    def ask(self) -> list[Work]:
        """Return the candidates of the next generation, once."""
        if self._candidates or self.finished:
            return []
        self._draw()
        work = WorkId(Kind.EVALUATE, 0, self.generation + 1, 0, self._size)
        return [Evaluate(work, Array.pack(self._genomes))]

    def tell(self, work: Work, outcome: Outcome) -> list[GenerationRow]:
        """Take the objectives of the candidates."""
        assert isinstance(outcome, Evaluated)
        ranks = self._learn(outcome.objectives.unpack().astype(np.float64))
        return [GenerationRow(self.generation, self.evaluations, *ranks)]

    def final_arrays(self) -> Sequence[NDArray[np.generic]]:
        """Return candidates and objectives of the last generation."""
        return self._genomes, self._told[-1]

    def state(self) -> State:
        """Return all objectives that were told, of shape (generations, individuals)."""
        return {"told": np.array(self._told)}

    def restore(self, state: Mapping[str, int | float | str | NDArray[np.generic]]) -> None:
        """Draw and learn again what was drawn and learnt."""
        for objectives in np.asarray(state["told"], dtype=np.float64):
            self._draw()
            self._learn(objectives)

    def _draw(self) -> None:
        self._candidates = self._strategy.ask()
        self._genomes = np.array(self._candidates, dtype=np.float64)

    def _learn(self, objectives: Floats) -> tuple[float, float, float, float]:
        self._strategy.tell(self._candidates, objectives.tolist())
        self._candidates = []
        self._told.append(objectives)
        return self._champion.rank(self._genomes, objectives, self.generation)
