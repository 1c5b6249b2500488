"""Keyed streams against NumPy's Philox, and against what they promise."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.random import (
    Stream,
    below,
    fill_words,
    gaussian,
    new_stream,
    next_word,
    open_stream,
    uniform,
)

words = st.integers(0, 2**63 - 1)
halves = st.integers(0, 2**32 - 1)
keys = st.tuples(words, halves, words, halves, words)


def stream_at(key: tuple[int, int, int, int, int]) -> Stream:
    stream = new_stream()
    open_stream(stream, *key)
    return stream


def philox_at(key: tuple[int, int, int, int, int]) -> np.random.Philox:
    seed, population, generation, purpose, slot = key
    return np.random.Philox(
        key=np.array([seed, population << 32 | purpose], np.uint64),
        counter=np.array([0, slot, generation, 0], np.uint64),
    )


@kernel
def many_gaussians(stream: Stream, n: int) -> NDArray[np.float64]:
    values = np.empty(n)
    for k in range(n):
        values[k] = gaussian(stream)
    return values


@given(keys)
def test_the_words_of_a_stream_are_those_of_numpy_s_philox(
    key: tuple[int, int, int, int, int],
) -> None:
    stream = stream_at(key)

    found = [int(next_word(stream)) for _ in range(13)]

    assert found == philox_at(key).random_raw(13).tolist()


def test_a_seed_may_use_all_64_bits() -> None:
    stream = new_stream()

    open_stream(stream, np.uint64(2**64 - 1), 0, 0, 0, 0)

    key = np.array([2**64 - 1, 0], np.uint64)
    assert int(next_word(stream)) == int(np.random.Philox(key=key).random_raw())


def test_the_counter_carries_into_the_next_word() -> None:
    stream = stream_at((1, 2, 3, 4, 5))
    stream[2] = np.uint64(2**64 - 1)
    counter = np.array([2**64 - 1, 5, 3, 0], np.uint64)
    key = np.array([1, 2 << 32 | 4], np.uint64)

    found = [int(next_word(stream)) for _ in range(8)]

    assert found == np.random.Philox(key=key, counter=counter).random_raw(8).tolist()


@given(keys)
def test_uniform_numbers_are_those_of_numpy_s_generator(
    key: tuple[int, int, int, int, int],
) -> None:
    stream = stream_at(key)

    found = [uniform(stream) for _ in range(6)]

    assert found == np.random.Generator(philox_at(key)).random(6).tolist()


@given(keys, st.integers(1, 2**63 - 1))
def test_a_number_below_n_lies_in_its_range(key: tuple[int, int, int, int, int], n: int) -> None:
    assert 0 <= below(stream_at(key), n) < n


def test_numbers_below_n_are_equally_frequent() -> None:
    stream = stream_at((7, 0, 0, 0, 0))
    n, draws = 7, 70_000

    counts = Counter(below(stream, n) for _ in range(draws))

    # Six degrees of freedom: chi squared exceeds 33 once in 100,000.
    assert sum((counts[k] - draws / n) ** 2 / (draws / n) for k in range(n)) < 33.0


@pytest.mark.parametrize("field", range(5))
def test_every_part_of_the_key_changes_the_stream(field: int) -> None:
    key = [1, 2, 3, 4, 5]
    other = [value + (i == field) for i, value in enumerate(key)]

    first = next_word(stream_at(tuple(key)))  # type: ignore[arg-type]
    second = next_word(stream_at(tuple(other)))  # type: ignore[arg-type]

    assert first != second


def test_gaussian_numbers_have_the_moments_of_the_normal_distribution() -> None:
    n = 1_000_000

    values = many_gaussians(stream_at((11, 0, 0, 0, 0)), n)

    moments = [np.mean(values**power) for power in (1, 2, 3, 4)]
    # Five standard errors, from the moments 1, 2, 15 and 96 of the variances.
    errors = 5.0 * np.sqrt(np.array([1.0, 2.0, 15.0, 96.0]) / n)
    assert np.all(np.abs(moments - np.array([0.0, 1.0, 0.0, 3.0])) < errors)
    assert 4.0 < np.abs(values).max() < 6.5


@given(keys)
def test_a_gaussian_number_is_the_box_muller_transform_of_two_uniform_ones(
    key: tuple[int, int, int, int, int],
) -> None:
    u, v = np.random.Generator(philox_at(key)).random(2)

    found = gaussian(stream_at(key))

    assert found == pytest.approx(
        np.sqrt(-2.0 * np.log1p(-u)) * np.cos(2.0 * np.pi * v), rel=1e-9, abs=1e-12
    )


@given(keys, st.integers(1, 9))
def test_words_filled_for_many_slots_are_those_of_their_streams(
    key: tuple[int, int, int, int, int], n_words: int
) -> None:
    seed, population, generation, purpose, _ = key
    words = np.empty((n_words, 5), np.uint64)

    fill_words(words, seed, population, generation, purpose)

    for slot in range(5):
        expected = philox_at((seed, population, generation, purpose, slot)).random_raw(n_words)
        assert words[:, slot].tolist() == expected.tolist()
