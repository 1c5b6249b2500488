import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_workers.evolution.generation import (
    SCALED,
    SHIFT,
    TOURNAMENT,
    Breeding,
    find_best,
    first_generation,
    mutation_thresholds,
    next_generation,
)
from tramnet_workers.kernels.order import circular_median, lower_median, wrap

RULES = pytest.mark.parametrize("rule", [SHIFT, SCALED, TOURNAMENT])


def breeding(seed=1, bits=10, rule=TOURNAMENT, crossover=0.9, mutation=0.01, elites=1, n_genes=4):
    return Breeding(
        seed=np.uint64(seed),
        bits=bits,
        rule=rule,
        crossover=int(crossover * 2**32),
        mutation=mutation_thresholds(n_genes * bits, mutation),
        elites=elites,
    )


def random_strings(rng, k=1, n_genes=4, m=100, bits=10):
    return rng.integers(0, 2**bits, (k, n_genes, m), dtype=np.uint16)


def bred(how, parents, fitness, generation=1, keys=None):
    children = np.zeros_like(parents)
    keys = np.arange(len(parents), dtype=np.uint64) if keys is None else keys
    next_generation(how, keys, generation, fitness, parents, children)
    return children


def bits_of(strings, bits=10):
    """Spread chromosomes into bits, of shape (k, m, n_genes * bits)."""
    shifts = np.arange(bits - 1, -1, -1)
    spread = (strings.transpose(0, 2, 1)[..., None] >> shifts) & 1
    return spread.reshape(*spread.shape[:2], -1)


@RULES
def test_without_crossover_and_mutation_children_are_copies_of_parents(rule):
    parents = random_strings(np.random.default_rng(0))
    fitness = np.random.default_rng(1).normal(size=(1, 100))

    children = bred(breeding(rule=rule, crossover=0.0, mutation=0.0), parents, fitness)

    assert set(map(tuple, children[0].T)) <= set(map(tuple, parents[0].T))


@given(st.integers(0, 2**63), st.integers(2, 31), st.integers(5, 16))
def test_crossover_neither_loses_nor_invents_a_bit_of_a_couple(seed, m, bits):
    parents = random_strings(np.random.default_rng(seed), m=m - m % 2, bits=bits)
    fitness = np.zeros((1, parents.shape[2]))
    how = breeding(seed=seed, bits=bits, crossover=1.0, mutation=0.0, elites=0)
    straight = how._replace(crossover=0)

    crossed = bits_of(bred(how, parents, fitness), bits)
    copied = bits_of(bred(straight, parents, fitness), bits)

    pairs = crossed.reshape(-1, 2, 4 * bits), copied.reshape(-1, 2, 4 * bits)
    assert np.array_equal(pairs[0].sum(axis=1), pairs[1].sum(axis=1))
    assert np.array_equal(pairs[0][:, :, 0], pairs[1][:, :, 0])  # the cut is never before bit 1


def test_one_point_crossover_exchanges_the_tail_of_the_string():
    parents = np.zeros((1, 4, 2), np.uint16)
    parents[0, :, 1] = 2**10 - 1
    fitness = np.zeros((1, 2))
    how = breeding(crossover=1.0, mutation=0.0, elites=0)

    cuts = set()
    for generation in range(1, 400):
        child = bits_of(bred(how, parents, fitness, generation))[0, 0]
        changes = np.flatnonzero(np.diff(child))
        assert len(changes) <= 1
        cuts.update(changes + 1)

    assert cuts == set(range(1, 40))


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

    children = bred(breeding(elites=2), parents, fitness)

    assert np.array_equal(children[0, :, :2], parents[0][:, [1, 2]])


@RULES
def test_selection_favours_fit_parents(rule):
    parents = np.arange(100, dtype=np.uint16)[None, None]
    fitness = np.arange(100.0)[None] - 1000.0
    how = breeding(rule=rule, crossover=0.0, mutation=0.0, elites=0, n_genes=1)

    children = np.concatenate([bred(how, parents, fitness, g)[0, 0] for g in range(1, 101)])

    # Tournaments of two and shares proportional to rank both have the mean 2/3.
    assert children.mean() == pytest.approx(200.0 / 3.0, abs=1.5)


@pytest.mark.parametrize(("n_bits", "probability"), [(40, 0.01), (40, 0.005), (1310, 0.004)])
def test_mutation_counts_have_the_binomial_distribution(n_bits, probability):
    thresholds = mutation_thresholds(n_bits, probability) / 2.0**32

    mass = np.diff(np.concatenate([[0.0], thresholds, [1.0]]))

    assert mass @ np.arange(len(mass)) == pytest.approx(n_bits * probability, rel=1e-6)
    variance = mass @ np.arange(len(mass)) ** 2 - (n_bits * probability) ** 2
    assert variance == pytest.approx(n_bits * probability * (1 - probability), rel=1e-5)


def test_each_bit_mutates_with_the_given_probability():
    parents = np.zeros((1, 4, 100), np.uint16)
    fitness = np.zeros((1, 100))
    how = breeding(mutation=0.02, elites=0)

    flips = sum(bits_of(bred(how, parents, fitness, g))[0].sum(axis=0) for g in range(1, 201))

    assert flips == pytest.approx(400.0, abs=5.0 * 20.0)  # five standard deviations
    assert flips.mean() == pytest.approx(400.0, abs=5.0 * 20.0 / 40**0.5)


def test_mutation_one_half_flips_half_of_all_bits():
    flips = bits_of(bred(breeding(mutation=0.5, elites=0), np.zeros((1, 4, 100), np.uint16),
                         np.zeros((1, 100))))  # fmt: skip

    assert flips.mean() == pytest.approx(0.5, abs=0.05)


@given(st.integers(0, 2**64 - 1), st.integers(0, 2**20), st.integers(1, 10**6))
def test_a_population_breeds_alike_in_whatever_company(seed, stream, generation):
    rng = np.random.default_rng(seed)
    parents, fitness = random_strings(rng, k=3, m=20), rng.normal(size=(3, 20))
    keys = np.arange(stream, stream + 3, dtype=np.uint64)
    how = breeding(seed=seed)

    together = bred(how, parents, fitness, generation, keys)
    alone = bred(how, parents[1:2].copy(), fitness[1:2].copy(), generation, keys[1:2].copy())

    assert np.array_equal(together[1], alone[0])


def test_the_first_generation_is_uniform_in_every_gene():
    strings = np.zeros((2, 5, 1000), np.uint16)

    first_generation(breeding(bits=5, n_genes=5), np.arange(2, dtype=np.uint64), strings)

    counts = np.array([[np.bincount(gene, minlength=32) for gene in block] for block in strings])
    assert counts.shape == (2, 5, 32)
    assert ((counts - 1000 / 32) ** 2 / (1000 / 32)).sum(axis=2).max() < 70.0  # chi2, 31 degrees


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
    best, mean = np.empty(2, np.int64), np.empty(2)

    find_best(fitness, best, mean)

    assert best.tolist() == [1, 2]
    assert mean == pytest.approx(fitness.mean(axis=1))
