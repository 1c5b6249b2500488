"""The plan beside the straight line, timed optimally, and the least time there is.

Above, motion times as bars; below, joint positions over time, with the least time T* as an upright line.
"""

from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tramnet_master.reports.joints import height_for
from tramnet_master.reports.record import RunRecord
from tramnet_master.reports.style import (
    LIMIT,
    LINE,
    PAPER,
    PLAN,
    joint_axes,
    legend_below,
    new_figure,
)
from tramnet_master.trajectories import Trajectory

BAR = 0.34  # height of a bar with its gap [inch]


@dataclass(frozen=True)
class Bar:
    """A motion time.

    Attributes:
        name: Whose.
        time: The time [s].
        colour: Of the bar.
    """

    name: str
    time: float
    colour: str


def draw_comparison(record: RunRecord, plan: Trajectory) -> Figure:
    """Motion times as bars, above the joint positions of plan and straight line."""
    bars = motion_times(record, plan)
    above = 0.75 + BAR * len(bars)
    below = height_for(plan.n_joints) - 0.4
    least = record.found.number("limit_time_s")
    title = "The plan and the straight line"
    if least is not None:
        title = "The plan, the straight line and the least time"
    figure = new_figure(above + below, title, record.found.caption)
    grid = figure.add_gridspec(2, 1, height_ratios=[above, below])
    _draw_bars(figure.add_subfigure(grid[0]).add_subplot(), bars, least)
    panels = joint_axes(figure.add_subfigure(grid[1]), plan.n_joints, "angle [rad]")
    for i, axes in enumerate(panels):
        _draw_joint(axes, i, record, plan)
    legend_below(figure, panels)
    figure.align_ylabels(panels)
    return figure


def motion_times(record: RunRecord, plan: Trajectory) -> list[Bar]:
    """The motion times there are, the paper's first and the least last."""
    known = [
        Bar("paper", record.found.number("paper") or 0.0, PAPER),
        Bar("this plan", float(plan.t[-1]), PLAN),
        Bar("straight line", record.found.number("straight_line_time_s") or 0.0, LINE),
        Bar("least time T*", record.found.number("limit_time_s") or 0.0, LIMIT),
    ]
    return [bar for bar in known if bar.time > 0.0]


def _draw_bars(axes: Axes, bars: list[Bar], least: float | None) -> None:
    places = range(len(bars))
    drawn = axes.barh(places, [bar.time for bar in bars], height=0.62)
    for patch, bar in zip(drawn, bars, strict=True):
        patch.set_facecolor(bar.colour)
    axes.bar_label(drawn, [_label(bar, least) for bar in bars], padding=5, fontsize=9)
    axes.set_yticks(places, [bar.name for bar in bars])
    axes.tick_params(axis="y", length=0, labelsize=10)
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.set_xlim(0.0, 1.22 * max(bar.time for bar in bars))
    axes.set_xlabel(
        "motion time [s], and what it exceeds the least time by" if least else "motion time [s]"
    )


def _label(bar: Bar, least: float | None) -> str:
    if least is None or bar.time == least:
        return f"{bar.time:.4f} s"
    return f"{bar.time:.4f} s  ({bar.time / least - 1:+.1%})"


def _draw_joint(axes: Axes, i: int, record: RunRecord, plan: Trajectory) -> None:
    axes.plot(plan.t, plan.q[:, i], color=PLAN, label="this plan")
    line = record.straight_line
    if line is not None:
        axes.plot(line.t, line.q[:, i], color=LINE, linestyle="--", label="straight line")
    least = record.found.number("limit_time_s")
    if least is not None:
        axes.axvline(least, color=LIMIT, linestyle=":", linewidth=1.4, label="least time T*")
    axes.margins(x=0.02, y=0.08)
