"""The evolution of Lin, Chen & Yu (2017): its laws, its keys, and what it reaches."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.evolution.streams import Purpose
from tramnet_workers.kernels import breeding as operators
from tramnet_workers.kernels import eamp, kinematics
from tramnet_workers.kernels.distances import segment_box_distances
from tramnet_workers.kernels.lanes import LANES
from tramnet_workers.kernels.scenes import Scene
from tramnet_workers.kernels.tracking import evaluate_steps, new_stage, set_stage
from tramnet_workers.problems.line_tracking import track
from tramnet_workers.problems.tracking_report import report_points, summarise
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.tracking_evolution import Eamp, mutation_thresholds

Array = NDArray[np.float64]

PAPER = TrackingTask.of_paper()
SMALL = Eamp(population=60, generations=4, seed=3)
BOXES = [
    (5.0, 50.0, 50.0, 15.0, 100.0, 50.0),
    (20.0, 40.0, 20.0, 40.0, 60.0, 45.0),
    (-40.0, 20.0, 80.0, -10.0, 60.0, 95.0),
]


def candidates(count: int, seed: int = 1) -> Array:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 8)) * PAPER.step


def reference_costs(scene: Scene, k: int, q: Array, dq: Array) -> Array:
    """Return the costs of steps with the formulas of the paper and nothing clever."""
    points = kinematics.chain_points(scene.chain, q + dq)
    error = np.linalg.norm(points[:, -1] - scene.targets[k], axis=1)
    apart = np.full(len(dq), np.inf)
    for start, end in scene.links:
        for box in scene.boxes:
            row = np.tile(box, (len(dq), 1))
            ends = points[:, start].copy(), points[:, end].copy()
            apart = np.minimum(apart, segment_box_distances(*ends, row))
    goal = scene.objective
    clearance = np.maximum(apart - goal.radius, 1e-3)
    inside = goal.error_weight * error**2 / 2 + goal.clearance_weight / clearance**2
    worst = goal.error_weight * goal.zone**2 / 2 + goal.clearance_weight / 1e-3**2
    return np.where(error <= goal.zone, inside, worst + 1e3 * (error - goal.zone))


@pytest.mark.parametrize("radius", [0.0, 1.5])
@pytest.mark.parametrize("boxes", [[], BOXES[:1], BOXES])
def test_costs_agree_with_the_paper_s_formulas(
    boxes: list[tuple[float, ...]], radius: float
) -> None:
    task = TrackingTask.for_arm(
        PAPER.arm, PAPER.start, PAPER.path, boxes=boxes, radius=radius, zone=0.4
    )
    scene, dq = task.scene(0.1), candidates(500)

    costs = evaluate_steps(scene, 1, task.start.copy(), dq)

    expected = reference_costs(scene, 1, task.start, dq)
    assert 0.1 < (expected < 1e3).mean() < 0.9
    np.testing.assert_allclose(costs, expected, rtol=1e-9)


def test_whoever_is_in_the_zone_ranks_before_whoever_is_not() -> None:
    colliding = PAPER.path[1] + np.array([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0]).reshape(2, 3)
    task = TrackingTask.for_arm(
        PAPER.arm, PAPER.start, PAPER.path, boxes=[colliding.ravel()], zone=0.4
    )
    dq = candidates(500)

    costs = evaluate_steps(task.scene(5.0), 1, task.start.copy(), dq)

    tips = task.chain.points(task.start + dq)[:, -1]
    errors = np.linalg.norm(tips - task.path[1], axis=1)
    inside = errors <= 0.4
    assert costs[inside].max() < costs[~inside].min()
    assert (np.argsort(costs[~inside]) == np.argsort(errors[~inside])).all()


@given(st.integers(1, 2 * LANES + 3))
def test_the_cost_of_a_step_does_not_depend_on_the_others(count: int) -> None:
    scene, dq = PAPER.scene(0.1), candidates(40)

    together = evaluate_steps(scene, 1, PAPER.start.copy(), dq)

    part = evaluate_steps(scene, 1, PAPER.start.copy(), dq[:count].copy())
    np.testing.assert_array_equal(together[:count], part)


def test_pairs_that_cannot_be_nearest_are_left_out_without_a_trace() -> None:
    task = TrackingTask.for_arm(PAPER.arm, PAPER.start, PAPER.path, boxes=BOXES, zone=10.0)
    scene, dq = task.scene(1.0), candidates(400)
    everything = scene._replace(swings=np.full(len(scene.swings), 1e6))
    stage = new_stage(scene)

    set_stage(scene, 1, task.start.copy(), stage)

    assert 0 < stage.n_pairs[0] < len(scene.links) * len(BOXES)
    np.testing.assert_array_equal(
        evaluate_steps(scene, 1, task.start.copy(), dq),
        evaluate_steps(everything, 1, task.start.copy(), dq),
    )


def breed(
    settings: Eamp, parents: Array, costs: Array, generation: int = 5, size: float = 1.0
) -> Array:
    """Return the children of parents of shape (population, n), in a box of this half size."""
    n = parents.shape[1]
    breeding = settings.breeding(n, 0)
    nursery = operators.new_nursery(breeding, n)
    nursery.genes[:n, : len(parents)] = parents.T
    nursery.costs[0, : len(parents)] = costs
    low, high = np.full(n, -size), np.full(n, size)
    operators.breed(
        breeding, generation, low, high, nursery, nursery.genes[:n], nursery.costs[0],
        nursery.genes[n:],
    )  # fmt: skip
    return nursery.genes[n:, : len(parents) - settings.elites].T.copy()


def population(size: int, seed: int = 0) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (size, 8)), rng.random(size)


@given(st.integers(0, 2**64 - 1), st.integers(12, 45), st.sampled_from(["gaussian", "uniform"]))
def test_children_stay_in_the_box(seed: int, size: int, mutating: str) -> None:
    parents, costs = population(size)
    settings = replace(SMALL, population=size, seed=seed, mutation=0.5, mutating=mutating)

    children = breed(settings, parents, costs)

    assert (np.abs(children) <= 1.0).all()


def test_without_crossover_and_mutation_children_are_winners_of_tournaments() -> None:
    parents, costs = population(1000)
    copies = replace(SMALL, population=1000, crossover=0.0, mutation=0.0)

    children = breed(copies, parents, costs)

    same = (children[:, None] == parents).all(axis=2)
    assert (same.sum(axis=1) == 1).all()
    # The better of two uniform numbers is 1/3 in the mean, with deviation 0.24 / sqrt(998).
    assert abs(costs[same.argmax(axis=1)].mean() - 1 / 3) < 0.04


def test_larger_tournaments_choose_better_parents() -> None:
    parents, costs = population(60)
    copies = replace(SMALL, crossover=0.0, mutation=0.0)

    means = [
        costs[(breed(replace(copies, tournament=size), parents, costs)[:, None] == parents)
              .all(axis=2).argmax(axis=1)].mean()
        for size in (1, 2, 5)
    ]  # fmt: skip

    assert means[0] > means[1] > means[2]


def test_blended_children_lie_between_their_parents() -> None:
    rng = np.random.default_rng(5)
    ends = np.array([np.zeros(8), np.full(8, 0.5)])
    parents = ends[rng.integers(0, 2, 60)]

    children = breed(replace(SMALL, crossover=1.0, mutation=0.0), parents, rng.random(60))

    assert (np.ptp(children, axis=1) < 1e-15).all()
    assert (children >= 0.0).all()
    assert (children <= 0.5).all()
    assert len(np.unique(children[:, 0].round(12))) > 10


def test_couples_exchange_the_genes_before_one_point() -> None:
    parents, costs = population(60)
    settings = replace(SMALL, crossover=1.0, mutation=0.0, crossing="single-point")

    children = breed(settings, parents, costs)

    owners = (children[:, None] == parents).argmax(axis=1)
    assert (children[:, None] == parents).any(axis=1).all()
    assert (np.count_nonzero(np.diff(owners, axis=1), axis=1) <= 1).all()
    couples = np.sort(np.stack([owners[:29], owners[29:]], axis=2), axis=2)
    assert (couples == couples[:, :1]).all()


@pytest.mark.parametrize(("mutating", "deviation"), [("gaussian", 0.331), ("uniform", 0.577)])
def test_mutation_redraws_genes_as_often_and_as_far_as_it_should(
    mutating: str, deviation: float
) -> None:
    parents = np.full((20_000, 8), 0.75)
    settings = Eamp(
        population=20_000, crossover=0.0, mutation=0.03, mutating=mutating, elites=0, seed=7
    )

    children = breed(settings, parents, np.zeros(20_000))

    new = children[children != 0.75]
    assert abs(len(new) / children.size - 0.03) < 0.002
    assert abs(new.std() - deviation) < 0.01
    assert abs(new.mean()) < 0.03


def test_elites_survive_and_ties_go_to_the_lowest_index() -> None:
    settings = replace(SMALL, population=40, elites=3)
    breeding = settings.breeding(8, 0)
    nursery = operators.new_nursery(breeding, 8)
    costs = np.ones(40)
    costs[[30, 11, 25]] = 0.5, 0.25, 0.5
    nursery.costs[0, :40] = costs
    nursery.genes[:8, :40] = np.arange(40.0)

    operators.keep_elites(
        breeding, nursery.genes[:8], nursery.costs[0], nursery.genes[8:], nursery.costs[1]
    )

    assert nursery.genes[8, 37:40].tolist() == [11.0, 25.0, 30.0]
    assert nursery.costs[1, 37:40].tolist() == [0.25, 0.5, 0.5]


@given(st.integers(1, 12), st.floats(0.0, 1.0))
def test_thresholds_are_the_binomial_distribution(n: int, probability: float) -> None:
    thresholds = mutation_thresholds(n, probability).astype(np.float64) / 2**32

    mean = (1.0 - thresholds).sum()  # of a number is the sum of the chances that it exceeds k
    assert (np.diff(thresholds) >= 0.0).all()
    np.testing.assert_allclose(mean, n * probability, atol=1e-7)


def test_the_streams_purposes_are_registered() -> None:
    assert eamp.FIRST_STEPS == Purpose.FIRST_STEPS
    assert operators.COUPLES == Purpose.COUPLES
    assert operators.MUTATED_STEPS == Purpose.MUTATED_STEPS


@given(st.sets(st.integers(2, 30), max_size=4))
def test_a_path_may_be_cut_into_runs_anywhere(cuts: set[int]) -> None:
    whole = track(PAPER, SMALL, 1, 31, PAPER.start)

    posture, pieces = PAPER.start, []
    ends = [1, *sorted(cuts), 31]
    for first, last in pairwise(ends):
        pieces.append(track(PAPER, SMALL, first, last, posture))
        posture = pieces[-1].path[-1]

    np.testing.assert_array_equal(np.vstack([piece.path for piece in pieces]), whole.path)
    np.testing.assert_array_equal(np.concatenate([piece.cost for piece in pieces]), whole.cost)


def test_the_seed_the_sub_population_and_the_point_decide_what_is_drawn() -> None:
    def first_step(seed: int, subpopulation: int, k: int) -> tuple[float, ...]:
        run = track(PAPER, replace(SMALL, seed=seed), k, k + 1, PAPER.start, subpopulation)
        return tuple(run.path[0])

    draws = [first_step(*key) for key in ((1, 0, 1), (2, 0, 1), (1, 1, 1), (1, 0, 2))]

    assert first_step(1, 0, 1) == draws[0]
    assert len(set(draws)) == 4


@pytest.mark.parametrize("settings", [SMALL, replace(SMALL, draws=4), Eamp.recommended()])
def test_costs_told_are_those_of_the_steps_taken(settings: Eamp) -> None:
    run = track(PAPER, settings, 1, 21, PAPER.start)

    path = np.vstack([PAPER.start, run.path])
    for k in range(1, 21):
        again = evaluate_steps(
            PAPER.scene(0.1), k, path[k - 1].copy(), np.diff(path, axis=0)[k - 1 : k].copy()
        )
        np.testing.assert_allclose(run.cost[k - 1], again[0], rtol=1e-9)


def test_more_draws_begin_with_a_better_population() -> None:
    quick = Eamp(population=100, generations=0, seed=1)

    costs = [track(PAPER, replace(quick, draws=n), 1, 2, PAPER.start).cost[0] for n in (1, 20)]

    assert costs[1] <= costs[0]


def test_joint_limits_hold() -> None:
    arm = replace(
        PAPER.arm, position_upper=PAPER.start + 1e-4, position_lower=PAPER.start - np.pi / 8
    )
    task = TrackingTask.for_arm(arm, PAPER.start, PAPER.path[:40])

    run = track(task, SMALL, 1, 40, task.start)

    assert (run.path <= arm.position_upper).all()
    assert (run.path >= arm.position_lower).all()


@pytest.mark.parametrize("size", [500, 1000])
def test_the_paper_s_task_is_followed_as_well_as_the_paper_s_numbers_allow(size: int) -> None:
    run = track(PAPER, Eamp(population=size, seed=1), 1, 1001, PAPER.start)

    path = np.vstack([PAPER.start, run.path])
    summary = summarise(PAPER, path, report_points(PAPER, path))
    assert summary.error_mean <= 0.003
    assert summary.error_max <= 0.05
    assert summary.points_outside_zone == 0
    assert summary.clearance_min_settled >= 4.0
    assert summary.step_max <= PAPER.step.max()


def test_without_a_weight_for_the_clearance_the_arm_collides() -> None:
    careless = TrackingTask.for_arm(
        PAPER.arm, PAPER.start, PAPER.path, boxes=PAPER.boxes, clearance_weight=0.0
    )

    run = track(careless, Eamp(population=100, seed=1), 1, 1001, careless.start)

    path = np.vstack([careless.start, run.path])
    assert summarise(careless, path, report_points(careless, path)).clearance_min == 0.0


def test_shares_of_a_population_add_up() -> None:
    shares = [Eamp(population=502).share(i, 4).population for i in range(4)]

    assert shares == [126, 126, 125, 125]


@pytest.mark.parametrize(
    ("setting", "value"),
    [("population", 3), ("tournament", 0), ("crossover", 1.1), ("mutation", -0.1), ("seed", -1)],
)
def test_settings_that_make_no_sense_are_refused(setting: str, value: float) -> None:
    with pytest.raises(InvalidParameters, match=f"{setting} is {value}"):
        replace(Eamp(), **{setting: value})
