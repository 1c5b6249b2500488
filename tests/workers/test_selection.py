"""Roulette selection: in proportion to fitness, within its limits, from streams with keys."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from tramnet_workers.evolution.selection import (
    first_equals,
    scaled_fitness,
    spin_roulette,
    surplus_slots,
)
from tramnet_workers.kernels.grid import Key

PURPOSE = 2
HOPELESS = 1e6

seeds = st.integers(0, 2**32 - 1)
objectives = arrays.arrays(
    np.float64, st.integers(1, 40), elements=st.floats(0.01, 100.0) | st.just(HOPELESS)
)
small_genomes = arrays.arrays(
    np.int16, st.tuples(st.integers(1, 30), st.just(2)), elements=st.integers(-1, 1)
)


def spin(
    fitness: np.ndarray, firsts: np.ndarray, most: int, seed: int, generation: int = 1
) -> np.ndarray:
    return spin_roulette(fitness, firsts, most, 20, Key(seed, 0, generation), PURPOSE)


def test_fitness_is_two_less_the_share_of_the_worst_objective() -> None:
    fitness = scaled_fitness(np.array([0.5, 1.0, 2.0]), HOPELESS)

    assert fitness.tolist() == [1.75, 1.5, 1.0]  # section 4.4.1


@given(J=objectives)
def test_the_hopeless_get_no_fitness_and_the_others_keep_theirs(J: np.ndarray) -> None:
    fitness = scaled_fitness(J, HOPELESS)

    sound = J < HOPELESS
    assert (fitness[~sound] == 0.0).all()
    assert ((fitness[sound] >= 1.0) & (fitness[sound] <= 2.0)).all()
    assert fitness[sound].tolist() == scaled_fitness(J[sound], HOPELESS).tolist()


@given(genomes=small_genomes)
def test_the_first_equal_is_the_lowest_slot_with_the_same_genome(genomes: np.ndarray) -> None:
    found = first_equals(genomes)

    kinds = [genome.tobytes() for genome in genomes]
    assert found.tolist() == [kinds.index(kind) for kind in kinds]


@given(genomes=small_genomes, most=st.integers(1, 5))
def test_without_the_surplus_no_kind_is_there_too_often(genomes: np.ndarray, most: int) -> None:
    firsts = first_equals(genomes)

    surplus = surplus_slots(firsts, most)

    kept = np.delete(firsts, surplus)
    counts, before = np.bincount(kept), np.bincount(firsts)
    assert counts.max() <= most
    assert len(surplus) == np.maximum(before - most, 0).sum()


@given(J=objectives, seed=seeds, most=st.integers(1, 8))
def test_no_kind_becomes_parent_more_often_than_samemax_allows(
    J: np.ndarray, seed: int, most: int
) -> None:
    n = len(J)
    firsts = np.arange(n) // 2 * 2  # pairs of equal individuals

    parents = spin(scaled_fitness(J, HOPELESS), firsts, most, seed)

    counts = np.bincount(firsts[parents], minlength=n)
    if most * len(set(firsts.tolist())) >= n:
        assert counts.max() <= most
    assert ((parents >= 0) & (parents < n)).all()


def test_parents_are_drawn_in_proportion_to_their_fitness() -> None:
    fitness = np.array([1.0, 2.0, 0.0, 5.0])
    firsts = np.arange(4)

    drawn = np.concatenate([spin(fitness, firsts, 4, 7, generation) for generation in range(2000)])

    share = np.bincount(drawn, minlength=4) / len(drawn)
    # Standard deviations are below 0.006.
    assert share == pytest.approx(fitness / fitness.sum(), abs=0.025)
    assert share[2] == 0.0


def test_without_any_fitness_everybody_may_be_drawn() -> None:
    drawn = np.concatenate([spin(np.zeros(4), np.arange(4), 4, 1, g) for g in range(50)])

    assert set(drawn.tolist()) == {0, 1, 2, 3}


@given(J=objectives, seed=seeds)
def test_a_spin_depends_on_its_key_alone(J: np.ndarray, seed: int) -> None:
    fitness, firsts = scaled_fitness(J, HOPELESS), np.arange(len(J))

    first = spin(fitness, firsts, 6, seed)
    spin(fitness, firsts, 6, seed, generation=2)
    again = spin(fitness, firsts, 6, seed)

    assert first.tolist() == again.tolist()
