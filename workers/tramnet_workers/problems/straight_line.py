"""The straight line in joint space, timed optimally: what any planner must beat."""

import numpy as np

from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.path_timing import time_path
from tramnet_workers.problems.plan import PathPlan, SmoothPath


def straight_path(task: MotionTask) -> SmoothPath:
    """Return the straight joint line from a task's start to its goal."""
    return SmoothPath(task.start, task.goal, np.zeros((task.n_joints, 0)))


def straight_line(task: MotionTask) -> PathPlan | None:
    """Return the fastest motion along the straight joint line.

    Args:
        task: The task.

    Returns:
        The plan, or None where the arm is too weak to pass along the line at all.
    """
    return time_path(task, straight_path(task))
