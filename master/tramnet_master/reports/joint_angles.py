"""Joint angles along a path, a panel a joint, like figure 13 of Lin, Chen & Yu (2017)."""

import math

import numpy as np
from matplotlib.figure import Figure

from tramnet_master.reports.joints import Bounds, finished, height_for, widen
from tramnet_master.reports.style import PLAN, joint_axes, new_figure
from tramnet_master.reports.tracking_record import FollowedScene

ALONG = "point k"


def draw_joint_angles(scene: FollowedScene) -> Figure:
    """Joint angles at each point, with their limits where the arm comes near them."""
    q, arm = scene.path.q, scene.task.arm
    figure = new_figure(height_for(q.shape[1]), "Joint angles along the path", scene.caption)
    panels = joint_axes(figure, q.shape[1], "angle [deg]", ALONG)
    for i, axes in enumerate(panels):
        axes.plot(q[:, i], color=PLAN, label="arm")
        bounds = Bounds(_bound(arm.position_lower[i]), _bound(arm.position_upper[i]))
        bounds.near(q[:, i]).draw(axes)
        if scene.task.chain.inert[i]:
            axes.set_title("moves no link", loc="right", fontsize=9)
        widen(axes, 0.08)
    return finished(figure, panels)


def _bound(angle: np.float64) -> float | None:
    return math.degrees(angle) if math.isfinite(angle) else None
