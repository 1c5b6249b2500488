"""Fitness as a wheel of fortune needs it: never negative, whatever the objective is.

Kim & Khosla (1992) shift negative fitness "internally to positive values" (section 7, Fig. 9). One
very bad individual then leaves all others the same share, so Goldberg's (1989) linear scaling, in
which the best gets twice the mean, stands beside it.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel

Floats = NDArray[np.float64]

_MOST = 2.0  # shares of the best individual where the mean gets one


@kernel
def shift(fitness: Floats, shares: Floats) -> None:
    """Set shares f - f_min, each of shape (m,)."""
    least = fitness[0]
    for j in range(len(fitness)):
        least = min(least, fitness[j])
    for j in range(len(fitness)):
        shares[j] = fitness[j] - least


@kernel
def scale(fitness: Floats, shares: Floats) -> None:
    """Set shares a f + b with mean 1 and largest 2, or smallest 0 where that would go below.

    Goldberg (1989), Genetic Algorithms in Search, Optimization and Machine Learning, pp. 76-79.
    """
    shift(fitness, shares)
    most, total = 0.0, 0.0
    for j in range(len(shares)):
        most = max(most, shares[j])
        total += shares[j]
    mean = total / len(shares)
    if most <= mean:  # all the same
        shares[:] = 1.0
        return
    slope = min((_MOST - 1.0) / (most - mean), 1.0 / mean)
    for j in range(len(shares)):
        shares[j] = max(0.0, 1.0 + slope * (shares[j] - mean))


@kernel
def accumulate(shares: Floats, wheel: Floats) -> None:
    """Set the ends of the sectors of a wheel; equal sectors where all shares are zero."""
    total = 0.0
    for j in range(len(shares)):
        total += shares[j]
        wheel[j] = total
    if total <= 0.0:
        for j in range(len(shares)):
            wheel[j] = j + 1.0


@kernel
def spin(wheel: Floats, u: float) -> int:
    """Return the individual in whose sector the wheel stops, for u in [0, 1)."""
    target = u * wheel[-1]
    low, high = 0, len(wheel) - 1
    while low < high:
        middle = (low + high) // 2
        if wheel[middle] > target:
            high = middle
        else:
            low = middle + 1
    return low
