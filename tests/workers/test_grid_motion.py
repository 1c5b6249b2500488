import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.evolution.wang_zalzala import WangZalzala, WangZalzalaSettings
from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.problems.grid_motion import DecodingSettings, GridMotion
from tramnet_workers.problems.motion_task import MotionTask, ObjectiveWeights
from tramnet_workers.problems.verification import verify
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.puma560 import akb, p560

N = 16
LINE = np.arange(1, N, dtype=np.int16)


def paper_task(arm: SerialArm | None = None, **changes: object) -> MotionTask:
    return MotionTask.for_arm(arm or akb(), PAPER_START, PAPER_GOAL, **changes)


def problem(task: MotionTask | None = None, **settings: object) -> GridMotion:
    return GridMotion(task or paper_task(), DecodingSettings(**settings))


def line_of(task: MotionTask) -> np.ndarray:
    moves = (task.goal != task.start).astype(np.int16)
    return np.outer(moves, np.arange(1, task.segments, dtype=np.int16)).astype(np.int16)


def population(grid_motion: GridMotion, size: int = 50, bias: float = 0.8, seed: int = 3):
    settings = WangZalzalaSettings(goal_bias=bias)
    return WangZalzala(seed, size, grid_motion.grid, settings).initial()


def one_joint_arm() -> SerialArm:
    """The paper's section 3: tau = 12.5 qdd, at most 200 N m, no gravity."""
    one = np.zeros(1)
    return SerialArm(
        "one joint",
        ("joint",),
        np.eye(3)[None],
        np.zeros((1, 3)),
        one,
        np.zeros((1, 3)),
        np.zeros((1, 3, 3)),
        np.array([12.5]),
        np.array([-np.pi]),
        np.array([np.pi]),
        np.array([200.0]),
        np.array([np.inf]),
        np.zeros(3),
        np.eye(4),
    )


def terms(arm: SerialArm, q: np.ndarray, D: np.ndarray, v: np.ndarray):
    """K, H v and g of tau(x) = K x^2 - 2 (H v) x + g, from three inverse dynamics."""
    zero = np.zeros_like(q)

    def torque(qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        return inverse_dynamics_batch(arm.table, arm.gravity, q[None], qd[None], qdd[None])[0]

    g = torque(zero, zero)
    return torque(D, 2 * D) - g, torque(zero, v) - g, g


# Literature: the figures derived from the paper's equations, and the paper's own example.


def test_the_one_joint_example_takes_0_627_seconds():
    task = MotionTask.for_arm(one_joint_arm(), [0.0], [np.pi / 2], segments=16)

    plan = problem(task).plan(line_of(task))

    assert plan.duration == pytest.approx(0.62666, abs=5e-6)
    assert abs(plan.qd[-1]).max() < 1e-12


@pytest.mark.parametrize(
    ("arm", "h", "torques", "after"),
    [
        (
            akb(),
            0.0651322832,
            [94.275103, -186.4, 14.618742, 5.206496, 3.639433, 4.495536],
            [1.554529, -1.573720, 1.458570, 1.669679, 1.324228, 1.516145],
        ),
        (
            p560(),
            0.0634873518,
            [97.6, -84.107673, 6.264866, 5.234251, 3.641852, 4.757589],
            [1.594806, -1.614495, 1.496361, 1.712940, 1.358538, 1.555428],
        ),
    ],
    ids=["akb", "p560"],
)
def test_the_first_segment_of_the_line_is_scaled_to_the_golden_numbers(arm, h, torques, after):
    task = paper_task(arm)

    decoded = problem(task).decode(line_of(task))

    assert decoded.plan.h[0] == pytest.approx(h, abs=5e-11)
    np.testing.assert_allclose(decoded.torques[0], torques, atol=5e-7)
    np.testing.assert_allclose(decoded.plan.qd[1], after, atol=5e-7)


def test_the_whole_line_takes_the_golden_intervals():
    golden = ".0651 .0271 .0210 .0179 .0160 .0146 .0135 .0127 .0128 .0139 .0153 .0172 .0199 .0245 .0359 .0994"

    plan = problem().plan(line_of(paper_task()))

    np.testing.assert_allclose(plan.h, [float(word) for word in golden.split()], atol=5.1e-5)
    assert plan.duration == pytest.approx(0.4269, abs=5e-5)
    assert np.abs(plan.qd[-1]).sum() < 1e-9


@pytest.mark.parametrize(("arm", "time"), [(akb(), 0.3806), (p560(), 0.3548)], ids=["akb", "p560"])
def test_a_continuous_switch_times_the_line_as_well_as_time_optimal_scaling(arm, time):
    task = paper_task(arm)

    plan = problem(task, switch="continuous").plan(line_of(task))

    assert plan.duration == pytest.approx(time, abs=1.2e-4)


# Laws.


@given(seed=st.integers(0, 2**31), bias=st.floats(0.5, 1.0))
def test_every_segment_rides_a_bound_while_it_accelerates_and_keeps_all_of_them(seed, bias):
    task = paper_task(weights=ObjectiveWeights(1.0, 0.0, 0.0))
    grid_motion = problem(task)
    (genome,) = population(grid_motion, 1, bias, seed)

    plan = grid_motion.plan(genome)
    assume(plan is not None)  # some wild trajectories have no motion at all

    for j, x in enumerate(1.0 / plan.h):
        K, Hv, g = terms(task.arm, plan.q[j], np.diff(plan.q, axis=0)[j], plan.qd[j])
        ratio = np.abs(K * x * x - 2 * Hv * x + g) / task.torque_limits
        assert ratio.max() <= 1 + 1e-8
        assert ratio.max() == pytest.approx(1.0, abs=1e-6)
        # No shorter interval is feasible: just beyond, and far beyond, some joint is over its bound.
        for faster in x * np.array([1 + 1e-5, 1.01, 1.1, 2.0, 10.0]):
            beyond = np.abs(K * faster**2 - 2 * Hv * faster + g) / task.torque_limits
            assert beyond.max() > 1.0


@given(seed=st.integers(0, 2**31), stretch=st.floats(0.2, 5.0))
def test_equation_6_agrees_with_computing_the_dynamics_again(seed, stretch):
    rng = np.random.default_rng(seed)
    arm = akb()
    q, D, v = rng.uniform(-2, 2, 6), rng.uniform(-0.1, 0.1, 6), rng.uniform(-2, 2, 6)
    h = 0.05
    K, Hv, g = terms(arm, q, D, v)

    def torque(h: float) -> np.ndarray:
        qd, qdd = D / h, 2 / h * (D / h - v)  # eqs 3 and 4
        return inverse_dynamics_batch(arm.table, arm.gravity, q[None], qd[None], qdd[None])[0]

    longer = stretch * h
    by_eq_6 = (h / longer) ** 2 * (torque(h) - g) + g + 2 * (h - longer) / longer**2 * Hv

    scale = np.abs(K).max() / min(h, longer) ** 2 + np.abs(Hv).max() / min(h, longer) + 1.0
    np.testing.assert_allclose(by_eq_6, torque(longer), atol=1e-12 * scale)


@given(st.integers(1, 50), st.integers(0, 49))
def test_an_objective_does_not_depend_on_the_chunk_it_is_computed_in(size, first):
    grid_motion = problem()
    genomes = population(grid_motion)

    together = grid_motion.evaluate(genomes)
    chunk = grid_motion.evaluate(genomes[first : first + size])

    np.testing.assert_array_equal(chunk, together[first : first + size])


@pytest.mark.parametrize("switch", ["literal", "continuous"])
def test_the_decoded_plan_is_worth_the_objective(switch):
    task = paper_task(weights=ObjectiveWeights(1.0, 0.0, 0.1))
    grid_motion = problem(task, switch=switch)
    genomes = population(grid_motion, 20)

    objectives = grid_motion.evaluate(genomes)

    for genome, objective in zip(genomes, objectives, strict=True):
        plan = grid_motion.plan(genome)
        if plan is not None:
            expected = plan.duration + 0.1 * np.abs(plan.qd[-1]).sum()
            assert objective == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("arm", [akb(), p560()], ids=["akb", "p560"])
@pytest.mark.parametrize("switch", ["literal", "continuous"])
def test_the_line_overshoots_with_one_posture_and_holds_with_three(arm, switch):
    task = paper_task(arm)

    one = problem(task, posture="start", switch=switch).plan(line_of(task))
    three = problem(task, posture="exact", switch=switch).plan(line_of(task))

    assert verify(task, one).torque_ratio_max > 1.01
    assert verify(task, three).torque_ratio_max <= 1.001


# A user's own tasks.


def test_a_joint_that_need_not_move_may_and_returns():
    goal = np.array(PAPER_GOAL)
    goal[2] = PAPER_START[2]
    task = paper_task().__class__.for_arm(akb(), PAPER_START, goal)
    grid_motion = problem(task)

    genomes = population(grid_motion, 50, 0.5)
    plan = next(plan for plan in map(grid_motion.plan, genomes) if plan is not None)

    assert genomes[:, 2].min() < 0 < genomes[:, 2].max()
    np.testing.assert_array_equal(plan.q[-1], goal)
    assert grid_motion.plan(line_of(task)) is not None


def test_position_limits_hold_for_every_trajectory_drawn():
    lower = np.array(PAPER_START) - 0.02
    upper = np.array(PAPER_GOAL) + 0.02
    lower[1], upper[1] = PAPER_GOAL[1] - 0.02, PAPER_START[1] + 0.02
    task = paper_task(position_lower=lower, position_upper=upper, margin_levels=5)
    grid_motion = problem(task)

    for genome in population(grid_motion, 100, 0.3):
        plan = grid_motion.plan(genome)
        if plan is not None:
            assert (plan.q >= lower - 1e-9).all()
            assert (plan.q <= upper + 1e-9).all()


def test_velocity_limits_slow_the_motion_down():
    free, limited = paper_task(), paper_task(velocity_limits=[2.0] * 6)

    plan = problem(limited, switch="continuous").plan(line_of(limited))

    assert np.abs(plan.qd).max() <= 2.0 + 1e-9
    assert plan.duration > problem(free, switch="continuous").plan(line_of(free)).duration


def test_the_problem_travels_as_plain_values():
    grid_motion = problem(switch="continuous", posture="exact")

    again = GridMotion.from_parameters(grid_motion.parameters())

    assert again.task == grid_motion.task
    assert again.settings == grid_motion.settings


def test_an_unknown_setting_is_refused():
    parameters = problem().parameters() | {"settings": {"switch": "sometimes"}}

    with pytest.raises(InvalidParameters, match="sometimes"):
        GridMotion.from_parameters(parameters)
