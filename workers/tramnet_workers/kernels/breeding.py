"""Genetic operators of EAMP, on populations of steps that are kept gene by gene.

Lin, Chen & Yu (2017): tournament, crossover (eq. 18), mutation (eq. 19), elitism. Genes are arrays of
shape (n, whole blocks), and each operator goes over all couples or children before the next one
begins: such loops vectorise where loops over the genes of one individual do not.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.lanes import LANES, new_rows
from tramnet_workers.kernels.random import (
    fill_words,
    gaussian,
    new_stream,
    next_word,
    open_stream,
    uniform,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Words = NDArray[np.uint64]

#: Purposes of the streams, as in ``evolution.streams``.
COUPLES = 11
MUTATED_STEPS = 12

_HALF = np.uint64(32)
_LOW = np.uint64(0xFFFFFFFF)
_UNIT = 2.0**-32
_DEVIATION = 1.0 / 3.0  # of eq. 19's "Gaussian between -1 and 1", which is clipped


class Breeding(NamedTuple):
    """How a population of steps evolves.

    Attributes:
        seed: Seed of the run, as one ``uint64``.
        population: Number of the population.
        size: Number of individuals.
        generations: Number of generations after the first population.
        draws: How many random draws the best of which makes an individual of the first population.
        tournament: Number of individuals of which the best becomes a parent.
        elites: Number of best individuals that survive.
        crossover: Probability that a couple's children are not copies.
        mutation: Distribution function, times 2**32, of the number of genes that mutate.
        single_point: Whether couples exchange the genes before a cut, instead of blending (eq. 18).
        uniform: Whether mutation draws uniformly, instead of from a Gaussian (eq. 19).
    """

    seed: int
    population: int
    size: int
    generations: int
    draws: int
    tournament: int
    elites: int
    crossover: float
    mutation: Words
    single_point: bool
    uniform: bool


class Nursery(NamedTuple):
    """Storage for an evolution.

    Attributes:
        genes: Two populations, one below the other, of shape (2 n, whole blocks) [rad].
        costs: Their costs, of shape (2, whole blocks).
        words: Random words of the couples, of shape (tournament + 2, n_couples).
        parents: Indices of the couples' parents, of shape (2, n_couples).
        couples: Genes of one gene's parents, and the shares of eq. 18, of shape (4, n_couples).
        cuts: Numbers of genes that couples exchange, of shape (n_couples,).
        stream: A random stream.
    """

    genes: Array
    costs: Array
    words: Words
    parents: Indices
    couples: Array
    cuts: Indices
    stream: Words


@kernel
def new_nursery(breeding: Breeding, n: int) -> Nursery:
    """Return storage for the evolution of steps of n joints."""
    blocks = (breeding.size + LANES) // LANES  # the spare child of an odd number needs a place
    n_couples = (breeding.size - breeding.elites + 1) // 2
    return Nursery(
        new_rows(2 * n, blocks),
        new_rows(2, blocks),
        np.empty((breeding.tournament + 2, n_couples), np.uint64),
        np.empty((2, n_couples), np.int64),
        np.empty((4, n_couples)),
        np.empty(n_couples, np.int64),
        new_stream(),
    )


@kernel
def breed(
    breeding: Breeding,
    key: int,
    low: Array,
    high: Array,
    nursery: Nursery,
    parents: Array,
    costs: Array,
    children: Array,
) -> None:
    """Fill the children's slots: the first children of all couples, then the second ones.

    Args:
        breeding: How populations evolve.
        key: Generation in the keys of the streams.
        low: Smallest genes, of shape (n,) [rad].
        high: Largest genes, of shape (n,) [rad].
        nursery: Scratch.
        parents: Genes of the present population, of shape (n, whole blocks) [rad].
        costs: Their costs, of shape (whole blocks,).
        children: Receives the genes of the next one; the elites' slots are left free.
    """
    n_children = breeding.size - breeding.elites
    words, tournament = nursery.words, breeding.tournament
    fill_words(words, breeding.seed, breeding.population, key, COUPLES)
    _select(words[:tournament], breeding.size, costs, nursery.parents)
    _plan_crossover(breeding, len(parents), words[tournament], nursery)
    for j in range(len(parents)):
        _cross(j, nursery, parents[j], low[j], high[j], children[j])
    _mutate(breeding, key, words[tournament + 1], n_children, low, high, children, nursery.stream)


@kernel
def keep_elites(
    breeding: Breeding, parents: Array, costs: Array, children: Array, next_costs: Array
) -> None:
    """Copy the best individuals into the last slots; ties go to the lowest index."""
    last, last_cost = -1, -np.inf
    for slot in range(breeding.size - breeding.elites, breeding.size):
        best, best_cost = -1, np.inf
        for i in range(breeding.size):
            later = costs[i] > last_cost or (costs[i] == last_cost and i > last)
            if later and costs[i] < best_cost:
                best, best_cost = i, costs[i]
        next_costs[slot] = best_cost
        for j in range(len(parents)):
            children[j, slot] = parents[j, best]
        last, last_cost = best, best_cost


@kernel
def _select(words: Words, size: int, costs: Array, parents: Indices) -> None:
    """Let both parents of each couple win a tournament; ties go to the lower index.

    Each half of a word is a contestant.
    """
    n = np.uint64(size)
    for couple in range(words.shape[1]):
        a, b = np.int64(size), np.int64(size)
        cost_a, cost_b = np.inf, np.inf
        for round in range(len(words)):
            word = words[round, couple]
            i = np.int64(((word >> _HALF) * n) >> _HALF)
            j = np.int64(((word & _LOW) * n) >> _HALF)
            wins_a = (costs[i] < cost_a) | ((costs[i] == cost_a) & (i < a))
            wins_b = (costs[j] < cost_b) | ((costs[j] == cost_b) & (j < b))
            a, cost_a = (i, costs[i]) if wins_a else (a, cost_a)
            b, cost_b = (j, costs[j]) if wins_b else (b, cost_b)
        parents[0, couple], parents[1, couple] = a, b


@kernel
def _plan_crossover(breeding: Breeding, n: int, words: Words, nursery: Nursery) -> None:
    """Decide for each couple on the shares of eq. 18 and on the genes that are exchanged.

    The high half of a word decides whether couples cross and, given that they do, is uniform again.
    """
    single_point, probability = breeding.single_point, breeding.crossover
    alphas, betas, cuts = nursery.couples[2], nursery.couples[3], nursery.cuts
    for couple in range(len(words)):
        chance = np.float64(words[couple] >> _HALF) * _UNIT
        rest = np.float64(words[couple] & _LOW) * _UNIT
        crosses = chance < probability
        blends = crosses and not single_point
        alphas[couple] = chance / probability if blends else 1.0
        betas[couple] = rest if blends else 0.0
        cuts[couple] = 1 + int(rest * (n - 1)) if crosses and single_point else 0


@kernel
def _cross(
    j: int, nursery: Nursery, parents: Array, low: float, high: float, children: Array
) -> None:
    """Write gene j of all couples' children: share * a + (1 - share) * b (eq. 18).

    Before the cut, shares are exchanged.
    """
    n_couples, cuts = len(nursery.cuts), nursery.cuts
    a, b, alphas, betas = (
        nursery.couples[0],
        nursery.couples[1],
        nursery.couples[2],
        nursery.couples[3],
    )
    for couple in range(n_couples):
        a[couple] = parents[nursery.parents[0, couple]]
        b[couple] = parents[nursery.parents[1, couple]]
    first, second = children[:n_couples], children[n_couples:]
    for couple in range(n_couples):
        exchanged = j < cuts[couple]
        alpha = 1.0 - alphas[couple] if exchanged else alphas[couple]
        beta = 1.0 - betas[couple] if exchanged else betas[couple]
        # Rounding may lead a blend of equals out of the range.
        one = alpha * a[couple] + (1.0 - alpha) * b[couple]
        two = beta * a[couple] + (1.0 - beta) * b[couple]
        first[couple] = min(max(one, low), high)
        second[couple] = min(max(two, low), high)


@kernel
def _mutate(
    breeding: Breeding,
    key: int,
    words: Words,
    n_children: int,
    low: Array,
    high: Array,
    children: Array,
    stream: Words,
) -> None:
    """Draw so many different genes of each child anew as a half of its couple's word says."""
    mutation, n_couples = breeding.mutation, len(words)
    for child in range(n_children):
        chance = words[child] >> _HALF if child < n_couples else words[child - n_couples] & _LOW
        if len(mutation) > 0 and chance >= mutation[0]:
            open_stream(stream, breeding.seed, breeding.population, key, MUTATED_STEPS, child)
            count, taken = 0, 0
            while count < len(mutation) and chance >= mutation[count]:
                j = _new_place(next_word(stream), len(low), count, taken)
                children[j, child] = _new_gene(breeding.uniform, low[j], high[j], stream)
                taken |= 1 << j
                count += 1


@device
def _new_place(word: np.uint64, n: int, count: int, taken: int) -> int:
    """Return a random one of n genes that is not among the ``count`` taken ones."""
    rank = np.int64(((word >> _HALF) * np.uint64(n - count)) >> _HALF)
    j = 0
    while rank > 0 or (taken >> j) & 1:
        rank -= 1 - ((taken >> j) & 1)
        j += 1
    return j


@device
def _new_gene(is_uniform: bool, low: float, high: float, stream: Words) -> float:
    """Return Y M with Y normal and clipped to [-1, 1] (eq. 19), or uniform."""
    if is_uniform:
        return low + (high - low) * uniform(stream)
    y = min(max(_DEVIATION * gaussian(stream), -1.0), 1.0)
    return y * high if y > 0.0 else -y * low
