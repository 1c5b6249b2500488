"""Plans: what they say about position, velocity and acceleration must hang together."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.kernels.smooth_paths import path_modes
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.path_timing import time_path
from tramnet_workers.problems.plan import ParabolicPlan, PathPlan, Plan, SmoothPath
from tramnet_workers.robots.puma560 import akb

Array = NDArray[np.float64]

N = 6

seeds = st.integers(0, 2**32 - 1)


def parabolic_plan(seed: int) -> ParabolicPlan:
    """Nodes chosen freely, velocities by Wang & Zalzala (1995), eqs 3-4."""
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, 12))
    h, q = rng.uniform(0.01, 0.2, m), rng.normal(size=(m + 1, N))
    qd, qdd = np.zeros((m + 1, N)), np.zeros((m, N))
    for j in range(m):
        mean = (q[j + 1] - q[j]) / h[j]
        qdd[j] = 2.0 / h[j] * (mean - qd[j])
        qd[j + 1] = 2.0 * mean - qd[j]
    return ParabolicPlan(h, q, qd, qdd)


def path_plan(seed: int) -> PathPlan:
    rng = np.random.default_rng(seed)
    arm = akb()
    start, goal = rng.uniform(-0.5, 0.5, (2, N))
    path = SmoothPath(start, goal, rng.normal(0.0, 0.1, (N, 4)))
    plan = time_path(MotionTask.for_arm(arm, start, goal), path, intervals=60)
    assert plan is not None
    return plan


def any_plan(seed: int) -> Plan:
    return parabolic_plan(seed) if seed % 2 else path_plan(seed)


plans = seeds.map(any_plan)


@given(plans)
def test_velocity_is_the_rate_of_position_between_breaks(plan: Plan) -> None:
    first, last = plan.breaks[:-1], plan.breaks[1:]
    middle, width = 0.5 * (first + last), 1e-3 * (last - first)

    before, here, after = (plan.sample(middle + k * width) for k in (-1, 0, 1))

    rate = (after.q - before.q) / (2.0 * width[:, None])
    assert rate == pytest.approx(here.qd, rel=1e-5, abs=1e-6)


@given(plans)
def test_acceleration_is_the_rate_of_velocity_between_breaks(plan: Plan) -> None:
    first, last = plan.breaks[:-1], plan.breaks[1:]
    middle, width = 0.5 * (first + last), 1e-3 * (last - first)

    before, here, after = (plan.sample(middle + k * width) for k in (-1, 0, 1))

    rate = (after.qd - before.qd) / (2.0 * width[:, None])
    assert rate == pytest.approx(here.qdd, rel=1e-4, abs=1e-4)


@given(plans)
def test_position_and_velocity_do_not_jump_at_breaks(plan: Plan) -> None:
    left = plan.sample(np.nextafter(plan.breaks[1:], 0.0))
    right = plan.sample(plan.breaks[1:])

    assert left.q == pytest.approx(right.q, abs=1e-9)
    assert left.qd == pytest.approx(right.qd, abs=1e-8)


@given(plans)
def test_a_sample_outside_the_motion_is_its_first_or_last(plan: Plan) -> None:
    outside = plan.sample(np.array([-1.0, plan.duration + 1.0]))
    ends = plan.sample(np.array([0.0, plan.duration]))

    assert (outside.q == ends.q).all()
    assert (outside.qd == ends.qd).all()


@given(plans, st.floats(1.0, 5.0))
def test_a_stretched_plan_is_the_same_motion_more_slowly(plan: Plan, factor: float) -> None:
    t = np.linspace(0.0, plan.duration, 50)[1:-1]

    slow = plan.stretched(factor)

    assert slow.duration == pytest.approx(factor * plan.duration)
    assert slow.sample(factor * t).q == pytest.approx(plan.sample(t).q, abs=1e-12)
    assert slow.sample(factor * t).qd == pytest.approx(plan.sample(t).qd / factor, abs=1e-8)


@given(seeds)
def test_a_parabolic_plan_goes_through_its_nodes(seed: int) -> None:
    plan = parabolic_plan(seed)

    motion = plan.sample(plan.breaks)

    assert motion.q == pytest.approx(plan.q, abs=1e-9)
    assert motion.qd == pytest.approx(plan.qd, abs=1e-8)


@given(seeds)
def test_a_path_plan_goes_from_rest_at_the_start_to_rest_at_the_goal(seed: int) -> None:
    plan = path_plan(seed)

    motion = plan.sample(np.array([0.0, plan.duration]))

    assert motion.q == pytest.approx(np.array([plan.path.start, plan.path.goal]), abs=1e-12)
    assert motion.qd == pytest.approx(np.zeros((2, N)), abs=1e-12)


def test_the_arrays_of_a_plan_cannot_be_changed() -> None:
    plan = parabolic_plan(1)

    for array in (plan.h, plan.q, plan.qd, plan.qdd, plan.breaks):
        assert not array.flags.writeable


def test_the_slopes_of_the_modes_are_orthonormal() -> None:
    nodes, weights = np.polynomial.legendre.leggauss(20)

    slopes = path_modes(0.5 * (nodes + 1.0), 8)[1]

    assert (slopes * 0.5 * weights) @ slopes.T == pytest.approx(np.eye(8), abs=1e-12)


def test_modes_vanish_at_both_ends_exactly() -> None:
    assert (path_modes(np.array([0.0, 1.0]), 20)[0] == 0.0).all()


def test_derivatives_of_the_modes_are_those_of_numpy_s_legendre_series() -> None:
    s = np.linspace(0.0, 1.0, 41)

    modes = path_modes(s, 6)

    for k in range(1, 7):
        slope = np.sqrt(2 * k + 1) * np.polynomial.Legendre.basis(k, domain=[0.0, 1.0])
        mode = slope.integ()
        expected = [mode(s) - mode(0.0), slope(s), slope.deriv()(s)]
        assert modes[:, k - 1] == pytest.approx(np.array(expected), abs=1e-12)
