"""Figures of a motion, a panel a joint: position, torque, acceleration and velocity.

Like figures 7 to 10 of Wang & Zalzala (1995), and the parts (b) to (e) of its figures 11 to 16.
"""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tramnet_master.reports.record import RunRecord
from tramnet_master.reports.style import (
    BOUND,
    PLAN,
    joint_axes,
    legend_below,
    new_figure,
    rows_for,
)
from tramnet_master.trajectories import Trajectory

Array = NDArray[np.float64]

ROW = 2.2  # height of a row of panels [inch]
MOST_NODES = 60  # more would be a line of their own


@dataclass(frozen=True)
class Bounds:
    """The two dashed lines of a panel.

    Attributes:
        lower: The lower one, None where there is none.
        upper: The upper one, None where there is none.
    """

    lower: float | None
    upper: float | None

    def draw(self, axes: Axes) -> None:
        """Draw those there are."""
        for bound in (self.lower, self.upper):
            if bound is not None:
                axes.axhline(
                    bound, color=BOUND, linestyle="--", linewidth=1.3, label="limit", zorder=3
                )

    def near(self, values: Array) -> "Bounds":
        """Those close enough to be worth the room: nearer than the motion is wide."""
        low, high = float(values.min()), float(values.max())
        reach = max(high - low, 1e-3)
        lower = self.lower if self.lower is not None and low - self.lower < reach else None
        upper = self.upper if self.upper is not None and self.upper - high < reach else None
        return Bounds(lower, upper)


def height_for(n_joints: int) -> float:
    """Height of a figure with a panel for each joint [inch]."""
    return 1.3 + ROW * rows_for(n_joints)


def draw_position(record: RunRecord, plan: Trajectory) -> Figure:
    """Joint angles over time, with the plan's nodes; limits where the motion comes near them."""
    figure, panels = _panels(record, "Joint positions", plan, "angle [rad]")
    lower = record.found.limits("position_lower_rad", plan.n_joints)
    upper = record.found.limits("position_upper_rad", plan.n_joints)
    for i, axes in enumerate(panels):
        axes.plot(plan.t, plan.q[:, i], color=PLAN, label="plan")
        if record.nodes is not None and len(record.nodes.t) <= MOST_NODES:
            nodes = record.nodes
            axes.plot(nodes.t, nodes.q[:, i], "o", color=PLAN, markersize=3.5, label="nodes")
        Bounds(lower[i], upper[i]).near(plan.q[:, i]).draw(axes)
        widen(axes, 0.05)
    return finished(figure, panels)


def draw_torque(record: RunRecord, plan: Trajectory) -> Figure:
    """Joint torques over time, between their dashed limits."""
    figure, panels = _panels(record, "Joint torques and their limits", plan, "torque [N m]")
    limits = record.found.limits("torque_nm", plan.n_joints)
    for axes, tau, limit in zip(panels, plan.tau.T, limits, strict=True):
        axes.plot(plan.t, tau, color=PLAN, label="plan")
        if limit is not None:
            Bounds(-limit, limit).draw(axes)
            axes.set_title(f"±{limit:g} N m", loc="right", color=BOUND, fontsize=9)
        widen(axes, 0.08)
    return finished(figure, panels)


def draw_velocity(record: RunRecord, plan: Trajectory) -> Figure:
    """Joint velocities over time, with the limits there are."""
    figure, panels = _panels(record, "Joint velocities", plan, "velocity [rad/s]")
    limits = record.found.limits("velocity_rad_s", plan.n_joints)
    for axes, qd, limit in zip(panels, plan.qd.T, limits, strict=True):
        axes.plot(plan.t, qd, color=PLAN, label="plan")
        if limit is not None:
            Bounds(-limit, limit).near(qd).draw(axes)
            axes.set_title(f"±{limit:g} rad/s", loc="right", color=BOUND, fontsize=9)
        widen(axes, 0.05)
    return finished(figure, panels)


def draw_acceleration(record: RunRecord, plan: Trajectory) -> Figure:
    """Joint accelerations over time."""
    figure, panels = _panels(record, "Joint accelerations", plan, "acceleration [rad/s²]")
    for axes, qdd in zip(panels, plan.qdd.T, strict=True):
        axes.plot(plan.t, qdd, color=PLAN, label="plan")
        widen(axes, 0.05)
    return finished(figure, panels)


def _panels(
    record: RunRecord, title: str, plan: Trajectory, unit: str
) -> tuple[Figure, list[Axes]]:
    caption = f"{record.found.caption}  ·  {plan.t[-1]:.4f} s"
    figure = new_figure(height_for(plan.n_joints), title, caption)
    return figure, joint_axes(figure, plan.n_joints, unit)


def widen(axes: Axes, margin: float) -> None:
    """Leave room around the data, and a tenth of a unit to a joint that stands still."""
    low, high = axes.dataLim.y0, axes.dataLim.y1
    if high - low < 1e-6:
        axes.set_ylim(low - 0.1, high + 0.1)
    axes.margins(x=0.02, y=margin)


def finished(figure: Figure, panels: list[Axes]) -> Figure:
    """A figure with its legend, its panels' labels in line."""
    legend_below(figure, panels)
    figure.align_ylabels(panels)
    return figure
