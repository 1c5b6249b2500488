"""Error, clearance and size of the steps along a path."""

import itertools
from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tramnet_master.reports.joint_angles import ALONG
from tramnet_master.reports.style import (
    BOUND,
    LIMIT,
    PLAN,
    SKY,
    VERMILION,
    legend_below,
    new_figure,
)
from tramnet_master.reports.tracking_record import FollowedScene

Array = NDArray[np.float64]

ROW = 2.3  # height of a panel [inch]
FLOOR = 1e-7  # smaller errors are of no interest [cm]


def draw_following(scene: FollowedScene) -> Figure:
    """Error within its zone, clearance below the most there can be, steps below their limit."""
    draw = [_draw_error, _draw_clearance, _draw_step]
    if not len(scene.task.boxes):
        draw.remove(_draw_clearance)
    title = "Error and clearance along the path" if len(draw) > 2 else "Error along the path"
    figure = new_figure(1.2 + ROW * len(draw), title, scene.caption)
    panels = list(figure.subplots(len(draw), 1, sharex=True, squeeze=False)[:, 0])
    for axes, panel in zip(panels, draw, strict=True):
        _shade(axes, scene)
        panel(axes, scene)
        axes.margins(x=0.01)
    panels[-1].set_xlabel(ALONG)
    legend_below(figure, panels)
    figure.align_ylabels(panels)
    return figure


def _draw_error(axes: Axes, scene: FollowedScene) -> None:
    error = np.maximum(scene.path.error, FLOOR)
    axes.semilogy(error, color=PLAN, linewidth=1.0, label="arm")
    below = f"; below {FLOOR:g} cm drawn as that" if scene.path.error.min() < FLOOR else ""
    _draw_limit(axes, scene.task.zone, f"zone {scene.task.zone:g} cm{below}")
    axes.set_ylim(top=2.5 * max(scene.task.zone, float(error.max())))
    axes.set_ylabel("error [cm]")


def _draw_clearance(axes: Axes, scene: FollowedScene) -> None:
    for first, last in _stretches(scene.path.clearance <= 0.0):
        axes.axvspan(first, last, color=VERMILION, alpha=0.35, label="arm touches a box")
    axes.plot(
        scene.most_clearance, color=LIMIT, linestyle=":", label="of the path: the most there can be"
    )
    axes.plot(scene.path.clearance, color=PLAN, label="arm")
    axes.set_ylim(bottom=0.0, top=1.08 * _highest(scene))
    axes.set_ylabel("clearance [cm]")
    axes.set_title(_nearest_links(scene), loc="right", fontsize=9, color=BOUND)


def _draw_step(axes: Axes, scene: FollowedScene) -> None:
    axes.plot(np.arange(1, scene.path.n_steps + 1), scene.path.step[1:], color=PLAN, linewidth=1.0)
    limit = float(np.degrees(scene.task.step.max()))
    _draw_limit(axes, limit, f"at most {limit:g} deg")
    axes.set_ylim(bottom=0.0, top=1.25 * limit)
    axes.set_ylabel("largest step [deg]")


def _draw_limit(axes: Axes, value: float, words: str) -> None:
    axes.axhline(value, color=BOUND, linestyle="--", linewidth=1.3, label="limit")
    axes.set_title(words, loc="right", fontsize=9, color=BOUND)


def _shade(axes: Axes, scene: FollowedScene) -> None:
    """Mark where the path passes above or below a box."""
    for first, last in _stretches(scene.beside_boxes):
        axes.axvspan(
            first, last, color=SKY, alpha=0.25, linewidth=0, label="path above or below a box"
        )


def _stretches(marked: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """First and last points of the stretches that are marked."""
    for value, points in itertools.groupby(range(len(marked)), key=lambda k: bool(marked[k])):
        if value:
            stretch = list(points)
            yield stretch[0], stretch[-1]


def _highest(scene: FollowedScene) -> float:
    """Top of the clearances, the path's own cut off where it is far above the arm's."""
    highest = float(np.nanmax(scene.path.clearance))
    return max(min(float(scene.most_clearance.max()), 2.0 * highest), 1.0)


def _nearest_links(scene: FollowedScene) -> str:
    links, counts = np.unique(scene.path.nearest_link, return_counts=True)
    shares = sorted(zip(counts.tolist(), links.tolist(), strict=True), reverse=True)[:3]
    total = len(scene.path.nearest_link)
    return "nearest: " + ", ".join(f"link {link} at {count / total:.0%}" for count, link in shares)
