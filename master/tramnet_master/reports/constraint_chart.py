"""Which constraint fails where: a row a constraint, a column a station."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from tramnet_master.reports.arm_poses import caption_of
from tramnet_master.reports.design_record import DesignPoint, DesignRecord
from tramnet_master.reports.style import BLACK, VERMILION, new_figure

CONSTRAINTS = {
    "rc": "reach RC [mm]",
    "tc": "obstacles TC [mm]",
    "jlc": "joint limits JLC [mrad]",
    "dm": "dexterity DM",
    "jump": "step to the next [°]",
    "end": "end of the motion [mrad]",
}
"""The constraints that can fail, with their names."""

MOST_VALUES, MOST_NAMES = 24, 12
"""Columns up to which each cell says its value, and stations that are named at most."""

_KEPT, _BROKEN = "#e3f1ea", VERMILION


def draw_constraints(record: DesignRecord) -> Figure:
    """A chart of the constraints at all stations; values stand in it where there is room."""
    points = record.design.points
    failed = np.array([[name in point.fails for point in points] for name in CONSTRAINTS])
    count = int(failed.any(axis=0).sum())
    title = "Every constraint is kept everywhere"
    if count:
        title = f"Constraints fail at {count} of {len(points)} points"
    figure = new_figure(3.7, title, caption_of(record))
    axes = figure.add_subplot()
    axes.imshow(
        failed, aspect="auto", cmap=ListedColormap([_KEPT, _BROKEN]), vmin=0, vmax=1,
        interpolation="nearest",
    )  # fmt: skip
    axes.set_yticks(range(len(CONSTRAINTS)), list(CONSTRAINTS.values()))
    axes.set_xlabel("station along the path, with task points named")
    axes.grid(visible=False)
    axes.set_xticks(np.arange(len(points) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(CONSTRAINTS) + 1) - 0.5, minor=True)
    if len(points) <= 4 * MOST_VALUES:
        axes.grid(visible=True, which="minor", color="white", linewidth=1.5)
    axes.tick_params(which="both", length=0)
    _mark_stations(axes, points)
    if len(points) <= MOST_VALUES:
        _write_values(axes, points)
    names = [Patch(color=_KEPT, label="kept"), Patch(color=_BROKEN, label="violated")]
    figure.legend(handles=names, loc="outside lower center", ncols=2)
    return figure


def _mark_stations(axes: Axes, points: list[DesignPoint]) -> None:
    task = [i for i, point in enumerate(points) if point.task_point]
    shown = task[:: -(-len(task) // MOST_NAMES)]
    axes.set_xticks(shown, [f"{points[i].station:.3g}" for i in shown])


def _write_values(axes: Axes, points: list[DesignPoint]) -> None:
    """What each limit is compared with, at the station or on the way to the next one."""
    for i, point in enumerate(points):
        values = _values(point)
        for row, name in enumerate(CONSTRAINTS):
            colour = "white" if name in point.fails else BLACK
            axes.text(i, row, values[name], ha="center", va="center", fontsize=7, color=colour)


def _values(point: DesignPoint) -> dict[str, str]:
    terms, motion = point.constraints, point.to_next
    found = {
        "rc": _largest(1e3, terms.get("rc"), motion.tracking_error_m if motion else None),
        "tc": _largest(1e3, motion.inside_boxes_m if motion else terms.get("tc")),
        "jlc": _largest(1e3, terms.get("jlc"), motion.limit_excess_rad if motion else None),
        "dm": _largest(1.0, point.dexterity),
    }
    if motion is None:
        return found | {"jump": "", "end": ""}
    return found | {
        "jump": _largest(math.degrees(1.0), motion.step_max_rad),
        "end": _largest(1e3, motion.end_error_rad),
    }


def _largest(scale: float, *values: float | None) -> str:
    """The largest value there is, in few letters."""
    shown = max((scale * value for value in values if value is not None), default=math.nan)
    if math.isnan(shown):
        return "?"
    if abs(shown) < 0.1:
        return f"{shown:.2f}" if abs(shown) >= 5e-3 else "0"
    return f"{shown:.2g}" if abs(shown) < 100 else f"{shown:.0f}"
