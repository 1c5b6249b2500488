"""The real-coded genetic algorithm for a problem of which nothing is known but its box."""

from typing import cast

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.evolution.real_coded import Place
from tramnet_workers.evolution.smooth import SmoothEvolution, SmoothSettings
from tramnet_workers.evolution.streams import Purpose
from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.random import new_stream, open_stream, uniform

Floats = NDArray[np.float64]

_INITIAL = int(Purpose.INITIAL)

SETTINGS = SmoothSettings(first_deviation=0.2, last_deviation=0.0005)
"""A wider search than that for smooth paths, whose first population stands about the straight line."""


class BoxEvolution(SmoothEvolution):
    """As ``SmoothEvolution``, from a first population spread evenly over the box."""

    def initial(self) -> Floats:
        """Return the first population, of shape (N, d)."""
        place = Place(cast(int, np.uint64(self.seed)), 0, 0)
        return spread(place, self.lower, self.upper, self.population_size)


@kernel
def spread(place: Place, lower: Floats, upper: Floats, size: int) -> Floats:
    """Return chromosomes drawn evenly from a box.

    Args:
        place: Where random numbers are drawn.
        lower: Smallest genes, of shape (d,).
        upper: Largest genes, of shape (d,).
        size: Number N of chromosomes.

    Returns:
        Chromosomes, of shape (N, d).
    """
    genomes = np.empty((size, len(lower)))
    stream = new_stream()
    for i in range(size):
        open_stream(stream, place.seed, place.population, place.generation, _INITIAL, i)
        for g in range(len(lower)):
            genomes[i, g] = lower[g] + (upper[g] - lower[g]) * uniform(stream)
    return genomes
