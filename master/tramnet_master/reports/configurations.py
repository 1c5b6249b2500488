"""The motion in configuration space, like figures 13 and 14 of Kim & Khosla (1992)."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tramnet_master.reports.arm_poses import caption_of
from tramnet_master.reports.design_record import DesignRecord, Motion
from tramnet_master.reports.joints import Bounds
from tramnet_master.reports.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    columns_for,
    legend_below,
    new_figure,
    rows_for,
)

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

ROW = 2.5  # height of a row of panels [inch]


def draw_configurations(record: DesignRecord, motion: Motion) -> Figure:
    """Joint angles along the path, and below one joint against the next."""
    n = motion.q.shape[1]
    angles = _unrolled(motion.q)
    stations, poses, task = _poses_along(record, motion, angles)
    rows, below = rows_for(n), 1 if n > 1 else 0
    figure = new_figure(1.3 + ROW * (rows + 1.3 * below), "Prototype, planning and control in "
                        "configuration space", caption_of(record))  # fmt: skip
    grid = figure.add_gridspec(1 + below, 1, height_ratios=[rows] + [1.3] * below)
    upper = figure.add_subfigure(grid[0])
    panels: list[Axes] = []
    for k in range(n):
        axes = upper.add_subplot(rows, columns_for(n), k + 1)
        panels.append(axes)
        _draw(axes, motion.stations, angles[:, k], stations, poses[:, k], task)
        axes.set_title(f"Joint {k + 1}")
        axes.set_xlabel("along the path" if k + columns_for(n) >= n else "")
        axes.set_ylabel("angle [rad]" if k % columns_for(n) == 0 else "")
        _draw_limits(axes, record, k, angles[:, k])
    if below:
        lower = figure.add_subfigure(grid[1])
        for i, (k, other) in enumerate(pairwise(range(min(n, 4)))):
            axes = lower.add_subplot(1, min(n, 4) - 1, i + 1)
            panels.append(axes)
            _draw(axes, angles[:, k], angles[:, other], poses[:, k], poses[:, other], task)
            axes.set_xlabel(f"joint {k + 1} [rad]")
            axes.set_ylabel(f"joint {other + 1} [rad]")
            axes.margins(0.08)
    legend_below(figure, panels)
    return figure


def draw_null_motion(record: DesignRecord, motion: Motion) -> Figure:
    """Length of each step in the null space: with the exact gain almost constant in an interval."""
    peak = record.found.number("null_motion_peak_over_mean")
    caption = caption_of(record)
    if peak is not None:
        caption += f"  ·  peak over mean {peak:.3f} at most"
    figure = new_figure(4.0, "Null-space motion of the control step", caption)
    axes = figure.add_subplot()
    for number in np.unique(motion.intervals):
        rows = np.flatnonzero(motion.intervals == number)[1:]
        label = "null-space step"
        axes.plot(motion.stations[rows], 1e3 * motion.null[rows], color=GREEN, label=label)
        axes.axvline(motion.stations[rows[-1]], color="#d0d0d0", linewidth=0.6, zorder=1)
    axes.set_xlabel("along the path")
    axes.set_ylabel("joint motion in a step [mrad]")
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.01)
    return figure


def _draw(axes: Axes, x: Floats, y: Floats, at_x: Floats, at_y: Floats, task: Flags) -> None:
    """The controlled motion as a curve, and the poses that prototype and planning gave it."""
    few = len(task) <= 120
    axes.plot(x, y, color=BLUE, linewidth=1.5, label="control")
    if few:
        axes.plot(at_x[~task], at_y[~task], "o", color=BLACK, markersize=3, label="planning")
    axes.plot(at_x[task], at_y[task], "o", color=ORANGE, markeredgecolor=BLACK,
              markersize=6 if few else 3, label="prototype")  # fmt: skip
    axes.margins(x=0.03, y=0.08)


def _draw_limits(axes: Axes, record: DesignRecord, k: int, angles: Floats) -> None:
    """The joint's limits, where the motion comes near them."""
    lower, upper = record.design.lower_rad[k], record.design.upper_rad[k]
    reach = max(float(np.ptp(angles)), 1e-3)
    near_lower = lower if float(angles.min()) - lower < reach else None
    near_upper = upper if upper - float(angles.max()) < reach else None
    Bounds(near_lower, near_upper).draw(axes)


def _unrolled(q: Floats) -> Floats:
    """Angles without jumps of a turn, so that curves are whole."""
    unrolled: Floats = np.unwrap(q, axis=0)
    return unrolled


def _poses_along(
    record: DesignRecord, motion: Motion, angles: Floats
) -> tuple[Floats, Floats, Flags]:
    """Stations of the poses, the poses in the turn of the motion, and which are at task points."""
    points = record.design.points
    stations = np.array([point.station for point in points])
    starts = np.flatnonzero(np.diff(motion.intervals, prepend=0.0))
    rows = [int(starts[i]) if i < len(starts) else len(angles) - 1 for i in range(len(points))]
    poses = np.array([point.pose_rad for point in points])
    turns = np.round((angles[rows] - poses) / (2.0 * np.pi))
    task = np.array([point.task_point for point in points])
    return stations, poses + 2.0 * np.pi * turns, task
