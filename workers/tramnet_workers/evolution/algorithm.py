"""What a generational algorithm offers: a first population, and each next one from the last."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Algorithm(Protocol):
    """A genetic algorithm over one population.

    All its randomness comes from streams keyed by (seed, population, generation, purpose, slot), so
    a population is a pure function of the one before it and may be bred again after a restart.
    """

    @property
    def population_size(self) -> int:
        """Number N of individuals."""

    def initial(self) -> NDArray[np.generic]:
        """Return the first population, of shape (N, *genome_shape)."""

    def breed(
        self, genomes: NDArray[np.generic], objectives: NDArray[np.float64], generation: int
    ) -> NDArray[np.generic]:
        """Return the next population.

        Args:
            genomes: The present population, of shape (N, *genome_shape); not modified.
            objectives: Its objectives, minimised, of shape (N,).
            generation: Number of the present generation; the first is 1.

        Returns:
            A population of the same shape and element type.
        """
