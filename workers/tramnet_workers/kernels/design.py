"""The fitness of an arm design, eq (4) of Kim & Khosla (1992), term by term, for whole populations.

    F = w_DM DM - w_TC TC - w_RC RC - w_HC HC - w_JLC JLC - s w_LC LC - s w_BPC BPC - w_JAC JAC

Printed with plus signs; every term after DM is a penalty, at least zero, so it is subtracted. The
first five come from the individual alone, the last three, the *connecting* ones, from what the
other populations found. An individual is known to the others by its *traits*, one row each:
link lengths, base position, then joint values (angles first, strokes of prismatic joints last).

Populations are arrays of shape (rows, m), individuals side by side. Only additions, products,
quotients and square roots are used, whose results are the same wherever an individual stands.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.order import wrap

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Rows of a block of terms, in the order of eq (4).
DM, TC, RC, HC, JLC, LC, BPC, JAC = range(8)
N_TERMS = 8


class Coupling(NamedTuple):
    """How populations are connected.

    Attributes:
        n_links: Number of link length rows among the traits.
        n_base: Number of base position rows.
        n_angles: Number of joint rows that are angles.
        n_populations: Number t of populations; rows of connecting values beyond are fixed poses.
        neighbours: Rows of the previous and the next task point, of shape (t, 2); -1 where none.
        weights: Weights of the eight terms, of shape (8,).
        reach: How far the base may move between neighbours [m]; below zero: it may not at all.
    """

    n_links: int
    n_base: int
    n_angles: int
    n_populations: int
    neighbours: Integers
    weights: Floats
    reach: float


@kernel
def total_fitness(
    coupling: Coupling,
    first: int,
    scale: float,
    values: Floats,
    traits: Floats,
    terms: Floats,
    fitness: Floats,
) -> None:
    """Compute the connecting terms and the fitness of populations ``first``, ``first`` + 1, ...

    Args:
        coupling: How populations are connected.
        first: Index of the first of the k populations.
        scale: Factor s of LC and BPC in this generation.
        values: Connecting values of all populations and fixed poses, of shape (rows, n_traits).
        traits: Traits of the individuals, of shape (k, n_traits, m).
        terms: Terms, of shape (k, 8, m); receives LC, BPC and JAC.
        fitness: Receives F, of shape (k, m).
    """
    target = np.empty(values.shape[1])
    sums = np.zeros(values.shape[1])
    for h in range(coupling.n_populations):
        for r in range(len(sums)):
            sums[r] += values[h, r]
    for i in range(len(traits)):
        terms[i, LC:] = 0.0
        if coupling.n_populations > 1:
            for r in range(len(sums)):
                target[r] = (sums[r] - values[first + i, r]) / (coupling.n_populations - 1)
            _compare_links(coupling, target, traits[i], terms[i, LC])
            if coupling.reach < 0.0:
                _compare_base(coupling, target, 0.0, traits[i], terms[i, BPC])
        if coupling.reach >= 0.0:
            _limit_mobility(coupling, coupling.neighbours[first + i], values, traits[i], terms[i])
        _compare_joints(coupling, coupling.neighbours[first + i], values, traits[i], terms[i, JAC])
        _add_terms(coupling.weights, scale, terms[i], fitness[i])


@kernel
def _compare_links(coupling: Coupling, target: Floats, traits: Floats, lc: Floats) -> None:
    for k in range(coupling.n_links):
        lengths = traits[k]
        for j in range(len(lc)):
            lc[j] += abs(lengths[j] - target[k])  # eq 9


@kernel
def _compare_base(
    coupling: Coupling, target: Floats, allowed: float, traits: Floats, bpc: Floats
) -> None:
    """Raise BPC to the distance from a base position, less what is allowed."""
    axes = traits[coupling.n_links : coupling.n_links + coupling.n_base]
    for j in range(len(bpc)):
        square = 0.0
        for axis in range(coupling.n_base):
            apart = axes[axis, j] - target[coupling.n_links + axis]
            square += apart * apart
        bpc[j] = max(bpc[j], np.sqrt(square) - allowed)  # eq 10


@kernel
def _limit_mobility(
    coupling: Coupling, neighbours: Integers, values: Floats, traits: Floats, terms: Floats
) -> None:
    """Use BPC for a mobile base: it is to stay within reach of its places at the neighbours.

    The worse side counts. With the sum of both, a place between two neighbours that are too far
    apart would be as good as any other, and they would never come together.
    """
    for side in range(2):
        if neighbours[side] >= 0:
            _compare_base(coupling, values[neighbours[side]], coupling.reach, traits, terms[BPC])


@kernel
def _compare_joints(
    coupling: Coupling, neighbours: Integers, values: Floats, traits: Floats, jac: Floats
) -> None:
    """Add the distance from the middle between the neighbours' joint values, or from the only one."""
    before, after = neighbours[0], neighbours[1]
    if before < 0 and after < 0:
        return
    before, after = (after if before < 0 else before), (before if after < 0 else after)
    start = coupling.n_links + coupling.n_base
    for k in range(start, len(traits)):
        joint = traits[k]
        if k < start + coupling.n_angles:
            middle = values[before, k] + 0.5 * wrap(values[after, k] - values[before, k])
            for j in range(len(jac)):
                jac[j] += abs(wrap(joint[j] - middle))  # eq 11
        else:
            middle = 0.5 * (values[before, k] + values[after, k])
            for j in range(len(jac)):
                jac[j] += abs(joint[j] - middle)  # eq 11


@kernel
def _add_terms(weights: Floats, scale: float, terms: Floats, fitness: Floats) -> None:
    for j in range(len(fitness)):
        private = weights[TC] * terms[TC, j] + weights[RC] * terms[RC, j]
        private += weights[HC] * terms[HC, j] + weights[JLC] * terms[JLC, j]
        shared = scale * (weights[LC] * terms[LC, j] + weights[BPC] * terms[BPC, j])
        shared += weights[JAC] * terms[JAC, j]
        fitness[j] = weights[DM] * terms[DM, j] - private - shared  # eq 4
