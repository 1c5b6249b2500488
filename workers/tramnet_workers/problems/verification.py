"""Verification of a plan, whoever made it: nothing here trusts the planner.

Torques come from Pinocchio's inverse dynamics at 4,000 instants, not from the kernels that planned.
Then the plan's torques drive Pinocchio's forward dynamics, open loop, piece by piece between the
instants where the acceleration jumps: an integrator that steps across a jump would blame the plan.

Open loop, an arm against gravity is unstable; in one measured case deviations grew tenfold each
second, so that after ten seconds nothing but rounding is left. A motion longer than two seconds is
therefore simulated in windows of two seconds, each from the plan's own state.
"""

import math
from itertools import pairwise

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.path_timing import stops
from tramnet_workers.problems.plan import Plan
from tramnet_workers.robots.pinocchio_bridge import forward_simulate, rnea

Array = NDArray[np.float64]

INSTANTS = 4000
LARGEST_RATIO = 1.001  # of torque or velocity to its limit
POSITION_ERROR = 1e-6  # [rad]
VELOCITY_ERROR = 1e-6  # [rad/s]
_ROUNDING = 1e-9  # by which a position limit may be missed [rad]
_STEP = 0.0005  # longest step of the simulation [s]
_WINDOW = 2.0  # longest run of it [s]


class Verification(Struct, frozen=True):
    """What was found out about a plan.

    Attributes:
        duration: Motion time [s].
        torque_ratio_max: Largest ratio of torque to limit, of any joint at any instant.
        torque_ratios: The same for each joint.
        share_over: Share of the time in which some joint's torque is over its limit, by more than
            passes.
        end_position_error: Largest distance of a joint from the goal at the end [rad].
        end_velocity: Largest speed of a joint at the end [rad/s].
        position_margin: Smallest distance of a joint from its position limits, negative beyond
            them [rad]; None where there are no limits.
        velocity_margin: Smallest distance of a joint's speed from its limit [rad/s]; None where there
            are no limits.
        simulated_position_error: Largest deviation of a joint from the plan at the end of the
            simulation, or of a window of it [rad].
        simulated_velocity_error: The same for the joints' speeds [rad/s].
        passed: Whether the plan can be carried out.
        reasons: Why not, in words; empty if it can.
    """

    duration: float
    torque_ratio_max: float
    torque_ratios: tuple[float, ...]
    share_over: float
    end_position_error: float
    end_velocity: float
    position_margin: float | None
    velocity_margin: float | None
    simulated_position_error: float
    simulated_velocity_error: float
    passed: bool
    reasons: tuple[str, ...]


def verify(task: MotionTask, plan: Plan) -> Verification:
    """Return what is found out about a plan.

    Args:
        task: What the plan has to do, with the arm that has to do it.
        plan: The plan.
    """
    motion = plan.sample(np.linspace(0.0, plan.duration, INSTANTS))
    ratios = np.abs(rnea(task.arm, *motion)) / task.torque_limits
    end = plan.sample(np.array([plan.duration]))
    position_error, velocity_error = _simulate(task, plan)
    found = Verification(
        duration=plan.duration,
        torque_ratio_max=float(ratios.max()),
        torque_ratios=tuple(ratios.max(axis=0).tolist()),
        share_over=float((ratios > LARGEST_RATIO).any(axis=1).mean()),
        end_position_error=float(np.abs(end.q[0] - task.goal).max()),
        end_velocity=float(np.abs(end.qd[0]).max()),
        position_margin=_or_none(_position_margin(task, motion.q)),
        velocity_margin=_or_none(float((task.velocity_limits - np.abs(motion.qd)).min())),
        simulated_position_error=position_error,
        simulated_velocity_error=velocity_error,
        passed=True,
        reasons=(),
    )
    reasons = _reasons(found, task, motion.qd)
    return replace(found, passed=not reasons, reasons=reasons)


def simulation_instants(plan: Plan, step: float = _STEP) -> Array:
    """Return instants at most a step apart, with each of a plan's breaks among them [s]."""
    breaks = plan.breaks
    pieces = [
        np.linspace(first, last, math.ceil((last - first) / step) + 1)[:-1]
        for first, last in pairwise(breaks)
        if last > first
    ]
    return np.append(np.concatenate(pieces), breaks[-1])


def _simulate(task: MotionTask, plan: Plan) -> tuple[float, float]:
    """Return how far from a plan its torques take the arm, and how much faster or slower.

    Returns:
        Largest deviations of a joint's angle [rad] and speed [rad/s] at the end of any window.
    """
    arm = task.arm

    def torque(t: float) -> Array:
        torques = inverse_dynamics_batch(arm.table, arm.gravity, *plan.sample(np.array([t])))
        return torques.reshape(-1)

    position = velocity = 0.0
    for window in _windows(simulation_instants(plan)):
        ends = plan.sample(window[[0, -1]])
        motion = forward_simulate(arm, torque, ends.q[0], ends.qd[0], window)
        position = max(position, float(np.abs(motion.q[-1] - ends.q[1]).max()))
        velocity = max(velocity, float(np.abs(motion.qd[-1] - ends.qd[1]).max()))
    return position, velocity


def _windows(instants: Array) -> list[Array]:
    """Cut instants into runs of ``_WINDOW``, each of which begins where the one before ends."""
    last = len(instants) - 1
    cuts = np.searchsorted(instants, np.arange(_WINDOW, instants[-1], _WINDOW))
    borders = np.unique([0, *cuts, last])
    return [instants[first : end + 1] for first, end in pairwise(borders)]


def _position_margin(task: MotionTask, q: Array) -> float:
    return float(np.minimum(q - task.position_lower, task.position_upper - q).min())


def _or_none(margin: float) -> float | None:
    """Return a margin, or None for an infinite one, which no JSON file can hold."""
    return margin if margin < math.inf else None


def _reasons(found: Verification, task: MotionTask, qd: Array) -> tuple[str, ...]:
    """Return in words why a plan cannot be carried out."""
    reasons = [
        f"joint {i + 1} needs {100 * ratio:.2f} % of its torque limit of {limit:g} N m"
        for i, (ratio, limit) in enumerate(
            zip(found.torque_ratios, task.torque_limits, strict=True)
        )
        if not ratio <= LARGEST_RATIO
    ]
    speeds = np.abs(qd).max(axis=0)
    reasons += [
        f"joint {i + 1} reaches {speed:.6g} rad/s, its limit is {limit:g} rad/s"
        for i, (speed, limit) in enumerate(zip(speeds, task.velocity_limits, strict=True))
        if not speed <= LARGEST_RATIO * limit
    ]
    if found.position_margin is not None and not found.position_margin >= -_ROUNDING:
        reasons.append(f"a joint goes {-found.position_margin:.3g} rad beyond its position limit")
    if not found.end_position_error <= POSITION_ERROR:
        reasons.append(f"it ends {found.end_position_error:.3g} rad from the goal")
    if stops(task) and not found.end_velocity <= VELOCITY_ERROR:
        reasons.append(f"it ends at {found.end_velocity:.3g} rad/s, not at rest")
    if not found.simulated_position_error <= POSITION_ERROR:
        reasons.append(
            f"its torques, simulated, take the arm {found.simulated_position_error:.3g} rad off "
            "the plan"
        )
    return tuple(reasons)
