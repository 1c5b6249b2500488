"""The algorithm of the better planner: a generational GA over a box of real numbers.

The first population is scattered about the middle of the box, which is its individual 0: for smooth
paths that is the straight line, so that no run ends above it. Mutations shrink from generation to
generation, from a search to a polish.
"""

from dataclasses import dataclass
from typing import Annotated, cast

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.evolution.real_coded import Operators, Place, next_generation, scatter

Floats = NDArray[np.float64]

Share = Annotated[float, Meta(ge=0.0, le=1.0)]


class SmoothSettings(Struct, frozen=True, forbid_unknown_fields=True):
    """Settings of the algorithm; deviations are fractions of half a gene's range.

    Attributes:
        tournament: Number of individuals in a tournament.
        crossover: Probability that a child has two parents.
        blend: Alpha of the blend crossover.
        mutation: Probability that a gene mutates.
        first_deviation: Standard deviation of mutations in the first generation.
        last_deviation: Standard deviation of mutations in the last generation.
        initial_deviation: Standard deviation of the first population.
        elites: Number of best individuals that survive.
    """

    tournament: Annotated[int, Meta(ge=1)] = 3
    crossover: Share = 0.9
    blend: Annotated[float, Meta(ge=0.0)] = 0.5
    mutation: Share = 0.2
    first_deviation: Share = 0.05
    last_deviation: Share = 0.001
    initial_deviation: Share = 0.1
    elites: Annotated[int, Meta(ge=0)] = 2


RECOMMENDED = SmoothSettings()
POPULATION_SIZE = 100
GENERATIONS = 150


@dataclass(frozen=True, eq=False)
class SmoothEvolution:
    """A population of real-coded chromosomes (see ``evolution.algorithm``).

    Attributes:
        seed: Seed of the run, 0 to 2**64 - 1.
        population_size: Number N of individuals, more than the elites.
        generations: Number of generations of the run, which sets how fast mutations shrink.
        lower: Smallest genes, of shape (d,).
        upper: Largest genes, of shape (d,).
        settings: The settings.
    """

    seed: int
    population_size: int
    generations: int
    lower: Floats
    upper: Floats
    settings: SmoothSettings = RECOMMENDED

    def __post_init__(self) -> None:
        if self.population_size <= self.settings.elites:
            raise InvalidParameters(
                "the smooth method",
                f"found a population of {self.population_size} with {self.settings.elites} elites, "
                "expected more individuals than elites",
            )

    def initial(self) -> Floats:
        """Return the first population, of shape (N, d)."""
        return scatter(
            self._place(0),
            0.5 * (self.lower + self.upper),
            self.settings.initial_deviation,
            self.lower,
            self.upper,
            self.population_size,
        )

    def breed(self, genomes: NDArray[np.generic], objectives: Floats, generation: int) -> Floats:
        """Return the population after the given generation; see ``Algorithm.breed``."""
        return next_generation(
            self._place(generation),
            self._operators(generation),
            np.ascontiguousarray(genomes, dtype=np.float64),
            objectives,
            self.lower,
            self.upper,
        )

    def _place(self, generation: int) -> Place:
        return Place(cast(int, np.uint64(self.seed)), 0, generation)

    def _operators(self, generation: int) -> Operators:
        s = self.settings
        left = max(0.0, 1.0 - generation / max(self.generations - 1, 1))
        # A cube, not an exponential: pow is libm's, and differs between machines.
        deviation = s.last_deviation + (s.first_deviation - s.last_deviation) * left * left * left
        return Operators(s.tournament, s.crossover, s.blend, s.mutation, deviation, s.elites)
