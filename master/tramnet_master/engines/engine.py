"""What an engine offers: work to ask for, outcomes to be told. It knows no network, clock or disk.

An engine is driven by whoever owns the farm: it is asked for work until it has none to give, told each
outcome in whatever order they come, and is finished when it says so. Its state is plain values and arrays,
so that it can be written to a checkpoint and restored bit for bit.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tramnet_protocol.messages import Evolve, Outcome, PopulationSnapshot, Work

State: TypeAlias = dict[str, "int | float | str | NDArray[np.generic]"]


class Best(NamedTuple):
    """The best individual so far.

    Attributes:
        objective: Its objective, minimised.
        generation: Generation in which it appeared first.
        genome: Its chromosome, read-only.
    """

    objective: float
    generation: int
    genome: NDArray[np.generic]


class GenerationRow(NamedTuple):
    """One line of ``history.csv``, without its time columns.

    Attributes:
        generation: Number of the generation, from 1.
        evaluations: Individuals evaluated so far.
        best: Lowest objective of this generation.
        mean: Mean objective of this generation.
        worst: Highest objective of this generation.
        best_so_far: Lowest objective of all generations so far.
    """

    generation: int
    evaluations: int
    best: float
    mean: float
    worst: float
    best_so_far: float


class Champion:
    """Keeps the best individual; the earliest, then the lowest slot, among equals.

    Attributes:
        best: It, or None before the first generation.
    """

    def __init__(self) -> None:
        self.best: Best | None = None

    def rank(
        self, genomes: NDArray[np.generic], objectives: NDArray[np.float64], generation: int
    ) -> tuple[float, float, float, float]:
        """Compare a generation; return its best, mean and worst objective, and the best of all so far."""
        slot = int(np.argmin(objectives))  # the lowest slot among equals
        lowest = float(objectives[slot])
        if self.best is None or lowest < self.best.objective:
            genome = genomes[slot].copy()
            genome.setflags(write=False)
            self.best = Best(lowest, generation, genome)
        # An exact sum: NumPy's own depends on the vector width of the machine.
        mean = math.fsum(objectives.tolist()) / len(objectives)
        return lowest, mean, float(objectives.max()), self.best.objective

    def state(self) -> State:
        """Return it for a checkpoint."""
        assert self.best is not None, "no generation is complete yet"
        return {
            "best_objective": self.best.objective,
            "best_generation": self.best.generation,
            "best_genome": self.best.genome,
        }

    def restore(self, state: Mapping[str, "int | float | str | NDArray[np.generic]"]) -> None:
        """Take back what ``state`` returned."""
        genome = np.asarray(state["best_genome"])
        genome.setflags(write=False)
        self.best = Best(
            float(scalar(state["best_objective"])), int(scalar(state["best_generation"])), genome
        )


class Engine(Protocol):
    """A method, as the farm sees it."""

    @property
    def finished(self) -> bool:
        """Whether no more work will come."""

    @property
    def generation(self) -> int:
        """Number of generations completed."""

    @property
    def evaluations(self) -> int:
        """Number of individuals evaluated in completed generations."""

    @property
    def best(self) -> Best:
        """The best individual so far; asked only after the first generation."""

    def ask(self) -> list[Work]:
        """Return the work that can be begun now; each piece is handed out once."""

    def tell(self, work: Work, outcome: Outcome) -> Sequence[GenerationRow]:
        """Take the outcome of a piece of work.

        Args:
            work: A piece of work that ``ask`` returned.
            outcome: Its outcome.

        Returns:
            The history rows of the generations that this outcome completes.
        """

    def final_arrays(self) -> Sequence[NDArray[np.generic]]:
        """Return what the hash of the run is taken over, in order.

        For populations, in index order: genomes in slot order, then objectives; for tracking, the path.
        """

    def state(self) -> State:
        """Return everything needed to go on from the last completed generation."""

    def restore(self, state: Mapping[str, "int | float | str | NDArray[np.generic]"]) -> None:
        """Take back what ``state`` returned.

        Args:
            state: A state of an engine with the same parameters.
        """


def scalar(value: "int | float | str | NDArray[np.generic]") -> int | float:
    """Return a number of a saved state."""
    assert isinstance(value, int | float), f"{value!r} is not a number"
    return value


class HoldsPopulations(ABC):
    """What an engine offers beside if its populations live with the workers, which tell only what connects them."""

    @abstractmethod
    def restate(self, work: Evolve) -> Evolve:
        """Return work with the state that a worker needs who does not hold the populations.

        Args:
            work: A piece of work that ``ask`` returned.
        """

    @abstractmethod
    def keep(self, snapshot: PopulationSnapshot) -> None:
        """Keep a snapshot to restore populations from.

        Args:
            snapshot: What came with the outcome that is told next.
        """

    @abstractmethod
    def spread(self, workers: int) -> None:
        """Divide the populations among a number of workers, from the next generation on."""
