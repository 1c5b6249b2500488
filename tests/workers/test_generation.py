import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_workers.evolution.encodings import Layout, pack
from tramnet_workers.evolution.generation import (
    SCALED,
    SHIFT,
    TOURNAMENT,
    first_generation,
    make_breeding,
    mutation_thresholds,
    next_generation,
    rank,
)
from tramnet_workers.kernels.order import circular_median, lower_median, wrap

RULES = pytest.mark.parametrize("rule", [SHIFT, SCALED, TOURNAMENT])
LAYOUT = Layout(4, 10)


def breeding(rule=TOURNAMENT, crossover=0.9, mutation=0.01, elites=1, layout=LAYOUT, m=100):
    return make_breeding(
        layout, m, rule=rule, crossover=crossover, mutation=mutation, elites=elites
    )


def keys_of(k, seed=1, first=0):
    return np.array([(seed, number) for number in range(first, first + k)], np.uint64)


def random_strings(rng, k=1, m=100, layout=LAYOUT):
    words = rng.integers(0, 2**64, (k, layout.n_words, m), dtype=np.uint64)
    return words & layout.used()[:, None]


def bred(how, parents, fitness, generation=1, keys=None):
    children = np.zeros_like(parents)
    keys = keys_of(len(parents)) if keys is None else keys
    next_generation(how, keys, generation, fitness, parents, children)
    return children


def bits_of(strings, layout=LAYOUT):
    """Spread chromosomes into bits, of shape (k, m, n_bits)."""
    return np.unpackbits(pack(strings, layout), axis=2, count=layout.n_bits).astype(int)


@RULES
def test_without_crossover_and_mutation_children_are_copies_of_parents(rule):
    parents = random_strings(np.random.default_rng(0))
    fitness = np.random.default_rng(1).normal(size=(1, 100))

    children = bred(breeding(rule=rule, crossover=0.0, mutation=0.0), parents, fitness)

    assert set(map(tuple, children[0].T)) <= set(map(tuple, parents[0].T))


@given(st.integers(0, 2**63), st.integers(2, 31), st.integers(1, 9), st.integers(5, 16))
def test_crossover_neither_loses_nor_invents_a_bit_of_a_couple(seed, m, n_genes, bits):
    layout, m = Layout(n_genes, bits), m - m % 2
    parents = random_strings(np.random.default_rng(seed), m=m, layout=layout)
    fitness = np.zeros((1, m))
    how = breeding(crossover=1.0, mutation=0.0, elites=0, layout=layout, m=m)
    straight = how._replace(crossover=0)

    keys = keys_of(1, seed)
    crossed = bits_of(bred(how, parents, fitness, 1, keys), layout)
    copied = bits_of(bred(straight, parents, fitness, 1, keys), layout)

    pairs = crossed.reshape(-1, 2, layout.n_bits), copied.reshape(-1, 2, layout.n_bits)
    assert np.array_equal(pairs[0].sum(axis=1), pairs[1].sum(axis=1))
    assert np.array_equal(pairs[0][:, :, 0], pairs[1][:, :, 0])  # the cut is never before bit 1


@pytest.mark.parametrize("layout", [Layout(4, 10), Layout(9, 16)])
def test_one_point_crossover_exchanges_the_tail_of_the_string(layout):
    parents = np.zeros((1, layout.n_words, 2), np.uint64)
    parents[0, :, 1] = layout.used()
    fitness = np.zeros((1, 2))
    how = breeding(crossover=1.0, mutation=0.0, elites=0, layout=layout, m=2)

    cuts = set()
    for generation in range(1, 30 * layout.n_bits):
        child = bits_of(bred(how, parents, fitness, generation), layout)[0, 0]
        changes = np.flatnonzero(np.diff(child))
        assert len(changes) <= 1
        cuts.update(changes + 1)

    assert cuts == set(range(1, layout.n_bits))


@RULES
def test_the_best_survive_unchanged_in_the_first_slots(rule):
    parents = random_strings(np.random.default_rng(2))
    fitness = np.random.default_rng(3).normal(size=(1, 100))

    children = bred(breeding(rule=rule, mutation=0.5, elites=3), parents, fitness)

    ranks = np.argsort(-fitness[0], kind="stable")[:3]
    assert np.array_equal(children[0, :, :3], parents[0][:, ranks])


def test_of_equally_good_individuals_the_lowest_index_is_the_elite():
    parents = random_strings(np.random.default_rng(4), m=6)
    fitness = np.array([[0.0, 1.0, 1.0, 1.0, 0.0, 1.0]])

    children = bred(breeding(elites=2, m=6), parents, fitness)

    assert np.array_equal(children[0, :, :2], parents[0][:, [1, 2]])


@RULES
def test_selection_favours_fit_parents(rule):
    layout = Layout(1, 10)
    parents = np.arange(100, dtype=np.uint64)[None, None] << np.uint64(50)
    fitness = np.arange(100.0)[None] - 1000.0
    how = breeding(rule=rule, crossover=0.0, mutation=0.0, elites=0, layout=layout)

    chosen = [bred(how, parents, fitness, g)[0, 0] >> np.uint64(50) for g in range(1, 101)]

    # Tournaments of two and shares proportional to rank both have the mean 2/3.
    assert np.mean(chosen) == pytest.approx(200.0 / 3.0, abs=1.5)


@pytest.mark.parametrize(
    ("n_bits", "probability"), [(40, 0.01), (3960, 0.01), (400 * 1310, 0.0015)]
)
def test_mutation_counts_have_the_binomial_distribution(n_bits, probability):
    thresholds = mutation_thresholds(n_bits, probability) / 2.0**32

    mass = np.diff(np.concatenate([[0.0], thresholds, [1.0]]))

    counts = np.arange(len(mass))
    assert mass @ counts == pytest.approx(n_bits * probability, rel=1e-6)
    variance = mass @ (counts - n_bits * probability) ** 2
    assert variance == pytest.approx(n_bits * probability * (1 - probability), rel=1e-4)


@pytest.mark.parametrize("layout", [Layout(4, 10), Layout(9, 16)])
def test_each_bit_mutates_with_the_given_probability(layout):
    parents, fitness = np.zeros((1, layout.n_words, 100), np.uint64), np.zeros((1, 100))
    how = breeding(mutation=0.02, elites=0, layout=layout)

    flips = sum(
        bits_of(bred(how, parents, fitness, g), layout)[0].sum(axis=0) for g in range(1, 201)
    )

    assert flips == pytest.approx(400.0, abs=5.0 * 20.0)  # five standard deviations
    assert flips.mean() == pytest.approx(400.0, abs=5.0 * 20.0 / layout.n_bits**0.5)


def test_mutation_one_half_flips_half_of_all_bits():
    how = breeding(mutation=0.5, elites=0)

    flips = bits_of(bred(how, np.zeros((1, 1, 100), np.uint64), np.zeros((1, 100))))

    assert flips.mean() == pytest.approx(0.5, abs=0.05)


def test_elites_do_not_mutate():
    how = breeding(mutation=0.5, elites=10)

    flips = bits_of(bred(how, np.zeros((1, 1, 100), np.uint64), np.zeros((1, 100))))

    assert flips[0, :10].sum() == 0
    assert flips[0, 10:].sum(axis=1).min() > 0


@given(st.integers(0, 2**64 - 1), st.integers(0, 2**20), st.integers(1, 10**6))
def test_a_population_breeds_alike_in_whatever_company(seed, stream, generation):
    rng = np.random.default_rng(seed)
    parents, fitness = random_strings(rng, k=3, m=20), rng.normal(size=(3, 20))
    keys, how = keys_of(3, seed, stream), breeding(m=20)

    together = bred(how, parents, fitness, generation, keys)
    alone = bred(how, parents[1:2].copy(), fitness[1:2].copy(), generation, keys[1:2].copy())

    assert np.array_equal(together[1], alone[0])


def test_the_first_generation_is_uniform_in_every_gene():
    layout = Layout(15, 5)
    strings = np.zeros((2, layout.n_words, 1000), np.uint64)

    first_generation(keys_of(2), layout.used(), strings)

    genes = bits_of(strings, layout).reshape(2, 1000, 15, 5) @ (1 << np.arange(4, -1, -1))
    counts = np.array([[np.bincount(genes[i, :, g], minlength=32) for g in range(15)]
                       for i in range(2)])  # fmt: skip
    assert ((counts - 1000 / 32) ** 2 / (1000 / 32)).sum(axis=2).max() < 75.0  # chi2, 31 degrees


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40))
def test_the_median_is_the_middle_element_of_the_sorted_ones(values):
    column = np.array(values) + 0.0  # no negative zero: equal to zero, but sorted before it

    median = lower_median(column, np.empty(len(column), np.int64))

    assert median == np.sort(column)[(len(column) - 1) // 2]


@given(st.lists(st.floats(-0.5, 0.5), min_size=1, max_size=20), st.floats(-3.1, 3.1))
def test_the_circular_median_turns_with_the_angles(offsets, turn):
    m = len(offsets)
    scratch, keys = np.empty(m), np.empty(m, np.int64)
    turned = np.array([wrap(turn + offset) for offset in offsets])

    median = circular_median(turned, turn, scratch, keys)

    plain = lower_median(np.array(offsets) + 0.0, keys)
    assert abs(wrap(median - turn - plain)) < 1e-12


@given(st.floats(-100, 100))
def test_wrapped_angles_are_the_same_directions_within_half_a_turn(angle):
    wrapped = wrap(angle)

    assert -np.pi - 1e-12 <= wrapped <= np.pi + 1e-12
    assert np.cos(wrapped) == pytest.approx(np.cos(angle), abs=1e-12)


def test_the_best_of_each_population_is_found_with_the_mean():
    fitness = np.array([[1.0, 3.0, 3.0], [0.5, -1.0, 2.0]])
    traits, terms = np.arange(12.0).reshape(2, 2, 3), -np.arange(6.0).reshape(2, 1, 3)
    rows = np.empty((2, 5))

    rank(fitness, traits, terms, rows)

    assert rows == pytest.approx(
        np.array([[3.0, 7.0 / 3.0, 1.0, 4.0, -1.0], [2.0, 0.5, 8.0, 11.0, -5.0]])
    )
