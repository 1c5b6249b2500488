"""What a run asks of a farm, in numbers: how many slots a generation has, how long they are and what they cost.

A *slot* is what the scheduler counts: an individual, a population that lives with its worker, or a point of a path.
"""

import enum

from msgspec import Struct

from tramnet_master.wording import time_span
from tramnet_protocol.messages import Kind, WorkId


class Grain(enum.Enum):
    """How a generation is divided among workers."""

    INDIVIDUALS = "individuals"
    POPULATIONS = "populations"
    PATHS = "paths"


class Workload(Struct, frozen=True):
    """Generations that the workers compute, with what the root does in between.

    Attributes:
        name: What runs.
        population: Individuals of a generation, populations, or paths that are followed at once.
        generations: Number of generations, or of points of each path.
        genome_bytes: Length of an individual on its way out [B].
        evaluation: Time of an individual, of a population's generation, or of a point [s].
        breeding: Time of the root between two rounds [s].
        genes: Genes of a chromosome that the root breeds.
        objective_bytes: Length of the answer for an individual, population or point [B].
        grain: How a round is divided.
        work_bytes: Length of what a work brings beside its individuals [B].
        run: Points of a path that are one work.
    """

    name: str
    population: int
    generations: int
    genome_bytes: int
    evaluation: float
    breeding: float = 0.0
    genes: int = 1
    objective_bytes: int = 8
    grain: Grain = Grain.INDIVIDUALS
    work_bytes: int = 0
    run: int = 1

    @property
    def description(self) -> str:
        """What is computed, in words."""
        n, times, each = self.population, self.generations, time_span(self.evaluation)
        if self.grain is Grain.INDIVIDUALS:
            return f"{n:,} individuals of {each}, {times:,} generations"
        steps = "generations" if self.grain is Grain.POPULATIONS else "points"
        return f"{n:,} {self.grain.value}, {times:,} {steps} of {each}"

    @property
    def rounds(self) -> int:
        """How often the root hands out work and waits for all of it."""
        return -(-self.generations // self.run)

    @property
    def serial_seconds(self) -> float:
        """Time of all of it on one processor that does it alone, without a network [s]."""
        computing = self.generations * self.population * self.evaluation
        return computing + self.rounds * self.breeding

    def works(self, step: int, workers: int) -> list[WorkId]:
        """Return the works of a round."""
        n = self.population
        match self.grain:
            case Grain.INDIVIDUALS:
                return [WorkId(Kind.EVALUATE, 0, step, 0, n)]
            case Grain.POPULATIONS:
                shares = min(workers, n)
                cuts = [n * i // shares for i in range(shares + 1)]
                return [WorkId(Kind.EVOLVE, 0, step, cuts[i], cuts[i + 1]) for i in range(shares)]
            case Grain.PATHS:
                return [WorkId(Kind.TRACK, i, step, 0, self.run) for i in range(n)]
