"""Replay through a servo: the experiment of Wang & Zalzala (1995), section 6, and its laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.plan import PathPlan
from tramnet_workers.problems.servo import MARGINS, TICK, ServoSettings, replay, slow_down
from tramnet_workers.problems.straight_line import straight_line
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.puma560 import akb

TASK = MotionTask.for_arm(akb(), PAPER_START, PAPER_GOAL)


def line() -> PathPlan:
    plan = straight_line(TASK)
    assert plan is not None
    return plan


def largest_torque_ratio(plan: PathPlan) -> float:
    motion = plan.sample(np.linspace(0.0, plan.duration, 5000))
    torques = inverse_dynamics_batch(TASK.arm.table, TASK.arm.gravity, *motion)
    return float((np.abs(torques) / TASK.torque_limits).max())


def error_at_the_end(plan: PathPlan, period: float, feed_forward: bool) -> float:
    settings = ServoSettings(period=period, feed_forward=feed_forward)
    return float(replay(TASK, plan, settings).tracking_error.max())


def test_set_points_every_28_ms_jerk_four_times_as_much_as_every_1_75_ms() -> None:
    coarse, fine = (
        replay(TASK, line(), ServoSettings(period=period, saturates=False))
        for period in (0.028, 0.00175)
    )

    assert (coarse.rms_jerk > 4.0 * fine.rms_jerk).all()


def test_jerks_are_as_large_as_those_known() -> None:
    # A prototype found 19028 rad/s^3 in joint 1 for a plan of 0.4269 s; the line takes 0.3807 s.
    found = replay(TASK, line(), ServoSettings(period=0.028, saturates=False))

    assert found.rms_jerk[0] == pytest.approx(19028, rel=0.2)
    assert 4.0 < found.peak_command[0] < 6.0


@pytest.mark.parametrize(
    ("margin", "feed_forward", "period", "error"),
    [
        # Largest errors at the end [rad] of a prototype's plan along the same line.
        (1.0, False, 0.028, 176e-3),
        (1.0, False, 0.00175, 53e-3),
        (1.0, True, 0.028, 92e-3),
        (1.0, True, 0.00175, 1.2e-3),
        (0.9, False, 0.028, 23e-3),
        (0.9, False, 0.00175, 3.5e-3),
        (0.9, True, 0.028, 3.6e-3),
        (0.9, True, 0.00175, 0.2e-3),
        (0.8, False, 0.028, 5.2e-3),
        (0.8, False, 0.00175, 3.1e-3),
        (0.8, True, 0.028, 2.6e-3),
        (0.8, True, 0.00175, 0.2e-3),
    ],
)
def test_errors_are_of_the_known_order(
    margin: float, feed_forward: bool, period: float, error: float
) -> None:
    plan = slow_down(TASK, line(), margin)

    assert isinstance(plan, PathPlan)
    assert error / 3 < error_at_the_end(plan, period, feed_forward) < 3 * error


def test_a_plan_at_full_torque_cannot_be_tracked_but_one_with_a_margin_can() -> None:
    errors = []
    for margin in MARGINS:
        plan = slow_down(TASK, line(), margin)
        assert isinstance(plan, PathPlan)
        errors.append(error_at_the_end(plan, 0.028, feed_forward=False))

    assert errors[0] > 5 * errors[1] > 5 * errors[2]


@given(st.floats(0.4, 1.0))
def test_a_plan_with_a_margin_needs_that_share_of_the_torque(margin: float) -> None:
    plan = slow_down(TASK, line(), margin)

    assert isinstance(plan, PathPlan)
    assert largest_torque_ratio(plan) == pytest.approx(margin, rel=1e-3)


def test_a_plan_that_needs_less_is_left_as_it_is() -> None:
    slow = line().stretched(2.0)

    assert slow_down(TASK, slow, 0.9) is slow


def test_no_slowness_helps_against_gravity() -> None:
    # At the start joint 2 needs 35.5 N m of 186.4 to hold the arm.
    assert slow_down(TASK, line(), 0.19) is None


def test_a_slow_plan_is_followed_closely_and_its_torques_are_within_bounds() -> None:
    plan = line().stretched(4.0)

    found = replay(TASK, plan, ServoSettings(period=TICK, feed_forward=True))

    assert np.abs(found.q - plan.sample(found.t).q).max() < 1e-3
    assert (np.abs(found.tau) <= TASK.torque_limits).all()
    assert (found.peak_command < 1.0).all()


@given(
    st.sampled_from([0.028, 0.007, 0.00175, 0.000875]),
    st.floats(1.0, 1.5),
)
@settings(max_examples=8)
def test_the_reference_goes_through_every_set_point(period: float, stretch: float) -> None:
    plan = line().stretched(stretch)

    found = replay(TASK, plan, ServoSettings(period=period))

    every = round(period / TICK)
    at_set_points = found.reference[:-1:every]
    assert at_set_points == pytest.approx(plan.sample(found.t[:-1:every]).q, abs=1e-9)
    assert found.t[-1] == plan.duration


def test_saturated_motors_give_no_more_than_their_limits() -> None:
    found = replay(TASK, line(), ServoSettings(saturates=True))

    assert found.peak_command.max() > 1.0
    assert (np.abs(found.tau) <= TASK.torque_limits).all()
