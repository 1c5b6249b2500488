"""Dynamic scaling: the paper's equations, golden numbers, and that no shorter interval would do."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.kernels import book as pages
from tramnet_workers.kernels.book import LOST, SHARE, last_row, new_book
from tramnet_workers.kernels.dynamics import LANES, inverse_dynamics_batch
from tramnet_workers.kernels.inertia import new_chain, new_links
from tramnet_workers.kernels.motion import prepare
from tramnet_workers.kernels.phases import FASTEST, choose_interval
from tramnet_workers.kernels.scaling import bound_torques
from tramnet_workers.kernels.segment import EXACT, MIDDLE, START, move_segment
from tramnet_workers.problems.grid_motion import DecodingSettings, GridMotion
from tramnet_workers.problems.motion_task import MotionTask, ObjectiveWeights
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.puma560 import akb, p560

Array = NDArray[np.float64]

SLACK = 1 + 1e-9
SLOWEST = 0.05

seeds = st.integers(0, 2**32 - 1)


class Scaled(NamedTuple):
    """One segment, in the first lane."""

    quadratics: Array  # A, B and C of each row, of shape (rows, 3)
    x: float
    lost: bool


def scale(
    arm: SerialArm, q: Array, D: Array, v: Array, share: float = 1.0, posture: int = START
) -> Scaled:
    """Run the kernels on one segment, repeated in all lanes."""
    rows = 3 if posture == EXACT else 1
    book = new_book(1, len(q), rows)
    for column, values in ((pages.NODE, q), (pages.STEP, D), (pages.RATE, v)):
        book[0, :-1, column : column + LANES] = np.tile(values, rows)[:, None]
    last = last_row(book)
    book[0, last, SHARE : SHARE + LANES] = share
    chain, links = new_chain(), new_links(len(q))
    prepare(arm.table, arm.gravity, posture, book, chain, links)
    move_segment(arm.table, arm.gravity, posture, 0, book, chain, links)
    limits = np.stack(
        [arm.torque_limits, arm.velocity_limits, arm.position_lower, arm.position_upper]
    )
    choose_interval(limits, SLOWEST, 0, book)
    quadratics = book[0, :-1][:, [pages.A, pages.B, pages.C]]
    return Scaled(quadratics, book[0, last, pages.CHOSEN], bool(book[0, last, LOST]))


def torques(quadratics: Array, x: float) -> Array:
    A, B, C = quadratics.T
    return (A * x + 2 * B) * x + C


def rnea(arm: SerialArm, q: Array, qd: Array, qdd: Array) -> Array:
    return inverse_dynamics_batch(arm.table, arm.gravity, q[None], qd[None], qdd[None])[0]


def random_segment(seed: int) -> tuple[SerialArm, Array, Array, Array]:
    rng = np.random.default_rng(seed)
    arm = (akb(), p560())[int(rng.integers(2))]
    q = rng.uniform(-0.5, 0.5, 6)
    return arm, q, rng.uniform(-0.15, 0.15, 6), rng.uniform(-3.0, 3.0, 6)


def first_segment(arm: SerialArm) -> tuple[Array, Array, Array]:
    start, goal = np.array(PAPER_START), np.array(PAPER_GOAL)
    return start, (goal - start) / 16, np.zeros(6)


# The golden numbers: the straight line of Table 1, 16 segments, torques bounded at the first node.

# Coefficients K of x^2, each joint's candidate interval [s] and the bound that it meets there (joint 2 of
# akb meets the lower one), torques at the interval chosen [N m], velocities after it [rad/s].
GOLDEN = {
    "akb": (
        akb(),
        (0.399935, -0.640136, 0.068832, 0.022087, 0.015460, 0.019071),
        {2: 0.027502, 4: 0.027730, 5: 0.029922, 3: 0.030211, 0: 0.064013, 1: 0.065132},
        0.0651322832,
        (94.275103, -186.4, 14.618742, 5.206496, 3.639433, 4.495536),
        (1.554529, -1.573720, 1.458570, 1.669679, 1.324228, 1.516145),
    ),
    "p560": (
        p560(),
        (0.393391, -0.468902, 0.031983, 0.021097, 0.014698, 0.019176),
        {2: 0.018740, 4: 0.027039, 3: 0.029526, 5: 0.030005, 1: 0.046312, 0: 0.063487},
        0.0634873518,
        (97.6, -84.107673, 6.264866, 5.234251, 3.641852, 4.757589),
        (1.594806, -1.614495, 1.496361, 1.712940, 1.358538, 1.555428),
    ),
}


@pytest.mark.parametrize("name", GOLDEN)
def test_the_first_segment_of_the_line_has_its_golden_numbers(name: str) -> None:
    arm, K, candidates, h, tau, velocities = GOLDEN[name]
    q, D, v = first_segment(arm)

    scaled = scale(arm, q, D, v)

    assert scaled.quadratics[:, 0] == pytest.approx(K, abs=5e-7)
    assert 1 / scaled.x == pytest.approx(h, abs=5e-11)
    assert torques(scaled.quadratics, scaled.x) == pytest.approx(tau, abs=5e-7)
    assert 2 * D * scaled.x - v == pytest.approx(velocities, abs=5e-7)
    for joint, candidate in candidates.items():
        met = np.abs(torques(scaled.quadratics, 1 / candidate)[joint])
        assert met == pytest.approx(arm.torque_limits[joint], rel=1e-4)


LINE_INTERVALS = (
    *(0.0651, 0.0271, 0.0210, 0.0179, 0.0160, 0.0146, 0.0135, 0.0127),
    *(0.0128, 0.0139, 0.0153, 0.0172, 0.0199, 0.0245, 0.0359, 0.0994),
)


def line_plan(arm: SerialArm, segments: int = 16, **settings: str) -> Array:
    """Return h of the straight line and then its velocities at the end."""
    task = MotionTask.for_arm(arm, PAPER_START, PAPER_GOAL, segments=segments)
    problem = GridMotion(task, DecodingSettings(**settings))  # type: ignore[arg-type]
    line = np.tile(np.arange(1, segments), (6, 1))
    plan = problem.plan(line)
    assert plan is not None
    return np.concatenate([plan.h, plan.qd[-1]])


def test_the_whole_line_takes_the_intervals_of_the_prototype_and_stops() -> None:
    found = line_plan(akb())

    assert found[:16] == pytest.approx(LINE_INTERVALS, abs=5e-5)
    assert found[:16].sum() == pytest.approx(0.4269, abs=5e-5)
    assert np.abs(found[16:]).sum() < 1e-10


def test_the_literal_switch_leaves_the_p560_arm_moving() -> None:
    found = line_plan(p560())

    assert found[:16].sum() == pytest.approx(0.315, abs=5e-4)
    assert np.abs(found[16:]).sum() == pytest.approx(7.5, abs=0.05)


@pytest.mark.parametrize(
    ("arm", "posture", "seconds"),
    [
        (akb(), "start", 0.3806),
        (akb(), "middle", 0.3811),
        (akb(), "exact", 0.3833),
        (p560(), "start", 0.3548),
    ],
)
def test_the_continuous_switch_times_the_line_as_the_prototype_did(
    arm: SerialArm, posture: str, seconds: float
) -> None:
    found = line_plan(arm, switch="continuous", posture=posture)

    assert found[:16].sum() == pytest.approx(seconds, abs=1.2e-4)
    assert np.abs(found[16:]).max() < 1e-5


@pytest.mark.parametrize(("arm", "seconds"), [(akb(), 0.3806), (p560(), 0.3536)])
def test_many_segments_take_the_time_that_toppra_finds_for_the_line(
    arm: SerialArm, seconds: float
) -> None:
    found = line_plan(arm, segments=200, switch="continuous")

    # TOPPRA on the line: 0.3806 and 0.3536 s.
    assert found[:200].sum() == pytest.approx(seconds, abs=1.5e-4)


def one_joint_arm() -> SerialArm:
    """Wang & Zalzala (1995), section 3: tau = 12.5 qdd, bounded by 200 N m."""
    zero = np.zeros(1)
    return SerialArm(
        name="one joint",
        joint_names=("joint",),
        rotation=np.eye(3)[None],
        translation=np.zeros((1, 3)),
        mass=zero,
        com=np.zeros((1, 3)),
        inertia=np.zeros((1, 3, 3)),
        armature=np.array([12.5]),
        position_lower=np.array([-7.0]),
        position_upper=np.array([7.0]),
        torque_limits=np.array([200.0]),
        velocity_limits=np.array([np.inf]),
        gravity=np.zeros(3),
        tool=np.eye(4),
    )


def test_the_paper_s_one_joint_example_takes_0_627_seconds() -> None:
    task = MotionTask.for_arm(one_joint_arm(), [0.0], [np.pi / 2], segments=2)

    plan = GridMotion(task).plan(np.array([[1]]))

    assert plan is not None
    assert plan.duration == pytest.approx(0.62666, abs=5e-6)
    assert plan.qdd[:, 0] == pytest.approx([16.0, -16.0])
    assert plan.qd[-1, 0] == pytest.approx(0.0, abs=1e-12)


@given(seed=seeds, h=st.floats(0.005, 0.5), other=st.floats(0.005, 0.5))
def test_eq_6_agrees_with_computing_the_dynamics_again(seed: int, h: float, other: float) -> None:
    arm, q, D, v = random_segment(seed)
    zero = np.zeros(6)
    g = rnea(arm, q, zero, zero)
    Hv = rnea(arm, q, zero, v) - g

    def dynamics(interval: float) -> Array:
        mean = D / interval  # eq 3
        return rnea(arm, q, mean, (2 / interval) * (mean - v))  # eq 4

    tau = dynamics(h)
    scaled = (h / other) ** 2 * (tau - g) + g + 2 * (h - other) / other**2 * Hv  # eq 6

    size = (
        np.abs(scaled).max() + np.abs(Hv).max() / other + np.abs(tau - g).max() * (h / other) ** 2
    )
    assert scaled == pytest.approx(dynamics(other), abs=1e-11 * size)


@given(seed=seeds, x=st.floats(2.0, 200.0))
@pytest.mark.parametrize("posture", [START, MIDDLE])
def test_the_quadratics_are_the_torques_at_one_posture(posture: int, seed: int, x: float) -> None:
    arm, q, D, v = random_segment(seed)

    quadratics = scale(arm, q, D, v, posture=posture).quadratics

    there = q + 0.5 * posture * D
    expected = rnea(arm, there, D * x, 2 * x * (D * x - v))
    assert torques(quadratics, x) == pytest.approx(expected, abs=1e-12 * x * x + 1e-9)


@given(seed=seeds, x=st.floats(2.0, 200.0))
def test_the_exact_quadratics_are_the_torques_at_both_ends(seed: int, x: float) -> None:
    arm, q, D, v = random_segment(seed)

    found = torques(scale(arm, q, D, v, posture=EXACT).quadratics, x)

    acceleration = 2 * x * (D * x - v)
    ends = [rnea(arm, q, v, acceleration), rnea(arm, q + D, 2 * D * x - v, acceleration)]
    assert found[:6] == pytest.approx(ends[0], abs=1e-12 * x * x + 1e-9)
    assert found[12:] == pytest.approx(ends[1], abs=1e-11 * x * x + 1e-9)


def allowed(quadratics: Array, bounds: Array, x: Array) -> NDArray[np.bool_]:
    """Return which of some x are feasible, up to the slack."""
    A, B, C = quadratics.T[..., None]
    tau = (A * x + 2 * B) * x + C
    scale_of_terms = np.abs(A) * x * x + np.abs(2 * B) * x + np.abs(C)
    slack = 1e-9 * bounds[:, None] + 1e-13 * scale_of_terms
    return np.asarray((np.abs(tau) <= bounds[:, None] + slack).all(axis=0))


def candidates(quadratics: Array, bounds: Array) -> Array:
    """Return every x at which some torque meets a bound: up to 4 for each joint."""
    roots = [
        np.roots([A, 2 * B, C - sign * bound])
        for (A, B, C), bound in zip(quadratics, bounds, strict=True)
        for sign in (-1.0, 1.0)
    ]
    real = [r.real for found in roots for r in found if abs(r.imag) < 1e-12 * (1 + abs(r))]
    return np.array([r for r in real if 0.0 < r < FASTEST] + [FASTEST])


def check_fastest(quadratics: Array, bounds: Array, x: float, lost: bool) -> None:
    """No candidate above x is feasible, and between two candidates nothing changes."""
    edges = np.unique(np.concatenate([candidates(quadratics, bounds), [1e-9]]))
    between = 0.5 * (edges[1:] + edges[:-1])
    if lost:
        assert not allowed(quadratics, bounds, between).any()
        return
    assert allowed(quadratics, bounds, np.array([x])).all()
    above = between[between > x * (1 + 1e-6)]
    assert not allowed(quadratics, bounds, above).any()


@given(seed=seeds)
@pytest.mark.parametrize("posture", [START, EXACT])
def test_the_interval_is_feasible_and_no_shorter_one_is(posture: int, seed: int) -> None:
    arm, q, D, v = random_segment(seed)
    # Without position limits, which forbid some more.
    free = replace(arm, position_lower=np.full(6, -np.inf), position_upper=np.full(6, np.inf))

    scaled = scale(free, q, D, v, posture=posture)

    bounds = np.tile(arm.torque_limits, len(scaled.quadratics) // 6)
    check_fastest(scaled.quadratics, bounds, scaled.x, scaled.lost)


coefficients = st.one_of(st.just(0.0), st.floats(-5.0, 5.0).filter(lambda a: abs(a) > 1e-3))


@given(rows=st.lists(st.tuples(coefficients, coefficients, coefficients), min_size=1, max_size=6))
def test_any_quadratics_are_bounded_by_their_highest_feasible_root(
    rows: list[tuple[float, float, float]],
) -> None:
    quadratics, bounds = np.array(rows), np.full(len(rows), 2.0)
    book = new_book(1, len(rows), 1)
    last = last_row(book)
    book[0, last, pages.TOP : pages.TOP + LANES] = FASTEST
    for column, values in zip((pages.A, pages.B, pages.C), quadratics.T, strict=True):
        book[0, :-1, column : column + LANES] = values[:, None]

    bound_torques(np.stack([bounds] * pages.LIMIT_ROWS), 0, book)

    low, top = book[0, last, pages.LOW], book[0, last, pages.TOP]
    check_fastest(quadratics, bounds, top, lost=top < max(low, 1e-9))
    if top > low:
        inside = np.linspace(low, top, 7)[1:-1]
        assert allowed(quadratics, bounds, inside).all()


@given(seed=seeds)
def test_braking_leaves_the_least_speed_of_all_allowed_intervals(seed: int) -> None:
    arm, q, D, v = random_segment(seed)
    free = replace(arm, position_lower=np.full(6, -np.inf), position_upper=np.full(6, np.inf))
    fastest = scale(free, q, D, v).x

    braking = scale(free, q, D, v, share=0.0)

    if braking.lost:
        return
    bounds = arm.torque_limits
    assert allowed(braking.quadratics, bounds, np.array([braking.x])).all()
    x = np.linspace(SLOWEST, fastest, 2001)
    steps = allowed(braking.quadratics, bounds, x)
    connected = x[np.flatnonzero(~steps)[-1] + 1 :] if not steps.all() else x
    speeds = np.abs(2 * D * connected[:, None] - v).sum(axis=1)
    assert np.abs(2 * D * braking.x - v).sum() <= speeds.min() + 1e-9 * np.abs(v).sum()


@given(seed=seeds)
def test_velocity_limits_hold_at_the_end_of_a_segment(seed: int) -> None:
    arm, q, D, v = random_segment(seed)
    limited = replace(arm, velocity_limits=np.abs(v) + 0.5)

    scaled = scale(limited, q, D, v)

    if not scaled.lost:
        assert (np.abs(2 * D * scaled.x - v) <= limited.velocity_limits * SLACK).all()


@given(seed=seeds, share=st.floats(0.0, 1.0))
def test_no_joint_turns_beyond_its_position_limits(seed: int, share: float) -> None:
    arm, q, D, v = random_segment(seed)
    room = np.random.default_rng(seed).uniform(0.0, 0.05, (2, 6))
    lower, upper = np.minimum(q, q + D) - room[0], np.maximum(q, q + D) + room[1]
    tight = replace(arm, position_lower=lower, position_upper=upper)

    scaled = scale(tight, q, D, v, share=share)

    if not scaled.lost:
        t = np.linspace(0.0, 1.0, 201)[:, None] / scaled.x
        way = q + (v + 0.5 * (2 * scaled.x * (D * scaled.x - v)) * t) * t
        assert (way >= lower - 1e-9).all()
        assert (way <= upper + 1e-9).all()


def test_a_segment_in_which_nothing_moves_takes_the_shortest_time_there_is() -> None:
    arm = akb()

    scaled = scale(arm, np.array(PAPER_START), np.zeros(6), np.zeros(6))

    assert scaled.x == FASTEST
    assert not scaled.lost


def test_an_arm_too_weak_for_gravity_finds_no_interval() -> None:
    weak = replace(akb(), torque_limits=np.full(6, 1.0))
    q, D, v = first_segment(weak)

    scaled = scale(weak, q, 1e-3 * D, v)

    assert scaled.lost


def test_cases_without_end_velocity_never_brake() -> None:
    weights = ObjectiveWeights(time=1.0, torque=0.0, end_velocity=0.0)
    task = MotionTask.for_arm(akb(), PAPER_START, PAPER_GOAL, weights=weights)

    decoded = GridMotion(task).decode(np.tile(np.arange(1, 16), (6, 1)))

    assert decoded is not None
    assert decoded.switch == 16.0
    # The prototype: 0.2713 s in the limit; the last velocities add up to 32.7 rad/s.
    assert decoded.plan.duration == pytest.approx(0.271, abs=5e-4)
    assert np.abs(decoded.plan.qd[-1]).sum() == pytest.approx(32.7, abs=0.05)
