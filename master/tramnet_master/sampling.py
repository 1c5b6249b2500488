"""Plans made into trajectories: sampled in time, with the torques that they take."""

import math

import numpy as np
from numpy.typing import NDArray

from tramnet_master.trajectories import Trajectory
from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.problems.plan import Plan
from tramnet_workers.robots.arm import SerialArm

Array = NDArray[np.float64]

PERIOD = 0.0005  # longest step of a trajectory file [s]


def sampling_times(duration: float, period: float = PERIOD) -> Array:
    """Evenly spaced times from 0 to ``duration``, both included, at most ``period`` apart [s]."""
    steps = max(1, math.ceil(duration / period))
    return np.linspace(0.0, duration, steps + 1)


def sample_plan(
    plan: Plan, arm: SerialArm, torque_limits: Array, period: float = PERIOD
) -> Trajectory:
    """A plan at times at most ``period`` apart, with the torques that it takes.

    Args:
        plan: The motion.
        arm: The arm that moves, payload included.
        torque_limits: Largest torques in either direction, of shape (n,) [N m].
        period: Longest step [s].
    """
    t = sampling_times(plan.duration, period)
    motion = plan.sample(t)
    tau = inverse_dynamics_batch(arm.table, arm.gravity, motion.q, motion.qd, motion.qdd)
    return Trajectory(t, motion.q, motion.qd, motion.qdd, tau, np.abs(tau) / torque_limits)
