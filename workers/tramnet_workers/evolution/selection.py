"""Selection by roulette, with a limit on how often equal individuals take part.

Goldberg (1989), "Genetic algorithms in search, optimization and machine learning", chapter 3; the limits
are those of Wang & Zalzala (1995), section 4.3, against premature convergence.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.grid import Key
from tramnet_workers.kernels.random import new_stream, open_stream, uniform

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_TINY = 1e-300
_BASIS = np.uint64(0xCBF29CE484222325)
_PRIME = np.uint64(0x100000001B3)


def scaled_fitness(objectives: Floats, hopeless: float) -> Floats:
    """Return 2 - J / max J: Wang & Zalzala (1995), section 4.4.1.

    Args:
        objectives: Objectives J > 0, of shape (N,).
        hopeless: J from which on an individual counts as none; the paper has no such individuals.

    Returns:
        Fitness in [1, 2), of shape (N,); 0 where there is no individual to speak of.
    """
    sound = objectives < hopeless
    worst = objectives.max(initial=0.0, where=sound)
    return np.where(sound, 2.0 - objectives / max(worst, _TINY), 0.0)


@kernel
def first_equals(genomes: NDArray[np.int16]) -> Indices:
    """Return for each individual the lowest slot of one with the same genome.

    Args:
        genomes: Genomes, of shape (N, genes).

    Returns:
        Slots, of shape (N,).
    """
    n = genomes.shape[0]
    prints = np.empty(n, np.uint64)
    firsts = np.empty(n, np.int64)
    for slot in range(n):
        prints[slot] = _fingerprint(genomes, slot)
        firsts[slot] = slot
        for other in range(slot):
            if prints[other] == prints[slot] and _are_equal(genomes, slot, other):
                firsts[slot] = other
                break
    return firsts


@device
def _fingerprint(genomes: NDArray[np.int16], slot: int) -> np.uint64:
    """Fowler, Noll & Vo's hash FNV-1a, with genes for bytes: unequal ones mean unequal genomes.

    Four hashes of every fourth gene each: one would wait for its own last multiplication.
    """
    a, b, c, d = _BASIS, _BASIS, _BASIS, _BASIS
    n = genomes.shape[1]
    for k in range(0, n - 3, 4):
        a = (a ^ _word(genomes[slot, k])) * _PRIME
        b = (b ^ _word(genomes[slot, k + 1])) * _PRIME
        c = (c ^ _word(genomes[slot, k + 2])) * _PRIME
        d = (d ^ _word(genomes[slot, k + 3])) * _PRIME
    for k in range(n - n % 4, n):
        a = (a ^ _word(genomes[slot, k])) * _PRIME
    return (((a ^ b) * _PRIME ^ c) * _PRIME ^ d) * _PRIME


@device
def _word(gene: int) -> np.uint64:
    return np.uint64(np.uint16(gene))


@device
def _are_equal(genomes: NDArray[np.int16], one: int, other: int) -> bool:
    equal = True
    for k in range(genomes.shape[1]):
        equal = equal and genomes[one, k] == genomes[other, k]
    return equal


@kernel
def surplus_slots(firsts: Indices, most: int) -> Indices:
    """Return the slots of all equal individuals beyond the first ``most`` of each kind."""
    n = firsts.shape[0]
    counts = np.zeros(n, np.int64)
    surplus = np.empty(n, np.int64)
    found = 0
    for slot in range(n):
        counts[firsts[slot]] += 1
        if counts[firsts[slot]] > most:
            surplus[found] = slot
            found += 1
    return surplus[:found]


@kernel
def spin_roulette(
    fitness: Floats, firsts: Indices, most: int, attempts: int, key: Key, purpose: int
) -> Indices:
    """Draw parents, each individual with a probability in proportion to its fitness.

    Args:
        fitness: Fitness, at least 0, of shape (N,); if all are 0, all are equally likely.
        firsts: For each individual the lowest slot of an equal one, of shape (N,).
        most: How many parents may be equal individuals.
        attempts: How often a place draws again if it meets that limit; after that it takes the next
            individual below the limit, or if there is none, the one it drew.
        key: Key of the generation.
        purpose: What the numbers are drawn for.

    Returns:
        Slots of the parents, of shape (N,).
    """
    n = fitness.shape[0]
    wheel = np.cumsum(fitness) if fitness.max() > 0.0 else np.arange(1.0, n + 1.0)
    counts = np.zeros(n, np.int64)
    parents = np.empty(n, np.int64)
    stream = new_stream()
    for place in range(n):
        open_stream(stream, key.seed, key.population, key.generation, purpose, place)
        slot = 0
        for _ in range(attempts):
            drawn = np.searchsorted(wheel, uniform(stream) * wheel[-1], side="right")
            slot = min(int(drawn), n - 1)
            if counts[firsts[slot]] < most:
                break
        parents[place] = _next_below_limit(slot, firsts, counts, most)
        counts[firsts[parents[place]]] += 1
    return parents


@device
def _next_below_limit(slot: int, firsts: Indices, counts: Indices, most: int) -> int:
    """Return the first individual from a slot on, cyclically, whose kind is below the limit."""
    n = firsts.shape[0]
    for k in range(n):
        candidate = (slot + k) % n
        if counts[firsts[candidate]] < most:
            return int(candidate)
    return int(slot)
