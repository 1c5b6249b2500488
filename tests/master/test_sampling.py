import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.sampling import PERIOD, sample_plan, sampling_times
from tramnet_workers.problems.plan import ParabolicPlan
from tramnet_workers.robots.pinocchio_bridge import rnea
from tramnet_workers.robots.puma560 import akb

START = np.array([-0.3, 0.4, -0.18, 0.0, -0.05, 0.05])
GOAL = np.array([0.51, -0.42, 0.58, 0.87, 0.64, 0.84])


@given(duration=st.floats(1e-6, 20.0))
def test_times_go_from_0_to_the_end_in_even_steps_of_half_a_millisecond_or_less(duration):
    t = sampling_times(duration)

    assert t[0] == 0.0
    assert t[-1] == duration
    steps = np.diff(t)
    assert steps.max() <= PERIOD * (1 + 1e-9)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-6)


def test_a_trajectory_has_the_torques_that_the_plan_takes():
    h = np.array([0.25, 0.25])
    top = 2 * (GOAL - START) / h.sum()
    plan = ParabolicPlan(
        h, np.array([START, (START + GOAL) / 2, GOAL]), np.array([0 * top, top, 0 * top]),
        np.array([top, -top]) / h[:, None],
    )  # fmt: skip
    arm = akb()

    trajectory = sample_plan(plan, arm, arm.torque_limits)

    expected = rnea(arm, trajectory.q, trajectory.qd, trajectory.qdd)
    np.testing.assert_allclose(trajectory.tau, expected, atol=1e-10)
    np.testing.assert_allclose(trajectory.ratio, np.abs(expected) / arm.torque_limits, atol=1e-10)
    np.testing.assert_allclose(trajectory.q[[0, -1]], [START, GOAL], atol=1e-15)
    assert trajectory.t[-1] == pytest.approx(0.5)
