"""The smooth problem: pure evaluation, limits that always hold, and plans near the physical limit."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.evolution.smooth import SmoothEvolution
from tramnet_workers.problems.motion_task import MotionTask, ObjectiveWeights
from tramnet_workers.problems.path_timing import FINE, grid
from tramnet_workers.problems.plan import PathPlan
from tramnet_workers.problems.registry import build
from tramnet_workers.problems.smooth_motion import SmoothMotion
from tramnet_workers.problems.straight_line import straight_line
from tramnet_workers.problems.verification import verify
from tramnet_workers.problems.yardsticks import (
    PAPER_GOAL,
    PAPER_START,
    plan_objective,
    reference_limit,
)
from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.puma560 import CORKE_VELOCITY_LIMITS, akb, p560

Array = NDArray[np.float64]

ARMS = [akb(), p560()]
IMPULSE = ObjectiveWeights(time=0.0, torque=1.0, end_velocity=0.0)

seeds = st.integers(0, 2**32 - 1)
both_arms = pytest.mark.parametrize("arm", ARMS, ids=["akb", "p560"])


def paper_task(arm: SerialArm, **changes: object) -> MotionTask:
    return MotionTask.for_arm(arm, PAPER_START, PAPER_GOAL, **changes)  # type: ignore[arg-type]


def random_task(rng: np.random.Generator) -> MotionTask:
    """Start and goal anywhere, a joint that need not move, and sometimes limits right at both."""
    arm = ARMS[int(rng.integers(2))]
    start, goal = rng.uniform(arm.position_lower, arm.position_upper, (2, 6))
    still = int(rng.integers(6))
    goal[still] = start[still]
    lower, upper = arm.position_lower.copy(), arm.position_upper.copy()
    tight = rng.random(6) < 0.5
    lower[tight] = np.minimum(start, goal)[tight]
    upper[tight] = np.maximum(start, goal)[tight] + 1e-3
    return MotionTask.for_arm(
        arm,
        start,
        goal,
        position_lower=lower,
        position_upper=upper,
        velocity_limits=rng.uniform(1.0, 6.0, 6) if rng.random() < 0.5 else None,
    )


def random_genomes(problem: SmoothMotion, rng: np.random.Generator, k: int) -> Array:
    return rng.uniform(-0.3, 0.3, (k, *problem.genome_shape))


def evolve(problem: SmoothMotion, seed: int, size: int, generations: int) -> tuple[PathPlan, float]:
    algorithm = SmoothEvolution(seed, size, generations, problem.lower, problem.upper)
    genomes = algorithm.initial()
    for generation in range(1, generations):
        genomes = algorithm.breed(genomes, problem.evaluate(genomes), generation)
    objectives = problem.evaluate(genomes)
    plan = problem.plan(genomes[objectives.argmin()])
    assert plan is not None
    return plan, float(objectives.min())


@both_arms
def test_an_empty_chromosome_is_the_straight_line(arm: SerialArm) -> None:
    task = paper_task(arm)
    problem = SmoothMotion(task)
    line = straight_line(task)

    plan = problem.plan(np.zeros(problem.genome_shape))

    assert line is not None
    assert plan is not None
    assert plan.duration == line.duration


@given(seeds)
@settings(max_examples=20)
def test_an_objective_depends_on_no_other_chromosome(seed: int) -> None:
    rng = np.random.default_rng(seed)
    weights = ObjectiveWeights(torque=float(rng.integers(2)))
    problem = SmoothMotion(replace(random_task(rng), weights=weights), intervals=20)
    genomes = random_genomes(problem, rng, 5)

    together = problem.evaluate(genomes)

    alone = [problem.evaluate(genomes[k : k + 1])[0] for k in (4, 2, 0, 1, 3)]
    assert together.tobytes() == np.array(alone)[[2, 3, 1, 4, 0]].tobytes()


@given(seeds)
@settings(max_examples=40)
def test_a_plan_keeps_its_position_limits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    task = random_task(rng)
    problem = SmoothMotion(task)

    plan = problem.plan(rng.uniform(-1.0, 1.0, problem.genome_shape))

    if plan is None:  # an arm on its way may well be too weak for such a path
        return
    q = plan.path.points(np.linspace(0.0, 1.0, 30_011))[0]
    assert (q >= task.position_lower - 1e-12).all()
    assert (q <= task.position_upper + 1e-12).all()


@given(seeds)
@settings(max_examples=8)
def test_any_plan_passes_verification(seed: int) -> None:
    rng = np.random.default_rng(seed)
    task = random_task(rng)
    problem = SmoothMotion(task)

    plan = problem.plan(random_genomes(problem, rng, 1)[0])

    if plan is not None:
        assert verify(task, plan).reasons == ()


@both_arms
@pytest.mark.parametrize("weights", [ObjectiveWeights(), ObjectiveWeights(1.0, 0.5, 0.0)])
def test_the_objective_is_that_of_the_plan(arm: SerialArm, weights: ObjectiveWeights) -> None:
    task = paper_task(arm, weights=weights)
    problem = SmoothMotion(task, intervals=FINE)
    genome = random_genomes(problem, np.random.default_rng(560), 1)

    objective = problem.evaluate(genome)[0]

    plan = problem.plan(genome[0])
    assert plan is not None
    assert objective == pytest.approx(plan_objective(task, plan), rel=1e-4)


@both_arms
def test_evolution_comes_within_one_percent_of_the_limit(arm: SerialArm) -> None:
    task = paper_task(arm)

    plan, _ = evolve(SmoothMotion(task), seed=1, size=100, generations=150)

    limit = reference_limit(task)
    assert limit is not None
    assert limit < plan.duration <= 1.01 * limit
    found = verify(task, plan)
    assert found.reasons == ()
    assert found.torque_ratio_max <= 1.001
    assert found.simulated_position_error < 1e-6


def test_evolution_keeps_a_limit_that_the_free_optimum_crosses() -> None:
    # The best motion of akb swings joint 3 back by about a third of a radian.
    free = paper_task(akb())
    task = paper_task(akb(), position_lower=np.minimum(free.start, free.goal) - 0.02)

    plan, _ = evolve(SmoothMotion(task), seed=1, size=60, generations=60)

    line = straight_line(task)
    assert line is not None
    assert plan.duration < line.duration
    assert (plan.sample(np.linspace(0, plan.duration, 9001)).q >= task.position_lower).all()


def test_evolution_finds_its_way_with_speed_limits_and_a_payload() -> None:
    loaded = akb().with_payload(2.0, (0.0, 0.0, 0.1))
    task = paper_task(loaded, velocity_limits=CORKE_VELOCITY_LIMITS)

    plan, _ = evolve(SmoothMotion(task), seed=1, size=60, generations=60)

    line = straight_line(task)
    assert line is not None
    assert plan.duration < line.duration
    assert verify(task, plan).reasons == ()


def test_a_dearer_torque_buys_less_impulse_for_more_time() -> None:
    plans = [
        evolve(SmoothMotion(paper_task(akb(), weights=ObjectiveWeights(1.0, w, 0.1))), 1, 60, 60)[0]
        for w in (0.0, 0.3, 3.0)
    ]

    times = [plan.duration for plan in plans]
    impulses = [plan_objective(paper_task(akb(), weights=IMPULSE), plan) for plan in plans]
    assert times[0] < times[1] < times[2]
    assert impulses[0] > 1.2 * impulses[1] > 1.2**2 * impulses[2]


def test_among_paths_too_heavy_for_the_arm_the_lightest_is_best() -> None:
    # Joint 2 can hold the arm when it stands nearly upright, as at both ends, but not level.
    weak = akb().torque_limits * np.array([1.0, 0.15, 1.0, 1.0, 1.0, 1.0])
    task = MotionTask.for_arm(
        akb(), [0.0, -2.2, 0.0, 0.0, 0.0, 0.0], [0.0, -0.9, 0.0, 0.0, 0.0, 0.0], torque_limits=weak
    )
    problem = SmoothMotion(task)
    genomes = np.zeros((4, *problem.genome_shape))
    genomes[:, problem.n_modes] = [0.0, 0.25, 0.35, 0.45]  # how far joint 2 swings out

    objectives = problem.evaluate(genomes)

    assert objectives[0] < 10.0
    assert 1e6 <= objectives[1] < objectives[2] < objectives[3] < np.inf
    assert [problem.plan(genome) is None for genome in genomes] == [False, True, True, True]


def test_the_reference_limit_is_known_for_the_paper_s_task_alone() -> None:
    assert reference_limit(paper_task(akb())) == 0.3656
    assert reference_limit(paper_task(p560())) == 0.3419
    free = ObjectiveWeights(end_velocity=0.0)
    assert reference_limit(paper_task(akb(), weights=free)) == 0.2619
    for changes in (
        {"velocity_limits": CORKE_VELOCITY_LIMITS},
        {"torque_limits": 2.0 * akb().torque_limits},
        {"position_upper": akb().position_upper - 0.1},
    ):
        assert reference_limit(paper_task(akb(), **changes)) is None
    assert reference_limit(paper_task(akb().with_payload(1.0, (0.0, 0.0, 0.1)))) is None
    assert reference_limit(MotionTask.for_arm(akb(), PAPER_GOAL, PAPER_START)) is None


def test_a_problem_travels_as_plain_values() -> None:
    task = paper_task(p560(), weights=ObjectiveWeights(1.0, 0.1, 0.1))
    problem = SmoothMotion(task, n_modes=3, intervals=30)
    genomes = random_genomes(problem, np.random.default_rng(1), 3)

    rebuilt = build(problem.name, problem.parameters())

    assert rebuilt.genome_shape == problem.genome_shape == (6 * 3 + 2,)
    assert rebuilt.evaluate(genomes).tobytes() == problem.evaluate(genomes).tobytes()


def test_an_unknown_parameter_is_refused() -> None:
    parameters = SmoothMotion(paper_task(akb())).parameters() | {"colour": "red"}

    with pytest.raises(InvalidParameters, match="colour"):
        build("puma560-smooth", parameters)


@given(st.integers(1, 500))
def test_the_grid_is_dense_at_both_ends(intervals: int) -> None:
    points = grid(intervals)

    assert points[0] == 0.0
    assert points[-1] == 1.0
    assert (np.diff(points) > 0.0).all()
    assert points == pytest.approx(1.0 - points[::-1], abs=1e-12)
