"""A plan replayed through a servo, a panel a joint, like figure 17 of Wang & Zalzala (1995)."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from tramnet_master.csv_tables import read_table
from tramnet_master.reports.joints import height_for
from tramnet_master.reports.record import RunRecord
from tramnet_master.reports.style import (
    BOUND,
    PLAN,
    SERVO,
    joint_axes,
    legend_below,
    new_figure,
)
from tramnet_master.trajectories import joined, times

MOST_POINTS = 60  # more set-points would be a line of their own


def draw_servo(record: RunRecord, period: float, path: Path) -> Figure:
    """Set-points, what the servo aimed at, and what the arm did.

    Args:
        record: The run.
        period: Time between two set-points [ms].
        path: The file of the replay.

    Raises:
        DamagedFile: The file is torn.
    """
    table = read_table(path)
    t, q = times(table, path), joined(table, "q{}_rad", path)
    reference = joined(table, "reference{}_rad", path)
    n_joints = q.shape[1]
    title = f"Replay through a servo, set-points every {period:g} ms"
    figure = new_figure(height_for(n_joints), title, record.found.caption)
    panels = joint_axes(figure, n_joints, "angle [rad]")
    since = np.abs(t / (0.001 * period) - np.round(t / (0.001 * period)))
    points = since < 1e-6
    goal = record.found.column("goal_rad") or reference[-1].tolist()
    for i, axes in enumerate(panels):
        axes.plot(t, reference[:, i], color=BOUND, linewidth=1.2, label="aimed at")
        axes.plot(t, q[:, i], color=SERVO, label="arm")
        if points.sum() <= MOST_POINTS:
            axes.plot(t[points], reference[points, i], "o", color=PLAN, ms=4.5, label="set-points")
        error = 1000 * abs(q[-1, i] - goal[i])
        axes.set_title(f"end error {error:.3g} mrad", loc="right", color=BOUND, fontsize=9)
        axes.margins(x=0.02, y=0.08)
    legend_below(figure, panels)
    figure.align_ylabels(panels)
    return figure
