"""What populations tell each other, and what a problem of several connected populations offers.

Kim & Khosla (1992), section 4 and Fig. 5: populations exchange no individuals. Each tells the others
one row of *connecting values*, one number for each trait (link length, base coordinate, joint value)
of its individuals: their mean (eqs 9-11), their median, or the traits of its best one (Fig. 10).
"""

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.order import circular_median, lower_median
from tramnet_workers.kernels.transforms import atan2, sincos

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@runtime_checkable
class CoupledProblem(Protocol):
    """A problem of t connected populations, as evolution sees it.

    Attributes:
        n_populations: Number t of populations.
        lower: Smallest values of the genes, of shape (t, n_genes).
        upper: Largest values; a gene whose two limits are equal everywhere has no bits.
        circular: Which traits are angles, of shape (n_traits,).
        n_terms: Number of terms of the fitness.
    """

    @property
    def n_populations(self) -> int:
        """Number t of populations."""

    @property
    def lower(self) -> Floats:
        """Smallest values of the genes, of shape (t, n_genes)."""

    @property
    def upper(self) -> Floats:
        """Largest values of the genes, of shape (t, n_genes)."""

    @property
    def circular(self) -> Flags:
        """Which traits are angles, of shape (n_traits,)."""

    @property
    def n_terms(self) -> int:
        """Number of terms of the fitness."""

    def evaluate(self, first: int, genes: Floats, traits: Floats, terms: Floats) -> None:
        """Evaluate k populations on their own, from population ``first`` on.

        Args:
            first: Index of the first population.
            genes: Genes, of shape (k, n_genes, m).
            traits: Receives the traits, of shape (k, n_traits, m).
            terms: Receives those terms that need no other population, of shape (k, n_terms, m).
        """

    def rate(
        self,
        first: int,
        generation: int,
        values: Floats | None,
        traits: Floats,
        terms: Floats,
        fitness: Floats,
    ) -> None:
        """Compute the connecting terms and the fitness of k populations.

        Args:
            first: Index of the first population.
            generation: Number of the generation, from 0.
            values: Connecting values of all populations in this generation, of shape
                (t, n_traits); None leaves the connecting terms out.
            traits: Traits, of shape (k, n_traits, m).
            terms: Terms, of shape (k, n_terms, m); receives the connecting ones.
            fitness: Receives the fitness, larger is better, of shape (k, m).
        """


@kernel
def medians(circular: Flags, traits: Floats, values: Floats) -> None:
    """Compute medians; those of angles about the first individual, where the elite stands.

    Args:
        circular: Which traits are angles, of shape (n_traits,).
        traits: Traits, of shape (k, n_traits, m).
        values: Receives the medians, of shape (k, n_traits).
    """
    m = traits.shape[2]
    shifted, keys = np.empty(m), np.empty(m, np.int64)
    for i in range(len(traits)):
        for r in range(len(circular)):
            row = traits[i, r]
            if circular[r]:
                values[i, r] = circular_median(row, row[0], shifted, keys)
            else:
                values[i, r] = lower_median(row, keys)


@kernel
def means(circular: Flags, traits: Floats, values: Floats) -> None:
    """Compute means, eqs 9-11; those of angles are directions of summed unit vectors.

    Args:
        circular: Which traits are angles, of shape (n_traits,).
        traits: Traits, of shape (k, n_traits, m).
        values: Receives the means, of shape (k, n_traits).
    """
    for i in range(len(traits)):
        for r in range(len(circular)):
            values[i, r] = _direction(traits[i, r]) if circular[r] else _mean(traits[i, r])


@kernel
def _mean(row: Floats) -> float:
    total = 0.0
    for j in range(len(row)):
        total += row[j]
    return total / len(row)


@kernel
def _direction(row: Floats) -> float:
    x, y = 0.0, 0.0
    for j in range(len(row)):
        s, c = sincos(row[j])
        x += c
        y += s
    return atan2(y, x)
