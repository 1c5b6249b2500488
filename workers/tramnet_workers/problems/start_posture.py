"""Postures from which a path can be begun: the tip on its first point."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tramnet_workers.errors import InvalidTask
from tramnet_workers.problems.line_tracking import track
from tramnet_workers.problems.tracking_task import MOST_STEPS, TrackingTask, points_along
from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.link_chain import link_chain
from tramnet_workers.tracking_methods import ResolvedRate

Array = NDArray[np.float64]

_WAY = 0.1  # of the tip in a step [cm]
_CLOSE = 1e-3  # distance at which the tip counts as there [cm]


def find_start(arm: SerialArm, near: Array, point: Array, boxes: ArrayLike = ()) -> Array | None:
    """Lead the tip straight to a point, away from boxes, by resolved-rate control.

    Args:
        arm: The arm.
        near: Joint angles to begin with, of shape (n_joints,) [rad].
        point: Where the tip is to be, of shape (3,) [cm].
        boxes: Boxes to keep away from, of shape (n_boxes, 6) [cm].

    Returns:
        Joint angles with the tip on the point, of shape (n_joints,) [rad], or None where the way
        there leads out of reach.
    """
    q = np.clip(near, arm.position_lower, arm.position_upper)
    tip = link_chain(arm).points(q[None])[0, -1]
    distance = float(np.linalg.norm(point - tip))
    if distance > _CLOSE:
        n_steps = int(np.clip(np.ceil(distance / _WAY), 1, MOST_STEPS))
        try:
            task = TrackingTask.for_arm(arm, q, points_along([tip, point], n_steps), boxes=boxes)
        except InvalidTask:
            return None
        q = track(task, ResolvedRate(), 1, n_steps + 1, q).path[-1]
        tip = link_chain(arm).points(q[None])[0, -1]
    return q if np.linalg.norm(point - tip) <= _CLOSE else None
