"""What plans are measured by: their task's objective, and the best time that there can be."""

import numpy as np

from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.path_timing import stops
from tramnet_workers.problems.plan import Plan
from tramnet_workers.robots.puma560 import akb, p560

_INSTANTS = 4001

# Table 1 of Wang & Zalzala (1995) [rad].
PAPER_START = (-0.3, 0.4, -0.18, 0.0, -0.05, 0.05)
PAPER_GOAL = (0.51, -0.42, 0.58, 0.87, 0.64, 0.84)

# Shortest times [s] of the paper's task from direct collocation: piecewise constant acceleration in K
# intervals, torques bounded at both ends and in the middle of each, IPOPT from 25 random starts that
# all agree to 3e-5. Rest to rest: extrapolated from K = 16 to 128; end velocity free: K = 64, and
# perhaps 0.1 % too long.
_LIMITS = {
    "puma560-akb": (0.3656, 0.2619),
    "puma560-p560": (0.3419, 0.2431),
}


def plan_objective(task: MotionTask, plan: Plan) -> float:
    """Return a plan's objective: its time, torque impulse and end velocities, weighted.

    The formula is that of ``ObjectiveWeights``, with the integral of mean_i |tau_i| / bound_i over
    time for the torque.

    Args:
        task: The task, with the weights.
        plan: The plan.
    """
    weights = task.weights
    t = np.linspace(0.0, plan.duration, _INSTANTS)
    motion = plan.sample(t)
    torques = inverse_dynamics_batch(task.arm.table, task.arm.gravity, *motion)
    effort = (np.abs(torques) / task.torque_limits).mean(axis=1)
    impulse = np.trapezoid(effort, t)
    end_velocity = np.abs(motion.qd[-1]).sum()
    return float(
        weights.time * plan.duration
        + weights.torque * impulse
        + weights.end_velocity * end_velocity
    )


def reference_limit(task: MotionTask) -> float | None:
    """Return the shortest time in which any motion can do a task [s], or None if it is not known.

    It is known for the paper's task with the arms' own limits.
    """
    for arm in (akb(), p560()):
        paper = MotionTask.for_arm(arm, PAPER_START, PAPER_GOAL, weights=task.weights)
        if _is_same_motion(task, paper):
            at_rest, free = _LIMITS[arm.name]
            return at_rest if stops(task) else free
    return None


def _is_same_motion(task: MotionTask, other: MotionTask) -> bool:
    """Return whether two tasks ask for the same motion, however they weigh it."""
    columns = (
        "start",
        "goal",
        "torque_limits",
        "velocity_limits",
        "position_lower",
        "position_upper",
    )
    return task.arm == other.arm and all(
        np.array_equal(getattr(task, name), getattr(other, name)) for name in columns
    )
