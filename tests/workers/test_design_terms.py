import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_workers.kernels.design import BPC, HC, JAC, JLC, LC, RC, Coupling, total_fitness
from tramnet_workers.kernels.planar import PlanarModel, evaluate_planar
from tramnet_workers.mpga_settings import SETTINGS, Ramp, Weights

SEEDS = st.integers(0, 2**32)
WEIGHTS = np.array([1.0, 5.0, 4.0, 1.5, 0.5, 2.0, 3.0, 0.01])


def coupling(t, reach=-1.0, closed=True, weights=WEIGHTS):
    rows = np.stack([np.arange(t) - 1, np.arange(t) + 1], axis=1)
    rows = rows % t if closed else np.where(rows == t, -1, rows)
    return Coupling(3, 2, 3, t, rows, weights, reach)


def random_population(rng, t, m=6):
    traits = np.concatenate(
        [
            rng.uniform(0.2, 0.7, (t, 3, m)),
            rng.uniform(-0.2, 0.2, (t, 2, m)),
            rng.uniform(-np.pi, np.pi, (t, 3, m)),
        ],
        axis=1,
    )
    return traits, rng.uniform(0.0, 1.0, (t, 8, m))


def rated(how, traits, terms, values, scale=1.0, first=0):
    fitness = np.empty((len(traits), traits.shape[2]))
    total_fitness(how, first, scale, values, traits, terms, fitness)
    return fitness


def wrapped(angle):
    return np.angle(np.exp(1j * np.asarray(angle)))


@given(SEEDS, st.integers(2, 6), st.booleans())
def test_connecting_terms_are_those_of_equations_9_to_11(seed, t, closed):
    rng = np.random.default_rng(seed)
    traits, terms = random_population(rng, t)
    values = traits.mean(axis=2)
    values[:, 5:] = np.angle(np.exp(1j * traits[:, 5:]).sum(axis=2))

    rated(coupling(t, closed=closed), traits, terms, values)

    for i in range(t):
        others = (values.sum(axis=0) - values[i]) / (t - 1)
        apart = traits[i] - others[:, None]
        assert terms[i, LC] == pytest.approx(abs(apart[:3]).sum(axis=0))
        assert terms[i, BPC] == pytest.approx(np.hypot(*apart[3:5]))
        around = [(i - 1) % t, (i + 1) % t] if closed else [h for h in (i - 1, i + 1) if 0 <= h < t]
        first, last = values[around[0], 5:], values[around[-1], 5:]
        middle = first + 0.5 * wrapped(last - first)
        jac = abs(wrapped(traits[i, 5:] - middle[:, None])).sum(axis=0)
        assert terms[i, JAC] == pytest.approx(jac, abs=1e-9)


@given(SEEDS, st.floats(0.0, 1.0))
def test_fitness_is_dexterity_less_all_weighted_penalties(seed, scale):
    traits, terms = random_population(np.random.default_rng(seed), 4)

    fitness = rated(coupling(4), traits, terms, traits.mean(axis=2), scale)

    w = WEIGHTS * [1, -1, -1, -1, -1, -scale, -scale, -1]
    assert fitness == pytest.approx(np.einsum("r,irj->ij", w, terms))


@given(SEEDS)
def test_populations_that_agree_pay_nothing_for_being_connected(seed):
    traits, terms = random_population(np.random.default_rng(seed), 1, m=1)
    traits, terms = np.repeat(traits, 5, axis=0), np.repeat(terms, 5, axis=0)

    rated(coupling(5), traits, terms, np.ascontiguousarray(traits[:, :, 0]))

    assert terms[:, LC:] == pytest.approx(0.0, abs=1e-12)


def test_one_population_has_nobody_to_agree_with():
    traits, terms = random_population(np.random.default_rng(0), 1)
    how = coupling(1)._replace(neighbours=np.full((1, 2), -1))

    rated(how, traits, terms, np.zeros((1, 8)))

    assert np.all(terms[:, LC:] == 0.0)


@given(SEEDS, st.floats(0.0, 0.4))
def test_a_mobile_base_pays_for_what_is_farthest_beyond_its_reach(seed, reach):
    traits, terms = random_population(np.random.default_rng(seed), 5)
    values = np.ascontiguousarray(traits[:, :, 0])

    rated(coupling(5, reach), traits, terms, values)

    for i in range(5):
        expected = 0.0
        for h in ((i - 1) % 5, (i + 1) % 5):
            distance = np.hypot(*(traits[i, 3:5] - values[h, 3:5, None]))
            expected = np.maximum(distance - reach, expected)
        assert terms[i, BPC] == pytest.approx(expected)


def test_fixed_poses_are_neighbours_but_not_part_of_the_average():
    traits, terms = random_population(np.random.default_rng(1), 2)
    values = np.concatenate([traits.mean(axis=2), np.full((2, 8), 9.0)])
    how = coupling(2)._replace(neighbours=np.array([[2, 1], [0, 3]]))

    rated(how, traits, terms, values)

    assert terms[0, LC] == pytest.approx(abs(traits[0, :3] - values[1, :3, None]).sum(axis=0))
    middle = values[2, 5:] + 0.5 * wrapped(values[1, 5:] - values[2, 5:])
    jac = abs(wrapped(traits[0, 5:] - middle[:, None])).sum(axis=0)
    assert terms[0, JAC] == pytest.approx(jac)


@given(SEEDS)
def test_a_population_is_rated_alike_in_whatever_company(seed):
    traits, terms = random_population(np.random.default_rng(seed), 5)
    values, alone = traits.mean(axis=2), terms[3:4].copy()

    together = rated(coupling(5), traits, terms, values)
    one = rated(coupling(5), np.ascontiguousarray(traits[3:4]), alone, values, first=3)

    assert np.array_equal(together[3], one[0])
    assert np.array_equal(terms[3], alone[0])


def private_terms(genes, point=(0.0, 0.0), printed_hc=False):
    limits = np.array([3.0, 1.0, 1.0])
    arm = PlanarModel(
        False, np.array([-limits, limits]), np.zeros((0, 2)), np.zeros((0, 4)), printed_hc
    )
    genes = np.asarray(genes, float)[None, :, None]
    terms = np.empty((1, 8, 1))
    places, traits = np.empty((1, 4, 2, 1)), np.empty((1, 8, 1))
    evaluate_planar(arm, np.array([point]), genes, places, traits, terms)
    return terms[0, :, 0]


def test_reachability_is_the_distance_of_the_tip_from_its_point():
    terms = private_terms([0, 0, 0, 0.1, 0.2, 0.3, 0.2, 0.1], point=(1.0, 0.5))

    assert terms[RC] == pytest.approx(np.hypot(1.0 - 0.7, 0.5 - 0.2))  # eq 6


def test_the_corrected_heuristic_wants_inner_links_longer_than_outer_ones():
    assert private_terms([0, 0, 0, 0, 0, 0.5, 0.3, 0.2])[HC] == 0.0
    assert private_terms([0, 0, 0, 0, 0, 0.2, 0.3, 0.5])[HC] == pytest.approx(0.3)


def test_the_printed_heuristic_wants_the_contrary():
    assert private_terms([0, 0, 0, 0, 0, 0.5, 0.3, 0.2], printed_hc=True)[HC] == pytest.approx(0.3)
    assert private_terms([0, 0, 0, 0, 0, 0.2, 0.3, 0.5], printed_hc=True)[HC] == 0.0


def test_joint_limits_cost_what_each_joint_is_beyond_them():
    terms = private_terms([3.1, 1.25, -1.5, 0, 0, 0.3, 0.3, 0.3])

    assert terms[JLC] == pytest.approx(0.1 + 0.25 + 0.5)  # eq 8


def test_the_ramp_grows_to_full_strength_and_the_paper_has_none():
    ramp = Ramp(decades=3.0, until=0.7)

    assert ramp.factor(0, 1000) == 1e-3
    assert ramp.factor(350, 1000) == pytest.approx(10**-1.5, rel=1e-14)
    assert ramp.factor(700, 1000) == ramp.factor(999, 1000) == 1.0
    assert SETTINGS["literal"].ramp.factor(0, 1000) == 1.0


def test_weights_come_in_the_order_of_equation_4():
    assert Weights(1, 2, 3, 4, 5, 6, 7, 8).as_tuple() == (1, 2, 3, 4, 5, 6, 7, 8)
