"""What a planned motion leaves in its run folder: its files, and its part of ``result.json``."""

import math
from pathlib import Path

import numpy as np

from tramnet_master.experiments.experiment import Common, Timing
from tramnet_master.results import Check, Limits, MotionResult, ServoResult
from tramnet_master.run_folder import NODES, STRAIGHT_LINE, TRAJECTORY
from tramnet_master.sampling import sample_plan
from tramnet_master.trajectories import write_nodes
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.path_timing import stops
from tramnet_workers.problems.plan import Plan
from tramnet_workers.problems.verification import (
    LARGEST_RATIO,
    POSITION_ERROR,
    VELOCITY_ERROR,
    Verification,
    verify,
)
from tramnet_workers.problems.yardsticks import plan_objective, reference_limit


def write_motion(folder: Path, task: MotionTask, plan: Plan, line: Plan | None) -> None:
    """Write ``trajectory.csv``, ``nodes.csv`` and, where there is one, ``straight_line.csv``.

    Args:
        folder: The run folder.
        task: The task.
        plan: The plan that was found.
        line: The straight line, timed optimally.

    Raises:
        CannotWrite: The disk refuses.
    """
    sample_plan(plan, task.arm, task.torque_limits).write(folder / TRAJECTORY)
    nodes = plan.sample(plan.breaks)
    write_nodes(folder / NODES, plan.breaks, nodes.q, nodes.qd)
    if line is not None:
        sample_plan(line, task.arm, task.torque_limits).write(folder / STRAIGHT_LINE)


def motion_result(
    common: Common,
    timing: Timing,
    task: MotionTask,
    plan: Plan,
    line: Plan | None,
    servo: ServoResult | None = None,
) -> MotionResult:
    """Verify a plan and put together what ``result.json`` says of it.

    Args:
        common: What every experiment says.
        timing: How fast the run was.
        task: The task.
        plan: The plan that was found.
        line: The straight line, timed optimally, or None where there is none.
        servo: What replays through a servo showed, if one was asked for.
    """
    found, limit = verify(task, plan), reference_limit(task)
    line_time = line.duration if line is not None else None
    return MotionResult(
        **common,
        **timing,
        robot=task.arm.name.removeprefix("puma560-"),
        start_rad=task.start.tolist(),
        goal_rad=task.goal.tolist(),
        limits=_limits(task),
        motion_time_s=plan.duration,
        objective=plan_objective(task, plan),
        end_velocity_rad_s=float(np.abs(plan.sample(np.array([plan.duration])).qd).sum()),
        torque_ratio_max=found.torque_ratio_max,
        straight_line_time_s=line_time,
        limit_time_s=limit,
        gap_to_limit=_gap(plan.duration, limit),
        gap_to_straight_line=_gap(plan.duration, line_time),
        verified=found.passed,
        verification=checks_of(task, found),
        failures=list(found.reasons),
        servo=servo,
    )


def checks_of(task: MotionTask, found: Verification) -> list[Check]:
    """The lines of a verification, with the limit that each has to keep."""
    ratio, error, speed = found.torque_ratio_max, found.end_position_error, found.end_velocity
    drift = found.simulated_position_error
    still = VELOCITY_ERROR if stops(task) else None
    checks = [
        Check("torque to its limit", ratio, LARGEST_RATIO, "", ratio <= LARGEST_RATIO),
        Check("share of time over it", 100 * found.share_over, None, "%", True),
        Check("end: distance to goal", error, POSITION_ERROR, "rad", error <= POSITION_ERROR),
        Check("end: speed", speed, still, "rad/s", still is None or speed <= still),
        Check("simulated: distance", drift, POSITION_ERROR, "rad", drift <= POSITION_ERROR),
        Check("simulated: speed off", found.simulated_velocity_error, None, "rad/s", True),
    ]
    if found.position_margin is not None:
        checks.append(_margin("margin to angle limits", found.position_margin, 1e-9, "rad"))
    if found.velocity_margin is not None:
        fastest = task.velocity_limits[np.isfinite(task.velocity_limits)].max()
        slack = (LARGEST_RATIO - 1.0) * float(fastest)
        checks.append(_margin("margin to speed limits", found.velocity_margin, slack, "rad/s"))
    return checks


def _margin(name: str, margin: float, slack: float, unit: str) -> Check:
    return Check(name, margin, -slack, unit, margin >= -slack, at_least=True)


def _limits(task: MotionTask) -> Limits:
    return Limits(
        task.torque_limits.tolist(),
        [limit if math.isfinite(limit) else None for limit in task.velocity_limits.tolist()],
        [limit if math.isfinite(limit) else None for limit in task.position_lower.tolist()],
        [limit if math.isfinite(limit) else None for limit in task.position_upper.tolist()],
    )


def _gap(time: float, other: float | None) -> float | None:
    return None if other is None else time / other - 1.0
