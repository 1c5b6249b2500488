"""The arm in its poses, like figures 11 and 12 of Kim & Khosla (1992); spatial arms in perspective."""

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from tramnet_master.reports.arm_shapes import arm_shape
from tramnet_master.reports.design_record import DesignFile, DesignPoint, DesignRecord
from tramnet_master.reports.style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    legend_below,
    new_figure,
)

Floats = NDArray[np.float64]

HEIGHT = 7.0  # [inch]
FEW = 8  # poses that are drawn boldly and numbered
_MARGIN = 0.08  # around what is drawn, as a share of it


def draw_task_poses(record: DesignRecord) -> Figure:
    """The arm at its task points."""
    points = record.design.task_points
    title = f"The arm at its {len(points)} task points"
    if len(points) == 1:
        title = "The arm at its task point"
    return _draw(record, title, points)


def draw_planned_poses(record: DesignRecord) -> Figure:
    """The arm at all stations, task points and those between them."""
    title = f"The planned poses at all {len(record.design.points)} points"
    return _draw(record, title, record.design.points)


def _draw(record: DesignRecord, title: str, points: Sequence[DesignPoint]) -> Figure:
    design = record.design
    figure = new_figure(HEIGHT, title, caption_of(record))
    if design.spatial:
        axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    else:
        axes = figure.add_subplot()
    line = design.path.line()
    axes.plot(*line.T, color=GREY, linestyle="--", linewidth=1.2, label="path")
    for i, point in enumerate(points):
        _draw_arm(axes, design, point, bold=len(points) <= FEW or point.task_point, first=i == 0)
    _draw_points(axes, points)
    if isinstance(axes, Axes3D):
        _frame_space(axes, design, points)
    else:
        _frame_plane(axes, design, points)
    legend_below(figure, [axes])
    return figure


def _draw_arm(axes: Axes, design: DesignFile, point: DesignPoint, bold: bool, first: bool) -> None:
    places = arm_shape(design, point)
    bad = bool(point.fails)
    colour = VERMILION if bad else BLUE if bold else SKY
    name = "arm, a limit violated" if bad else "arm" if bold else "arm between task points"
    crowd = len(design.points) > 60
    width = (0.6 if crowd else 2.2) if bold else (0.3 if crowd else 0.9)
    axes.plot(
        *places.T,
        color=colour,
        linewidth=width,
        linestyle=":" if bad else "-",
        marker="o" if bold and not crowd else None,
        markersize=4,
        markerfacecolor="white",
        label=name,
        alpha=1.0 if bold else 0.8,
        zorder=3 if bold else 2,
    )
    if first or any(design.points[0].base_m[i] != x for i, x in enumerate(point.base_m)):
        axes.plot(
            *([x] for x in point.base_m), "s", color=BLACK, markersize=8, label="base", zorder=4
        )


def _draw_points(axes: Any, points: Sequence[DesignPoint]) -> None:
    places = np.array([point.point_m for point in points])
    task = np.array([point.task_point for point in points])
    size = 6 if len(points) <= 60 else 3
    axes.plot(*places[task].T, "o", color=ORANGE, markeredgecolor=BLACK, markeredgewidth=0.7,
              markersize=size, label="task point", zorder=5)  # fmt: skip
    if not task.all():
        axes.plot(*places[~task].T, "o", color=BLACK, markersize=size / 2, label="sub-task point",
                  zorder=5)  # fmt: skip
    if task.sum() > FEW:
        return
    for i, place in enumerate(places[task]):
        if len(place) == 2:
            axes.annotate(f"{i + 1}", place, xytext=(7, 5), textcoords="offset points", zorder=6)
        else:
            axes.text(*place, f"  {i + 1}")


def _frame_plane(axes: Axes, design: DesignFile, points: Sequence[DesignPoint]) -> None:
    """Draw the boxes, and give both axes the same scale."""
    for i, (left, bottom, right, top) in enumerate(design.boxes_m):
        size = right - left, top - bottom
        axes.add_patch(
            Rectangle(
                (left, bottom), *size, facecolor="#d9d9d9", edgecolor=GREY, hatch="//", zorder=1,
                label="obstacle" if i == 0 else None,
            )
        )  # fmt: skip
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(_MARGIN)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def _frame_space(axes: Axes3D, design: DesignFile, points: Sequence[DesignPoint]) -> None:
    """Give all axes the same scale."""
    corners = np.concatenate([arm_shape(design, point) for point in points])
    corners = np.concatenate([corners, [point.point_m for point in points]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    half = 0.5 * float((high - low).max()) * (1.0 + _MARGIN)
    middle = 0.5 * (low + high)
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_zlim(middle[2] - half, middle[2] + half)
    axes.set_box_aspect((1.0, 1.0, 1.0), zoom=1.15)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_zlabel("z [m]")
    axes.view_init(elev=22.0, azim=-55.0)


def draw_dexterity(record: DesignRecord) -> Figure:
    """Where the arm is how dexterous: all stations coloured by it, crosses where a limit is violated."""
    design, points = record.design, record.design.points
    figure = new_figure(HEIGHT, "Dexterity over the workspace", caption_of(record))
    axes: Any = figure.add_subplot()
    places = np.array([point.point_m for point in points])
    value = np.array([point.dexterity or 0.0 for point in points])
    reached = np.array(["rc" not in point.fails for point in points])
    scale = Normalize(0.0, max(float(value.max()), 1e-9))
    size = float(np.clip(9000.0 / len(points), 12.0, 90.0))
    dots = axes.scatter(
        *places[reached].T, c=value[reached], s=size, norm=scale, cmap=mpl.colormaps["viridis"],
        label="reached",
    )  # fmt: skip
    axes.scatter(*places[~reached].T, marker="x", s=size / 2, color=GREY, label="not reached")
    axes.plot(*design.points[0].base_m, "s", color=BLACK, markersize=8, label="base")
    figure.colorbar(dots, ax=axes, label="dexterity DM", shrink=0.8)
    _frame_plane(axes, design, points)
    legend_below(figure, [axes])
    return figure


def caption_of(record: DesignRecord) -> str:
    """What ran, and the links that came out."""
    lengths = ", ".join(f"{length:.3g}" for length in record.design.link_lengths_m)
    return f"{record.found.caption}  ·  links {lengths} m"
