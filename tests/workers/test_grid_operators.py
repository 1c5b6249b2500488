"""Operators on the grid: what they draw and change stays on it, and the whole finds the paper's time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.evolution.selection import first_equals
from tramnet_workers.evolution.wang_zalzala import WangZalzala, WangZalzalaSettings
from tramnet_workers.kernels.grid import (
    LEAST_STEP,
    MOST_STEP,
    Key,
    LevelGrid,
    Walk,
    random_trajectories,
)
from tramnet_workers.kernels.grid_operators import (
    Circle,
    Shift,
    cross_circles,
    destroy_trajectories,
    shift_positions,
)
from tramnet_workers.problems.grid_motion import GridMotion
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.puma560 import akb

Levels = NDArray[np.int16]

PURPOSE = 9

seeds = st.integers(0, 2**63 - 1)


def level_grid(n: int, margin: int = 0, still: int = 0, n_joints: int = 4) -> LevelGrid:
    """A grid of which the last ``still`` joints come back to where they started."""
    goal = np.full(n_joints, n, np.int16)
    goal[n_joints - still :] = 0
    nodes = (n_joints, n - 1)
    around = np.where(goal[:, None] == 0, 3, margin)
    return LevelGrid(
        np.zeros(n_joints, np.int16),
        goal,
        (goal > 0).astype(np.int16),
        np.broadcast_to(-around, nodes).astype(np.int16),
        np.broadcast_to(goal[:, None] + around, nodes).astype(np.int16),
    )


grids = st.builds(
    level_grid, n=st.integers(2, 26), margin=st.integers(0, 4), still=st.integers(0, 2)
)
biases = st.sampled_from([1 / 6, 0.6, 0.95, 1.0])


def check_on_grid(grid: LevelGrid, genomes: Levels) -> None:
    """Every node is within the bounds, and every step is one of the six."""
    assert (genomes >= grid.lower).all()
    assert (genomes <= grid.upper).all()
    ends = [np.broadcast_to(e[:, None], (*genomes.shape[:2], 1)) for e in (grid.start, grid.goal)]
    steps = np.diff(np.concatenate([ends[0], genomes, ends[1]], axis=2), axis=2)
    assert steps.min() >= LEAST_STEP
    assert steps.max() <= MOST_STEP


def random_population(grid: LevelGrid, seed: int, n: int = 12, bias: float = 0.6) -> Levels:
    return WangZalzala(seed, n, grid, WangZalzalaSettings(goal_bias=bias)).initial()


@given(grid=grids, seed=seeds, bias=biases)
def test_random_trajectories_lead_from_start_to_goal_by_possible_steps(
    grid: LevelGrid, seed: int, bias: float
) -> None:
    genomes = random_population(grid, seed, bias=bias)

    check_on_grid(grid, genomes)


def test_a_goal_bias_of_one_draws_straight_lines() -> None:
    genomes = random_population(level_grid(16, still=1), 1, bias=1.0)

    assert (genomes[:, :3] == np.arange(1, 16)).all()
    assert (genomes[:, 3] == 0).all()


def test_steps_towards_the_goal_come_with_their_probability() -> None:
    # With one inner node and a goal of level 1 every first step meets the goal, so none is redrawn.
    wide = np.full((4, 1), 9, np.int16)
    one = np.ones(4, np.int16)
    grid = LevelGrid(0 * one, one, one, -wide, wide)

    steps = random_population(grid, 5, n=4000, bias=0.6).ravel()

    share = np.bincount(steps - LEAST_STEP, minlength=6) / len(steps)
    # Standard deviations are below 0.004.
    assert share == pytest.approx([0.08, 0.08, 0.08, 0.6, 0.08, 0.08], abs=0.02)


def test_walks_that_never_meet_leave_the_straight_line() -> None:
    grid = level_grid(16)
    genomes = np.zeros((1, 4, 15), np.int16)

    random_trajectories(grid, Walk(0.5, 0), Key(1, 0, 1), PURPOSE, np.arange(1), genomes)

    assert (genomes[0] == np.arange(1, 16)).all()


@given(grid=grids, seed=seeds, radius=st.integers(0, 6))
def test_crossing_neither_loses_nor_invents_genes(grid: LevelGrid, seed: int, radius: int) -> None:
    parents = random_population(grid, seed, n=9)
    children = parents.copy()

    cross_circles(grid, Circle(1.0, radius, 10), Key(seed, 0, 1), PURPOSE, children)

    check_on_grid(grid, children)
    pairs = (8, *parents.shape[1:])
    shape = (4, 2, *pairs[1:])
    before, after = parents[:8].reshape(shape), children[:8].reshape(shape)
    assert (np.sort(before, axis=1) == np.sort(after, axis=1)).all()
    assert (children[8] == parents[8]).all()


def test_pairs_that_lie_apart_do_not_cross() -> None:
    grid = level_grid(16, margin=20)
    genomes = np.zeros((2, 4, 15), np.int16)
    genomes[1] = 10

    cross_circles(grid, Circle(1.0, 9, 50), Key(1, 0, 1), PURPOSE, genomes)

    assert (genomes[0] == 0).all()
    assert (genomes[1] == 10).all()


@given(grid=grids, seed=seeds, variation=st.integers(1, 4))
def test_the_position_operator_moves_few_nodes_a_little(
    grid: LevelGrid, seed: int, variation: int
) -> None:
    before = random_population(grid, seed)
    after = before.copy()

    shift_positions(grid, Shift(1.0, 1, variation), Key(seed, 0, 1), PURPOSE, after)

    check_on_grid(grid, after)
    moved = np.abs(after - before)
    assert ((moved > 0).sum(axis=(1, 2)) <= 1).all()
    assert moved.max() <= variation


def test_the_position_operator_finds_all_variations() -> None:
    grid = level_grid(16, margin=4)
    moved = set()
    for seed in range(300):
        genomes = np.arange(1, 16, dtype=np.int16) + np.zeros((8, 4, 1), np.int16)
        shift_positions(grid, Shift(1.0, 1, 2), Key(seed, 0, 1), PURPOSE, genomes)
        moved |= set((genomes - np.arange(1, 16)).ravel().tolist())

    assert moved == {-2, -1, 0, 1, 2}


@given(seed=seeds)
def test_destroyed_trajectories_are_as_many_as_their_rate_says(seed: int) -> None:
    grid = level_grid(16)
    genomes = random_population(grid, seed, n=200)
    before = genomes.copy()

    destroy_trajectories(grid, Walk(0.6, 200), 0.25, Key(seed, 0, 1), PURPOSE, genomes)

    check_on_grid(grid, genomes)
    destroyed = (genomes != before).any(axis=(1, 2)).sum()
    assert 15 <= destroyed <= 90  # 50 of 200, and more than five standard deviations either way


@given(grid=grids, seed=seeds, elites=st.integers(0, 3))
@settings(max_examples=30)
def test_a_bred_population_is_on_the_grid_and_no_kind_is_there_too_often(
    grid: LevelGrid, seed: int, elites: int
) -> None:
    algorithm = WangZalzala(seed, 20, grid, WangZalzalaSettings(elites=elites))
    genomes = np.repeat(random_population(grid, seed, n=2), 10, axis=0)  # only two kinds
    objectives = np.arange(1.0, 21.0)

    children = algorithm.breed(genomes, objectives, 3)

    check_on_grid(grid, children)
    assert children.shape == genomes.shape
    for elite in range(elites):
        assert (children[elite] == genomes[elite]).all()


def test_equal_trajectories_beyond_criteria_are_replaced() -> None:
    grid = level_grid(16)
    algorithm = WangZalzala(1, 40, grid, WangZalzalaSettings(goal_bias=0.6))
    genomes = np.repeat(random_population(grid, 1, n=1), 40, axis=0)

    children = algorithm.breed(genomes, np.ones(40), 1)

    counts = np.bincount(first_equals(children.reshape(40, -1)))
    assert counts.max() == 4  # Criteria of section 5


@given(seed=seeds, generation=st.integers(1, 10**6))
@settings(max_examples=20)
def test_breeding_is_a_function_of_its_arguments_and_the_seed(seed: int, generation: int) -> None:
    grid = level_grid(16)
    algorithm = WangZalzala(seed, 30, grid)
    genomes, objectives = algorithm.initial(), np.linspace(0.5, 3.0, 30)
    copy = genomes.copy()

    first = algorithm.breed(genomes, objectives, generation)
    algorithm.breed(first, objectives, generation + 1)
    again = WangZalzala(seed, 30, grid).breed(genomes, objectives, generation)

    assert first.tobytes() == again.tobytes()
    assert genomes.tobytes() == copy.tobytes()
    assert first.tobytes() != algorithm.breed(genomes, objectives, generation + 1).tobytes()


def test_seeds_use_all_their_bits() -> None:
    grid = level_grid(16)

    populations = {random_population(grid, seed).tobytes() for seed in (1, 2**63 + 1, 2**64 - 1)}

    assert len(populations) == 3


def test_a_population_without_room_for_its_elites_is_refused() -> None:
    with pytest.raises(InvalidParameters, match="3 elites"):
        WangZalzala(1, 2, level_grid(16), WangZalzalaSettings(elites=3))


def best_motion(seed: int, generations: int) -> tuple[float, float]:
    problem = GridMotion(MotionTask.for_arm(akb(), PAPER_START, PAPER_GOAL))
    algorithm = WangZalzala(seed, 100, problem.grid)
    genomes, best = algorithm.initial(), (np.inf, np.empty(0, np.int16))
    for generation in range(1, generations + 1):
        objectives = problem.evaluate(genomes)
        slot = int(np.argmin(objectives))
        best = min(best, (float(objectives[slot]), genomes[slot]), key=lambda found: found[0])
        genomes = algorithm.breed(genomes, objectives, generation)
    plan = problem.plan(best[1])
    assert plan is not None
    return plan.duration, float(np.abs(plan.qd[-1]).max())


def test_case_1_is_as_fast_as_in_the_paper_and_stops() -> None:
    runs = [best_motion(seed, 60) for seed in (1, 2, 3)]

    # Table 2: 0.431 s after 70 generations.
    assert np.median([seconds for seconds, _ in runs]) <= 0.431
    assert np.median([speed for _, speed in runs]) < 1e-6
