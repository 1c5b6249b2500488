"""Keyed random streams: Philox4x64-10, equal word for word to ``numpy.random.Philox``.

Salmon, Moraes, Dror & Shaw (2011), "Parallel random numbers: as easy as 1, 2, 3", section 3.3. A
stream is a place in a table, not a state that somebody carries: what slot 7 of generation 3 draws
depends on its key alone, never on who draws first. The words of a stream are those of
``Philox(key=[seed, population << 32 | purpose], counter=[0, slot, generation, 0])``.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.transforms import log, sincos

Stream = NDArray[np.uint64]

# Layout of a stream: key (2), counter (4), words of the present block (4), number of words taken.
_COUNTER = 2
_WORDS = 6
_TAKEN = 10
_STREAM_SIZE = 11

_ROUNDS = 10
_MULTIPLIER_0 = np.uint64(0xD2E7470EE14C6C93)
_MULTIPLIER_1 = np.uint64(0xCA5A826395121157)
_WEYL_0 = np.uint64(0x9E3779B97F4A7C15)  # golden ratio
_WEYL_1 = np.uint64(0xBB67AE8584CAA73B)  # sqrt(3) - 1

_ZERO = np.uint64(0)
_ONE = np.uint64(1)
_FOUR = np.uint64(4)
_ELEVEN = np.uint64(11)
_HALF = np.uint64(32)
_LOW = np.uint64(0xFFFFFFFF)
_UNIT = 2.0**-53
_TWO_PI = 6.283185307179586


@kernel
def new_stream() -> Stream:
    """Return storage for a stream; ``open_stream`` gives it its key."""
    return np.zeros(_STREAM_SIZE, np.uint64)


@kernel
def open_stream(
    stream: Stream, seed: int, population: int, generation: int, purpose: int, slot: int
) -> None:
    """Put a stream at the first word of its key.

    Args:
        stream: Storage from ``new_stream``, overwritten.
        seed: Seed of the run, 0 to 2**64 - 1; above 2**63 - 1 as ``numpy.uint64``.
        population: Index of the population, 0 to 2**32 - 1.
        generation: Index of the generation.
        purpose: What the numbers are for, 0 to 2**32 - 1.
        slot: Index of the individual, pair or point that draws.
    """
    stream[0] = np.uint64(seed)
    stream[1] = (np.uint64(population) << _HALF) | np.uint64(purpose)
    stream[2] = _ZERO
    stream[3] = np.uint64(slot)
    stream[4] = np.uint64(generation)
    stream[5] = _ZERO
    stream[_TAKEN] = _FOUR


@device
def next_word(stream: Stream) -> np.uint64:
    """Return the next 64 random bits of a stream."""
    if stream[_TAKEN] == _FOUR:
        _next_block(stream)
    word: np.uint64 = stream[np.uint64(_WORDS) + stream[_TAKEN]]
    stream[_TAKEN] += _ONE
    return word


@device
def uniform(stream: Stream) -> float:
    """Return a number in [0, 1): 53 random bits, as ``numpy.random.Generator.random`` does."""
    return np.float64(next_word(stream) >> _ELEVEN) * _UNIT


@device
def below(stream: Stream, n: int) -> int:
    """Return an integer in [0, n), each equally likely, for n >= 1.

    Lemire (2019), "Fast random integer generation in an interval", algorithm 5 with 64-bit words.
    """
    bound = np.uint64(n)
    high, low = _multiply(next_word(stream), bound)
    if low < bound:
        threshold = (_ZERO - bound) % bound  # 2**64 mod n
        while low < threshold:
            high, low = _multiply(next_word(stream), bound)
    return int(np.int64(high))


@device
def gaussian(stream: Stream) -> float:
    """Return a normally distributed number of mean 0 and variance 1, from two words.

    Box & Muller (1958), "A note on the generation of random normal deviates", the cosine half.
    """
    radius = np.sqrt(-2.0 * log(1.0 - uniform(stream)))  # 1 - u is never 0
    return float(radius * sincos(_TWO_PI * uniform(stream)).cosine)


@kernel
def fill_words(
    words: NDArray[np.uint64], seed: int, population: int, generation: int, purpose: int
) -> None:
    """Write the first words of many slots' streams, as ``next_word`` would return them.

    Args:
        words: Receives word i of slot j in place (i, j), of shape (n_words, n_slots).
        seed: Seed of the run, as for ``open_stream``.
        population: Index of the population.
        generation: Index of the generation.
        purpose: What the numbers are for.
    """
    key_0, key_1 = np.uint64(seed), (np.uint64(population) << _HALF) | np.uint64(purpose)
    for first in range(0, len(words), 4):
        counter = np.uint64(first // 4 + 1)
        for slot in range(words.shape[1]):
            block = _philox(key_0, key_1, counter, np.uint64(slot), np.uint64(generation), _ZERO)
            for i in range(min(4, len(words) - first)):
                words[first + i, slot] = block[i]


@device
def _multiply(a: np.uint64, b: np.uint64) -> tuple[np.uint64, np.uint64]:
    """Return the high and the low word of the 128-bit product of two words."""
    a_low, a_high = a & _LOW, a >> _HALF
    b_low, b_high = b & _LOW, b >> _HALF
    low = a_low * b_low
    middle = a_high * b_low + (low >> _HALF)
    cross = a_low * b_high + (middle & _LOW)
    return a_high * b_high + (middle >> _HALF) + (cross >> _HALF), a * b


@kernel
def _next_block(stream: Stream) -> None:
    """Advance the counter by one and replace the four words by those of the new block."""
    for i in range(_COUNTER, _WORDS):
        stream[i] += _ONE
        if stream[i] != _ZERO:
            break
    stream[6], stream[7], stream[8], stream[9] = _philox(
        stream[0], stream[1], stream[2], stream[3], stream[4], stream[5]
    )
    stream[_TAKEN] = _ZERO


@device
def _philox(
    k0: np.uint64, k1: np.uint64, c0: np.uint64, c1: np.uint64, c2: np.uint64, c3: np.uint64
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Return the block of four words of a key and a counter."""
    for _ in range(_ROUNDS):
        high_0, low_0 = _multiply(_MULTIPLIER_0, c0)
        high_1, low_1 = _multiply(_MULTIPLIER_1, c2)
        c0, c1, c2, c3 = high_1 ^ c1 ^ k0, low_1, high_0 ^ c3 ^ k1, low_0
        k0 += _WEYL_0
        k1 += _WEYL_1
    return c0, c1, c2, c3
