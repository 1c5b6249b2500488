"""Verification: sound plans pass, and each defect is found and named."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from tramnet_workers.problems.motion_task import MotionTask, ObjectiveWeights
from tramnet_workers.problems.path_timing import time_path
from tramnet_workers.problems.plan import ParabolicPlan, PathPlan, SmoothPath
from tramnet_workers.problems.straight_line import straight_line
from tramnet_workers.problems.verification import simulation_instants, verify
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.pinocchio_bridge import rnea
from tramnet_workers.robots.puma560 import akb

Array = NDArray[np.float64]


def paper_task(**changes: object) -> MotionTask:
    return MotionTask.for_arm(akb(), PAPER_START, PAPER_GOAL, **changes)  # type: ignore[arg-type]


def line(task: MotionTask) -> PathPlan:
    plan = straight_line(task)
    assert plan is not None
    return plan


def two_pieces(task: MotionTask, duration: float) -> ParabolicPlan:
    """Accelerate all joints evenly half the time, and brake the other half."""
    h = np.full(2, duration / 2)
    way = task.goal - task.start
    top = 2.0 * way / duration
    q = np.array([task.start, 0.5 * (task.start + task.goal), task.goal])
    return ParabolicPlan(
        h, q, np.array([0 * way, top, 0 * way]), np.array([1, -1])[:, None] * top / h[0]
    )


def line_in_segments(task: MotionTask, n: int) -> ParabolicPlan:
    """Accelerate half of the segments and brake the rest, as hard as their first nodes allow."""
    D = (task.goal - task.start) / n
    zero = np.zeros(6)
    h, v, qdd = np.empty(n), np.zeros((n + 1, 6)), np.empty((n, 6))
    q = task.start + np.arange(n + 1)[:, None] * D
    for j in range(n):
        posture = np.tile(q[j], (3, 1))
        K, Hv, g = rnea(task.arm, posture, np.array([D, zero, zero]), np.array([2 * D, v[j], zero]))
        K, Hv = K - g, Hv - g
        slowest, fastest = feasible_rates(K, Hv, g, task.torque_limits)
        rate = fastest if j < n // 2 else min(max(v[j, 0] / (2 * D[0]), slowest), fastest)
        h[j] = 1.0 / rate
        qdd[j] = 2.0 * rate * (D * rate - v[j])
        v[j + 1] = 2.0 * D * rate - v[j]
    return ParabolicPlan(h, q, v, qdd)


def feasible_rates(K: Array, Hv: Array, g: Array, limits: Array) -> tuple[float, float]:
    """Ends of the highest interval of x = 1 / h in which tau = K x^2 - 2 Hv x + g is in bounds."""
    roots = [
        np.roots([K[i], -2 * Hv[i], g[i] - b]) for i in range(6) for b in (-limits[i], limits[i])
    ]
    x = np.sort(
        [0.0, *(float(r.real) for pair in roots for r in pair if r.imag == 0 and r.real > 0)]
    )
    middle = 0.5 * (x[1:] + x[:-1])[:, None]
    inside = (np.abs(K * middle**2 - 2 * Hv * middle + g) <= limits).all(axis=1)
    last = int(np.flatnonzero(inside)[-1])
    first = last
    while first > 0 and inside[first - 1]:
        first -= 1
    return float(x[first]), float(x[last + 1])


def test_the_optimal_straight_line_passes() -> None:
    task = paper_task()

    found = verify(task, line(task))

    assert found.passed
    assert found.reasons == ()
    assert found.torque_ratio_max == pytest.approx(1.0, abs=1e-6)
    assert found.share_over == 0.0
    assert found.end_position_error < 1e-12
    assert found.end_velocity < 1e-12
    assert found.simulated_position_error < 1e-9


def test_a_slow_parabolic_plan_passes() -> None:
    task = paper_task()

    found = verify(task, two_pieces(task, 1.0))

    assert found.passed
    assert found.torque_ratio_max < 0.6
    assert found.simulated_position_error < 1e-9


def test_a_plan_that_is_too_fast_names_the_weak_joints() -> None:
    task = paper_task()

    found = verify(task, line(task).stretched(1 / 1.02))

    assert not found.passed
    assert found.torque_ratio_max == pytest.approx(1.02**2, abs=0.01)
    assert found.share_over > 0.9  # joint 1 is at its bound all the time
    assert found.reasons[0].startswith("joint 1 needs 10")
    assert "97.6 N m" in found.reasons[0]


def test_a_plan_scaled_at_one_posture_a_segment_is_over_its_bounds_as_known() -> None:
    # A prototype's figures for the straight line in 16 segments, each scaled by the dynamics at its
    # first node, as in Wang & Zalzala (1995): 0.4269 s, and over the bound for 47 % of the time.
    task = paper_task()

    found = verify(task, line_in_segments(task, 16))

    assert found.duration == pytest.approx(0.4269, abs=1e-4)
    assert found.torque_ratios[:2] == pytest.approx((1.040, 1.013), abs=1e-3)
    assert found.share_over == pytest.approx(0.47, abs=0.05)
    assert found.end_velocity < 1e-6
    assert found.simulated_position_error < 1e-9
    assert len(found.reasons) == 2


def test_a_plan_for_another_goal_misses_this_one() -> None:
    task = paper_task()
    goal = np.array(PAPER_GOAL) + 1e-3

    found = verify(task, line(MotionTask.for_arm(akb(), PAPER_START, goal)))

    assert not found.passed
    assert found.end_position_error == pytest.approx(1e-3)
    assert any("from the goal" in reason for reason in found.reasons)


def test_a_plan_that_does_not_stop_fails_only_where_it_should() -> None:
    free = paper_task(weights=ObjectiveWeights(end_velocity=0.0))
    plan = line(free)

    assert verify(free, plan).passed
    found = verify(paper_task(), plan)
    assert not found.passed
    assert any("not at rest" in reason for reason in found.reasons)


def test_a_speed_beyond_its_limit_is_named() -> None:
    task = paper_task()

    found = verify(paper_task(velocity_limits=[9.0, 1.5, 9.0, 9.0, 9.0, 9.0]), line(task))

    assert not found.passed
    assert found.velocity_margin is not None
    assert found.velocity_margin < 0.0
    assert next(reason for reason in found.reasons if "rad/s" in reason).startswith("joint 2")


def test_a_position_beyond_its_limit_is_found() -> None:
    task = paper_task()
    narrow = replace(task, position_upper=np.full(6, 0.9))
    bump = np.zeros((6, 1))
    bump[5] = -1.0  # the mode is negative: joint 6 goes past its goal and returns
    plan = time_path(task, SmoothPath(task.start, task.goal, bump))

    assert plan is not None
    found = verify(narrow, plan)
    assert not found.passed
    assert found.position_margin is not None
    assert found.position_margin < -1e-3
    assert any("position limit" in reason for reason in found.reasons)


def test_a_payload_that_the_plan_does_not_know_of_is_found_by_its_torques() -> None:
    task = paper_task()
    loaded = replace(task, arm=task.arm.with_payload(5.0, (0.0, 0.0, 0.1)))

    found = verify(loaded, line(task))

    assert not found.passed
    assert found.torque_ratio_max > 1.02


def test_what_has_no_limits_has_no_margin() -> None:
    task = paper_task(position_lower=[-np.inf] * 6, position_upper=[np.inf] * 6)

    found = verify(task, line(task))

    assert found.position_margin is None
    assert found.velocity_margin is None
    assert b"inf" not in msgspec.json.encode(found).lower()


def test_simulation_instants_hold_every_break_and_no_long_step() -> None:
    task = paper_task()
    plan = two_pieces(task, 0.7)

    instants = simulation_instants(plan)

    assert np.isin(plan.breaks, instants).all()
    assert (np.diff(instants) > 0.0).all()
    assert np.diff(instants).max() <= 0.0005 * (1 + 1e-9)


def test_a_long_motion_is_simulated_in_windows() -> None:
    task = paper_task()

    found = verify(task, two_pieces(task, 6.0))

    assert found.passed
    assert found.simulated_position_error < 1e-9


def test_a_plan_that_contradicts_itself_is_found_by_simulation() -> None:
    # Positions that do not follow from the accelerations: no torque takes an arm along them.
    task = paper_task()
    plan = two_pieces(task, 1.0)
    torn = ParabolicPlan(plan.h, plan.q, plan.qd, 1.01 * plan.qdd)

    found = verify(task, torn)

    assert not found.passed
    assert any("off the plan" in reason for reason in found.reasons)
