"""The master-slave genetic algorithm: one population, evaluated in chunks by the farm.

The root breeds, the workers evaluate. A generation is one piece of ``Evaluate`` work; how it is cut and who
takes which part is the farm's affair and cannot change the result.
"""

from collections.abc import Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tramnet_master.engines.engine import Best, Champion, GenerationRow, State, scalar
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evaluate, Evaluated, Kind, Outcome, Work, WorkId
from tramnet_workers.evolution.algorithm import Algorithm

Number = TypeVar("Number", bound=np.generic)


class GenerationalEngine:
    """Evaluate a population, breed the next one, and so on for a number of generations.

    Args:
        algorithm: Makes the first population and breeds each next one.
        generations: Number of generations to evaluate, the first population included.
    """

    def __init__(self, algorithm: Algorithm, generations: int) -> None:
        self._algorithm = algorithm
        self._generations = generations
        self._completed = 0
        self._genomes: NDArray[np.generic] = _frozen(algorithm.initial())
        self._asked = False
        self._champion = Champion()
        self._evaluated: tuple[NDArray[np.generic], NDArray[np.float64]] | None = None
        # Breeding is a pure function: once for nothing, so that its kernels are compiled before the run.
        # Read-only, as what arrives is: kernels are compiled for either kind apart.
        algorithm.breed(self._genomes, _frozen(np.zeros(len(self._genomes))), 1)

    @property
    def finished(self) -> bool:
        """Whether the last generation is complete."""
        return self._completed >= self._generations

    @property
    def generation(self) -> int:
        """Number of generations completed."""
        return self._completed

    @property
    def evaluations(self) -> int:
        """Number of individuals evaluated in completed generations."""
        return self._completed * self._algorithm.population_size

    @property
    def best(self) -> Best:
        """The best individual so far; the earliest, then the lowest slot, among equals."""
        assert self._champion.best is not None, "no generation is complete yet"
        return self._champion.best

    def ask(self) -> list[Work]:
        """Return the current generation, once."""
        if self._asked or self.finished:
            return []
        self._asked = True
        work = WorkId(Kind.EVALUATE, 0, self._completed + 1, 0, len(self._genomes))
        return [Evaluate(work, Array.pack(self._genomes))]

    def tell(self, work: Work, outcome: Outcome) -> list[GenerationRow]:
        """Take the objectives of the current generation and breed the next one."""
        assert isinstance(outcome, Evaluated)
        objectives = outcome.objectives.unpack().astype(np.float64, copy=False)
        self._completed += 1
        self._asked = False
        self._evaluated = (self._genomes, objectives)
        row = self._row(objectives)
        if not self.finished:
            bred = self._algorithm.breed(self._genomes, objectives, self._completed)
            self._genomes = _frozen(bred)
        return [row]

    def final_arrays(self) -> tuple[NDArray[np.generic], ...]:
        """Return genomes and objectives of the population last evaluated."""
        assert self._evaluated is not None, "no generation is complete yet"
        return self._evaluated

    def state(self) -> State:
        """Return the bred population, the number of generations behind it and the best so far."""
        assert self._evaluated is not None, "no generation is complete yet"
        return {
            "generation": self._completed,
            "genomes": self._genomes,
            "evaluated_genomes": self._evaluated[0],
            "evaluated_objectives": self._evaluated[1],
            **self._champion.state(),
        }

    def restore(self, state: Mapping[str, int | float | str | NDArray[np.generic]]) -> None:
        """Go on from a saved generation."""
        self._completed = int(scalar(state["generation"]))
        self._genomes = _frozen(np.asarray(state["genomes"]))
        objectives = _frozen(np.asarray(state["evaluated_objectives"], dtype=np.float64))
        self._evaluated = (_frozen(np.asarray(state["evaluated_genomes"])), objectives)
        self._champion.restore(state)
        self._asked = False

    def _row(self, objectives: NDArray[np.float64]) -> GenerationRow:
        ranks = self._champion.rank(self._genomes, objectives, self._completed)
        return GenerationRow(self._completed, self.evaluations, *ranks)


def _frozen(array: NDArray[Number]) -> NDArray[Number]:
    array.setflags(write=False)
    return array
