"""All scenes of a run in one figure, a line each: how far the tip was off, and how near the boxes came."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from tramnet_master.reports.findings import Findings
from tramnet_master.reports.style import BOUND, GREY, PLAN, VERMILION, legend_below, new_figure

LINE = 0.26  # height of a scene's line [inch]
MOST_LINES = 40
FLOOR = 1e-7  # smaller errors are of no interest [cm]

Row = Mapping[str, object]


def draw_scenes(found: Findings, zones: Mapping[str, float]) -> Figure:
    """Errors and clearances of all scenes, or of those of least clearance where there are many.

    Args:
        found: What the run found.
        zones: Radius of each scene's zone, by name [cm].
    """
    rows = _shown(found.rows("scenes"))
    total, height = len(found.rows("scenes")), 1.7 + LINE * len(rows)
    number = f"{total} scenes" if len(rows) == total else f"{len(rows)} of {total} scenes"
    title = f"Errors and clearances of {number}"
    figure = new_figure(height, title, found.caption)
    left, right = figure.subplots(1, 2, sharey=True)
    _draw_errors(left, rows, zones)
    _draw_clearances(right, rows)
    left.set_yticks(range(len(rows)), [str(row.get("name")) for row in rows])
    left.set_ylim(len(rows) - 0.5, -0.5)
    legend_below(figure, [left, right])
    return figure


def _shown(rows: Sequence[Row]) -> list[Row]:
    """The rows there is room for, in their order: those of least clearance, then of most error."""

    def worst_first(row: Row) -> tuple[float, float]:
        clearance = _number(row, "clearance_min_cm")
        return (math.inf if math.isnan(clearance) else clearance, -_number(row, _ERROR_MAX))

    kept = sorted(rows, key=worst_first)[:MOST_LINES]
    return [row for row in rows if row in kept]


_ERROR_MEAN, _ERROR_MAX = "tracking_error_mean_cm", "tracking_error_max_cm"


def _draw_errors(axes: Axes, rows: list[Row], zones: Mapping[str, float]) -> None:
    places = range(len(rows))
    mean, most = (
        [max(_number(row, key), FLOOR) for row in rows] for key in (_ERROR_MEAN, _ERROR_MAX)
    )
    axes.hlines(places, mean, most, color=PLAN, linewidth=1.5, alpha=0.5)
    axes.plot(mean, places, "o", color=PLAN, markersize=5, label="mean")
    axes.plot(most, places, "D", color=VERMILION, markersize=5, label="worst point")
    limits = [zones.get(str(row.get("name")), math.nan) for row in rows]
    axes.plot(limits, places, "|", color=BOUND, markersize=13, markeredgewidth=2, label="zone")
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(numticks=8))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("error [cm]")


def _draw_clearances(axes: Axes, rows: list[Row]) -> None:
    places = np.arange(len(rows))
    least, settled = (
        np.array([_number(row, key) for row in rows])
        for key in ("clearance_min_cm", "clearance_min_after_50_cm")
    )
    axes.hlines(places, least, settled, color=PLAN, linewidth=1.5, alpha=0.5)
    axes.plot(least, places, "D", color=VERMILION, markersize=5, label="worst point")
    axes.plot(settled, places, "s", color=GREY, markersize=5, label="worst after k = 50")
    for place in places[np.isnan(least)]:
        axes.annotate("no box", (0.02, place), xycoords=("axes fraction", "data"), va="center")
    most = np.nanmax([*least, *settled, 1.0])
    axes.set_xlim(-0.03 * most, 1.1 * most)
    axes.set_xlabel("clearance [cm]")
    axes.tick_params(axis="y", length=0)


def _number(row: Row, key: str) -> float:
    value = row.get(key)
    return float(value) if isinstance(value, int | float) else math.nan
