"""What a problem offers: the objectives of a whole chunk of chromosomes.

A problem is named data plus pure functions. It travels over the wire as a registry name and plain
parameters, never as code, and is built again on each worker.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Problem(Protocol):
    """A problem, as a worker and the master see it.

    Attributes:
        name: Name under which the registry builds it.
        genome_shape: Shape of one chromosome.
        genome_dtype: Element type of a chromosome.
    """

    @property
    def name(self) -> str:
        """Name under which the registry builds it."""

    @property
    def genome_shape(self) -> tuple[int, ...]:
        """Shape of one chromosome."""

    @property
    def genome_dtype(self) -> np.dtype[np.generic]:
        """Element type of a chromosome."""

    def evaluate(self, genomes: NDArray[np.generic]) -> NDArray[np.float64]:
        """Return the objectives of a chunk of chromosomes, to be minimised.

        The objective of a chromosome depends on nothing but that chromosome: not on its place in
        the chunk, the chunk's length or what was evaluated before.

        Args:
            genomes: Chromosomes, of shape ``(n, *genome_shape)``; not modified.

        Returns:
            Objectives, of shape (n,), all finite; a large one for a chromosome that cannot be decoded,
            since infinities and NaN are taken for failed evaluations.
        """
