"""One generation of a population of bit strings: selection, crossover, mutation, elite.

Kim & Khosla (1992), section 3 and Fig. 3: m / 2 couples, one-point crossover anywhere in the string,
mutation bit by bit. Two words of the stream (seed, population, generation, MATING, couple) choose a
couple's parents; the third holds the decision to cross (high half) and the cut (low half). The stream
(seed, population, generation, BIT_MUTATION, 0) says how many bits of all children change, a number with a
binomial distribution, and which: the same as trying every bit, at a hundredth of the random numbers.
"""

from decimal import Decimal, localcontext
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.evolution import scaling
from tramnet_workers.evolution.encodings import Layout, Words
from tramnet_workers.evolution.streams import Purpose
from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.random import fill_words, new_stream, next_word, open_stream

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

SHIFT, SCALED, TOURNAMENT = range(3)  # rules of selection

_INITIAL = int(Purpose.INITIAL)
_MATING = int(Purpose.MATING)
_MUTATION = int(Purpose.BIT_MUTATION)
_HALF = np.uint64(32)
_LOW = np.uint64(0xFFFFFFFF)
_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
_NONE = np.uint64(0)
_ELEVEN = np.uint64(11)
_UNIT = 2.0**-53


class Breeding(NamedTuple):
    """How populations breed.

    Attributes:
        rule: SHIFT, SCALED or TOURNAMENT.
        crossover: Crossover happens if 32 random bits are below this number.
        mutation: ``mutation[k]``: that more than k bits of all children change happens if 32 random
            bits are at least this number.
        elites: Number of best individuals that survive.
        places: Word and mask of every bit, and mask of that word's bits before it, of shape
            (3, n_bits + 1); the last column stands for the end of the string.
    """

    rule: int
    crossover: int
    mutation: Words
    elites: int
    places: Words


def make_breeding(
    layout: Layout,
    population_size: int,
    *,
    rule: int,
    crossover: float,
    mutation: float,
    elites: int,
) -> Breeding:
    """Return how populations breed, with probabilities of crossover and mutation."""
    n_bits = layout.n_bits
    word, mask = layout.places()
    places = np.zeros((3, n_bits + 1), np.uint64)
    places[0], places[1, :-1] = np.append(word, layout.n_words), mask
    for bit in range(1, n_bits):
        if word[bit] == word[bit - 1]:
            places[2, bit] = places[2, bit - 1] | mask[bit - 1]
    return Breeding(
        rule=rule,
        crossover=int(crossover * 2**32),
        mutation=mutation_thresholds((population_size - elites) * n_bits, mutation),
        elites=elites,
        places=places,
    )


def mutation_thresholds(n_bits: int, probability: float) -> Words:
    """Return the binomial distribution function of mutated bits, times 2**32, while below that.

    In decimal arithmetic: its exponents hold what thousands of bits make of the smallest mass.
    """
    p = Decimal(probability)
    thresholds: list[int] = []
    with localcontext() as context:
        context.prec = 30
        mass, total = (1 - p) ** n_bits, Decimal(0)
        for k in range(n_bits):
            total += mass
            threshold = int(total * 2**32 + Decimal("0.5"))
            if threshold >= 2**32:
                break
            thresholds.append(threshold)
            mass *= p / (1 - p) * (n_bits - k) / (k + 1)
    return np.array(thresholds, np.uint64)


@kernel
def first_generation(keys: Words, used: Words, strings: Words) -> None:
    """Fill k populations with random bits.

    Args:
        keys: Seed and number of each population's streams, of shape (k, 2).
        used: Masks of the bits in use, of shape (n_words,).
        strings: Receives the strings, of shape (k, n_words, m).
    """
    for i in range(len(strings)):
        fill_words(strings[i], int(keys[i, 0]), int(keys[i, 1]), 0, _INITIAL)
        for w in range(len(used)):
            for j in range(strings.shape[2]):
                strings[i, w, j] &= used[w]


@kernel
def next_generation(
    breeding: Breeding,
    keys: Words,
    generation: int,
    fitness: Floats,
    parents: Words,
    children: Words,
) -> None:
    """Breed the next generation of k populations.

    Args:
        breeding: How populations breed.
        keys: Seed and number of each population's streams, of shape (k, 2).
        generation: Number of the children's generation, from 1.
        fitness: Fitness of the parents, larger is better, of shape (k, m).
        parents: Their strings, of shape (k, n_words, m).
        children: Receives the children, elites first, of the same shape.
    """
    m, n_couples = fitness.shape[1], (fitness.shape[1] - breeding.elites + 1) // 2
    words, couples = np.empty((3, n_couples), np.uint64), np.empty((2, n_couples), np.int64)
    scratch, wheel = np.empty(m), np.empty(m)
    for i in range(len(parents)):
        fill_words(words, int(keys[i, 0]), int(keys[i, 1]), generation, _MATING)
        if breeding.rule == TOURNAMENT:
            for parent in range(2):
                _hold_tournaments(fitness[i], words[parent], couples[parent])
        else:
            if breeding.rule == SHIFT:
                scaling.shift(fitness[i], scratch)
            else:
                scaling.scale(fitness[i], scratch)
            scaling.accumulate(scratch, wheel)
            for parent in range(2):
                for c in range(n_couples):
                    u = np.float64(words[parent, c] >> _ELEVEN) * _UNIT
                    couples[parent, c] = scaling.spin(wheel, u)
        _cross(breeding, words[2], couples, parents[i], children[i])
        _mutate(breeding, keys[i], generation, children[i])
        _copy_elites(breeding.elites, fitness[i], scratch, parents[i], children[i])


@kernel
def _hold_tournaments(fitness: Floats, words: Words, winners: Integers) -> None:
    """Choose the better of two random individuals, the first of equals, for each word."""
    m = np.uint64(len(fitness))
    for c in range(len(words)):
        a = np.int64(((words[c] >> _HALF) * m) >> _HALF)
        b = np.int64(((words[c] & _LOW) * m) >> _HALF)
        # No branches here: nobody can predict them.
        better = (fitness[b] > fitness[a]) | ((fitness[b] == fitness[a]) & (b < a))
        winners[c] = b if better else a


@kernel
def _cross(
    breeding: Breeding, words: Words, couples: Integers, parents: Words, children: Words
) -> None:
    """Write the children of all couples after the elites; the last couple may have one child only."""
    n_words, m = parents.shape
    n_bits = breeding.places.shape[1] - 1
    for c in range(len(words)):
        a, b = couples[0, c], couples[1, c]
        cut = 1 + np.int64(((words[c] & _LOW) * np.uint64(n_bits - 1)) >> _HALF)
        cut = cut if (words[c] >> _HALF) < np.uint64(breeding.crossover) else n_bits
        border, mask = np.int64(breeding.places[0, cut]), breeding.places[2, cut]
        first = breeding.elites + 2 * c
        second = min(first + 1, m - 1)
        for w in range(n_words):
            x, y = parents[w, a], parents[w, b]
            kept = mask if w == border else (_ALL if w < border else _NONE)
            swapped = (x ^ y) & ~kept
            children[w, second] = y ^ swapped
            children[w, first] = x ^ swapped


@kernel
def _mutate(breeding: Breeding, key: Words, generation: int, children: Words) -> None:
    """Change as many different bits of the children as chance says."""
    stream = new_stream()
    open_stream(stream, int(key[0]), int(key[1]), generation, _MUTATION, 0)
    count = np.searchsorted(breeding.mutation, next_word(stream) >> _HALF, side="right")
    n_bits = np.uint64(breeding.places.shape[1] - 1)
    n_children = np.uint64(children.shape[1] - breeding.elites)
    changed = np.zeros_like(children)
    while count > 0:
        place = next_word(stream)
        child = breeding.elites + np.int64(((place >> _HALF) * n_children) >> _HALF)
        bit = np.int64(((place & _LOW) * n_bits) >> _HALF)
        word, mask = np.int64(breeding.places[0, bit]), breeding.places[1, bit]
        count -= 1 if changed[word, child] & mask == _NONE else 0
        changed[word, child] |= mask
    for w in range(len(children)):
        for j in range(children.shape[1]):
            children[w, j] ^= changed[w, j]


@kernel
def _copy_elites(
    elites: int, fitness: Floats, rest: Floats, parents: Words, children: Words
) -> None:
    """Copy the best individuals, best first, into the first slots."""
    if elites > 1:
        rest[:] = fitness
    for slot in range(elites):
        best = best_of(fitness if slot == 0 else rest)
        for w in range(len(parents)):
            children[w, slot] = parents[w, best]
        rest[best] = -np.inf


@kernel
def best_of(fitness: Floats) -> int:
    """Return the index of the largest fitness; the lowest of equals."""
    best = 0
    for j in range(1, len(fitness)):
        if fitness[j] > fitness[best]:
            best = j
    return best


@kernel
def rank(fitness: Floats, traits: Floats, terms: Floats, rows: Floats) -> None:
    """Find the best individuals and the mean fitness of k populations.

    Args:
        fitness: Fitness, of shape (k, m).
        traits: Traits, of shape (k, n_traits, m).
        terms: Terms, of shape (k, n_terms, m).
        rows: Receives largest and mean fitness, then traits and terms of the best individual, of
            shape (k, 2 + n_traits + n_terms).
    """
    n_traits = traits.shape[1]
    for i in range(len(fitness)):
        slot = best_of(fitness[i])
        total = 0.0
        for j in range(fitness.shape[1]):
            total += fitness[i, j]
        rows[i, 0], rows[i, 1] = fitness[i, slot], total / fitness.shape[1]
        for r in range(n_traits):
            rows[i, 2 + r] = traits[i, r, slot]
        for r in range(terms.shape[1]):
            rows[i, 2 + n_traits + r] = terms[i, r, slot]
