"""One generation of a population of bit strings: selection, crossover, mutation, elite.

Kim & Khosla (1992), section 3 and Fig. 3: m / 2 couples, one-point crossover anywhere in the string,
mutation bit by bit. What couple c draws comes from the stream (seed, population, generation, MATING,
c) alone: two words choose the parents, one holds the decision to cross (high half) and the cut (low
half), one the numbers of mutations of both children, and further words the places of these.

The number of mutations is drawn from its binomial distribution and the bits, all different, from all
bits of the string: the same as trying every bit, at a fiftieth of the random numbers.
"""

from decimal import Decimal, localcontext
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.evolution import scaling
from tramnet_workers.evolution.encodings import Strings
from tramnet_workers.evolution.streams import Purpose
from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.random import below, new_stream, next_word, open_stream

Floats = NDArray[np.float64]
Words = NDArray[np.uint64]
Stream = Words

SHIFT, SCALED, TOURNAMENT = range(3)  # rules of selection

_INITIAL = int(Purpose.INITIAL)
_MATING = int(Purpose.MATING)
_HALF = np.uint64(32)
_LOW = np.uint64(0xFFFFFFFF)
_ELEVEN = np.uint64(11)
_UNIT = 2.0**-53
_SIXTEEN = np.uint64(16)


class Breeding(NamedTuple):
    """How populations breed.

    Attributes:
        seed: Seed of the run, a ``numpy.uint64`` for the compiler.
        bits: Bits of a gene.
        rule: SHIFT, SCALED or TOURNAMENT.
        crossover: Crossover happens if 32 random bits are below this number.
        mutation: ``mutation[k]``: that more than k bits mutate happens if 32 random bits are at
            least this number; of shape (most mutations,).
        elites: Number of best individuals that survive.
    """

    seed: int
    bits: int
    rule: int
    crossover: int
    mutation: Words
    elites: int


def mutation_thresholds(n_bits: int, probability: float) -> Words:
    """Return the binomial distribution function of mutated bits in a string, times 2**32.

    In decimal arithmetic: its exponents hold what thousands of bits make of the smallest mass.
    """
    p = Decimal(probability)
    thresholds: list[int] = []
    with localcontext() as context:
        context.prec = 30
        mass, total = (1 - p) ** n_bits, Decimal(0)
        for k in range(n_bits):
            total += mass
            thresholds.append(int(total * 2**32 + Decimal("0.5")))
            mass *= p / (1 - p) * (n_bits - k) / (k + 1)
    possible = [threshold for threshold in thresholds if threshold < 2**32]
    return np.array(possible, np.uint64)


@kernel
def first_generation(breeding: Breeding, keys: Words, strings: Strings) -> None:
    """Fill k populations with random bits.

    Args:
        breeding: How populations breed.
        keys: Numbers of the populations' streams, of shape (k,).
        strings: Receives the strings, of shape (k, n_genes, m).
    """
    stream = new_stream()
    mask = (np.uint64(1) << np.uint64(breeding.bits)) - np.uint64(1)
    for i in range(len(strings)):
        for j in range(strings.shape[2]):
            open_stream(stream, breeding.seed, int(keys[i]), 0, _INITIAL, j)
            for g in range(strings.shape[1]):
                if g % 4 == 0:
                    word = next_word(stream)
                strings[i, g, j] = np.uint16(word & mask)
                word >>= _SIXTEEN


@kernel
def next_generation(
    breeding: Breeding,
    keys: Words,
    generation: int,
    fitness: Floats,
    parents: Strings,
    children: Strings,
) -> None:
    """Breed the next generation of k populations.

    Args:
        breeding: How populations breed.
        keys: Numbers of the populations' streams, of shape (k,).
        generation: Number of the children's generation, from 1.
        fitness: Fitness of the parents, larger is better, of shape (k, m).
        parents: Their strings, of shape (k, n_genes, m).
        children: Receives the children, elites first, of the same shape.
    """
    m = fitness.shape[1]
    stream, shares, wheel = new_stream(), np.empty(m), np.empty(m)
    flipped = np.empty(len(breeding.mutation), np.int64)
    for i in range(len(parents)):
        if breeding.rule != TOURNAMENT:
            if breeding.rule == SHIFT:
                scaling.shift(fitness[i], shares)
            else:
                scaling.scale(fitness[i], shares)
            scaling.accumulate(shares, wheel)
        copy_elites(breeding.elites, fitness[i], shares, parents[i], children[i])
        for couple in range((m - breeding.elites + 1) // 2):
            open_stream(stream, breeding.seed, int(keys[i]), generation, _MATING, couple)
            first = breeding.elites + 2 * couple
            _mate(breeding, stream, fitness[i], wheel, parents[i], children[i], first)
            counts = next_word(stream)
            _mutate(breeding, counts >> _HALF, stream, flipped, children[i], first)
            if first + 1 < m:
                _mutate(breeding, counts & _LOW, stream, flipped, children[i], first + 1)


@kernel
def copy_elites(
    elites: int, fitness: Floats, rest: Floats, parents: Strings, children: Strings
) -> None:
    """Copy the best individuals, best first, into the first slots; ties go to the lowest index."""
    rest[:] = fitness
    for slot in range(elites):
        best = best_of(rest)
        for g in range(len(parents)):
            children[g, slot] = parents[g, best]
        rest[best] = -np.inf


@kernel
def find_best(fitness: Floats, best: NDArray[np.int64], mean: Floats) -> None:
    """Find the best individual and the mean fitness of k populations of shape (k, m)."""
    for i in range(len(fitness)):
        best[i] = best_of(fitness[i])
        total = 0.0
        for j in range(fitness.shape[1]):
            total += fitness[i, j]
        mean[i] = total / fitness.shape[1]


@kernel
def best_of(fitness: Floats) -> int:
    """Return the index of the largest fitness; the lowest of equals."""
    best = 0
    for j in range(1, len(fitness)):
        if fitness[j] > fitness[best]:
            best = j
    return best


@device
def _mate(
    breeding: Breeding,
    stream: Stream,
    fitness: Floats,
    wheel: Floats,
    parents: Strings,
    children: Strings,
    first: int,
) -> None:
    """Choose two parents and write their children into slots ``first`` and ``first`` + 1."""
    n_genes, m = parents.shape
    a = _select(breeding.rule, next_word(stream), fitness, wheel)
    b = _select(breeding.rule, next_word(stream), fitness, wheel)
    word = next_word(stream)
    gene, bit = n_genes, 0
    if (word >> _HALF) < np.uint64(breeding.crossover):
        n_bits = n_genes * breeding.bits
        cut = 1 + int(((word & _LOW) * np.uint64(n_bits - 1)) >> _HALF)
        gene = cut // breeding.bits
        bit = cut - gene * breeding.bits
    second = min(first + 1, m - 1)  # the last couple may have one child only, written last
    for g in range(n_genes):
        x, y = parents[g, a], parents[g, b]
        tail = 0 if g < gene else (1 << breeding.bits) - 1
        if g == gene:
            tail >>= bit
        swapped = (x ^ y) & tail
        children[g, second] = np.uint16(y ^ swapped)
        children[g, first] = np.uint16(x ^ swapped)


@device
def _select(rule: int, word: np.uint64, fitness: Floats, wheel: Floats) -> int:
    if rule != TOURNAMENT:
        return scaling.spin(wheel, np.float64(word >> _ELEVEN) * _UNIT)
    m = np.uint64(len(fitness))
    a = int(np.int64(((word >> _HALF) * m) >> _HALF))
    b = int(np.int64(((word & _LOW) * m) >> _HALF))
    better = fitness[b] > fitness[a] or (fitness[b] == fitness[a] and b < a)
    return b if better else a


@device
def _mutate(
    breeding: Breeding,
    chance: np.uint64,
    stream: Stream,
    flipped: NDArray[np.int64],
    children: Strings,
    slot: int,
) -> None:
    """Flip as many different bits of a child as the 32 bits of ``chance`` say."""
    count = 0
    while count < len(breeding.mutation) and chance >= breeding.mutation[count]:
        place = _new_place(stream, len(children) * breeding.bits, flipped[:count])
        flipped[count] = place
        gene = place // breeding.bits
        bit = breeding.bits - 1 - (place - gene * breeding.bits)
        children[gene, slot] ^= np.uint16(1 << bit)
        count += 1


@device
def _new_place(stream: Stream, n_bits: int, taken: NDArray[np.int64]) -> int:
    """Return a random place that is not taken yet."""
    while True:
        place = below(stream, n_bits)
        fresh = True
        for other in taken:
            fresh = fresh and other != place
        if fresh:
            return place
