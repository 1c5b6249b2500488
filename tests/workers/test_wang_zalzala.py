import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_workers.evolution.wang_zalzala import WangZalzala, WangZalzalaSettings
from tramnet_workers.kernels.grid import LEAST_STEP, MOST_STEP, LevelGrid

N, JOINTS, SEGMENTS = 40, 6, 16


def levels(lowest: int = -999, highest: int = 999, joints: int = JOINTS) -> LevelGrid:
    shape = (joints, SEGMENTS - 1)
    return LevelGrid(
        np.zeros(joints, np.int16),
        np.full(joints, SEGMENTS, np.int16),
        np.ones(joints, np.int16),
        np.full(shape, lowest, np.int16),
        np.full(shape, highest, np.int16),
    )


def algorithm(
    seed: int = 1, grid: LevelGrid | None = None, size: int = N, **settings: object
) -> WangZalzala:
    return WangZalzala(seed, size, grid or levels(), WangZalzalaSettings(**settings))


def steps(genomes: np.ndarray) -> np.ndarray:
    """Steps from node to node, the two fixed nodes included."""
    n = genomes.shape[2] + 1
    ends = np.zeros((*genomes.shape[:2], 1), np.int16)
    return np.diff(np.concatenate([ends, genomes, ends + n], axis=2), axis=2)


def rank(genomes: np.ndarray) -> np.ndarray:
    """An objective that likes the line: 1 for it, more with each level beside it."""
    line = np.arange(1, genomes.shape[2] + 1)
    return 1.0 + np.abs(genomes - line).sum(axis=(1, 2)) / 100.0


@given(
    seed=st.integers(0, 2**63 - 1),
    bias=st.floats(0.0, 1.0),
    generation=st.integers(1, 50),
)
def test_whatever_is_bred_moves_to_one_of_six_neighbours_at_every_node(seed, bias, generation):
    wang = algorithm(seed, goal_bias=bias)
    genomes = wang.initial()

    bred = wang.breed(genomes, rank(genomes), generation)

    for population in (genomes, bred):
        assert steps(population).min() >= LEAST_STEP
        assert steps(population).max() <= MOST_STEP


@given(seed=st.integers(0, 2**31), generation=st.integers(1, 9))
def test_breeding_is_a_function_of_its_arguments_and_leaves_them_alone(seed, generation):
    one, other = algorithm(seed), algorithm(seed)
    genomes = one.initial()
    before = genomes.copy()

    bred = one.breed(genomes, rank(genomes), generation)

    np.testing.assert_array_equal(genomes, before)
    np.testing.assert_array_equal(bred, other.breed(genomes, rank(genomes), generation))


def test_another_seed_or_generation_breeds_another_population():
    genomes = algorithm().initial()
    bred = algorithm().breed(genomes, rank(genomes), 1)

    assert (bred != algorithm(seed=2).breed(genomes, rank(genomes), 1)).any()
    assert (bred != algorithm().breed(genomes, rank(genomes), 2)).any()


@given(seed=st.integers(0, 2**31))
def test_position_limits_hold_in_every_generation(seed):
    wang = algorithm(seed, levels(lowest=-1, highest=SEGMENTS + 1), goal_bias=0.4)
    genomes = wang.initial()

    for generation in range(1, 4):
        genomes = wang.breed(genomes, rank(genomes), generation)

        assert genomes.min() >= -1
        assert genomes.max() <= SEGMENTS + 1


def test_a_bias_of_one_draws_the_line():
    genomes = algorithm(goal_bias=1.0).initial()

    assert (genomes == np.arange(1, SEGMENTS)).all()


def test_the_bias_is_about_the_share_of_steps_of_one():
    drawn = steps(algorithm(3, size=2000).initial())

    assert (drawn == 1).mean() == pytest.approx(
        0.95, abs=0.02
    )  # walks that meet are a little freer
    assert set(np.unique(drawn)) == {-2, -1, 0, 1, 2, 3}


def test_no_more_than_criteria_equal_strings_stay():
    wang = algorithm(goal_bias=0.9, xor=0.0, pmutr=0.0, destroy=0.0)
    same = np.repeat(wang.initial()[:1], N, axis=0)

    bred = wang.breed(same, rank(same), 1)

    _, counts = np.unique(bred.reshape(N, -1), axis=0, return_counts=True)
    assert counts.max() <= 4


def test_equal_strings_are_parents_no_more_than_samemax_times():
    quiet = {"xor": 0.0, "pmutr": 0.0, "destroy": 0.0, "criteria": N}
    wang = algorithm(goal_bias=0.6, samemax=6, **quiet)
    genomes = wang.initial()
    genomes[:10] = genomes[0]
    objectives = np.full(N, 1.999)
    objectives[:10] = 0.01  # ten equal strings with nearly all the fitness
    objectives[-1] = 2.0

    bred = wang.breed(genomes, objectives, 1)

    copies = (bred == genomes[0]).all(axis=(1, 2)).sum()
    assert 6 <= copies <= 10  # no more than samemax, but for draws that found nothing else


def test_the_fitter_string_is_drawn_more_often():
    quiet = {"xor": 0.0, "pmutr": 0.0, "destroy": 0.0, "criteria": 1000, "samemax": 1000}
    wang = algorithm(size=400, goal_bias=0.6, **quiet)
    genomes = wang.initial()
    objectives = np.full(400, 1.0)
    objectives[:200] = 0.25  # fitness 1.75 against 1

    bred = wang.breed(genomes, objectives, 1)

    fit = {genome.tobytes() for genome in genomes[:200]}
    share = np.mean([genome.tobytes() in fit for genome in bred])
    assert share == pytest.approx(1.75 / 2.75, abs=0.08)


@given(seed=st.integers(0, 2**31), radius=st.integers(0, 3))
def test_crossing_neither_loses_nor_invents_a_level(seed, radius):
    wang = algorithm(
        seed, goal_bias=0.5, circle_radius=radius, pmutr=0.0, destroy=0.0, samemax=N, criteria=N
    )
    genomes = wang.initial()
    same_fitness = np.ones(N)

    bred = wang.breed(genomes, same_fitness, 1)

    known = [set(column.tolist()) for column in genomes.reshape(N, -1).T]
    for column, values in zip(bred.reshape(N, -1).T, known, strict=True):
        assert set(column.tolist()) <= values


def test_elites_survive_when_asked_for():
    wang = algorithm(goal_bias=0.6, elites=3)
    genomes = wang.initial()
    best = np.argsort(rank(genomes), kind="stable")[:3]

    bred = wang.breed(genomes, rank(genomes), 1)

    np.testing.assert_array_equal(bred[:3], genomes[best])


def test_selection_and_crossing_bring_the_population_nearer_to_the_line():
    wang = algorithm(size=100, goal_bias=0.6)
    genomes = wang.initial()
    first = np.median(rank(genomes))
    for generation in range(1, 120):
        genomes = wang.breed(genomes, rank(genomes), generation)

    assert np.median(rank(genomes)) < first
