"""The arm at several points of its path, with the path and the boxes, like figure 14 of Lin, Chen & Yu (2017).

A picture in space, and beside it the same from above and from the side; all in true proportions.
"""

from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MultipleLocator
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from tramnet_master.reports.style import BLUE, ORANGE, VERMILION, legend_below, new_figure
from tramnet_master.reports.tracking_record import FollowedScene

Array = NDArray[np.float64]

HEIGHT = 6.6  # [inch]
POSTURES = 5
FADING = LinearSegmentedColormap.from_list("fading", ["#b5d7ec", BLUE, "#002b42"])

_TICKS = tuple(m * 10.0**p for p in range(-3, 7) for m in (1, 2, 5))  # apart [cm]
_FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))


def draw_postures(scene: FollowedScene) -> Figure:
    """The arm at points evenly spread over its path, pale at the start and dark at the end."""
    title = "Arm, path and boxes" if len(scene.task.boxes) else "Arm and path"
    figure = new_figure(HEIGHT, title, scene.caption)
    grid = figure.add_gridspec(2, 2, width_ratios=[1.75, 1.0])
    space = cast(Axes3D, figure.add_subplot(grid[:, 0], projection="3d"))
    views = [figure.add_subplot(grid[i, 1]) for i in range(2)]
    scenery = Scenery(scene)
    draw_space(space, scenery)
    draw_flat(views[0], scenery, 0, 1, "from above")
    draw_flat(views[1], scenery, *scenery.side, "from the side")
    legend_below(figure, [space])
    return figure


class Scenery:
    """What the three pictures show.

    Attributes:
        postures: Points of the arm, its foot first, by point of the path, each of shape (n + 2, 3) [cm].
        path: Points of the path, of shape (n_steps + 1, 3) [cm].
        boxes: Boxes, of shape (n_boxes, 6) [cm].
        lower: Smallest x, y and z of all that is shown, of shape (3,) [cm].
        upper: Largest ones, of shape (3,) [cm].
    """

    def __init__(self, scene: FollowedScene) -> None:
        task, path = scene.task, scene.path
        at = np.unique(np.linspace(0, path.n_steps, POSTURES).round().astype(np.int64))
        points = task.chain.points(np.radians(path.q[at]))
        foot = np.zeros((len(at), 1, 3))
        arms = np.concatenate([foot, points], axis=1)
        self.postures: dict[int, Array] = dict(zip(at.tolist(), arms, strict=True))
        self.path, self.boxes = task.path, task.boxes
        shown = np.concatenate([arms.reshape(-1, 3), self.path, self.boxes.reshape(-1, 3)])
        self.lower, self.upper = shown.min(axis=0), shown.max(axis=0)

    @property
    def side(self) -> tuple[int, int]:
        """Axes of the view from the side: the longer horizontal one, and z."""
        width = self.upper - self.lower
        return (0, 2) if width[0] > width[1] else (1, 2)

    @property
    def azimuth(self) -> float:
        """Direction from which the arm is seen from its side, somewhat turned [deg]."""
        middle = self.path.mean(axis=0)
        return float(np.degrees(np.arctan2(middle[1], middle[0]))) - 60.0

    def colour(self, k: int) -> tuple[float, float, float, float]:
        """Colour of the posture at point k."""
        return FADING(k / max(len(self.path) - 1, 1))


def draw_space(axes: Axes3D, scenery: Scenery) -> None:
    """Draw the picture in space."""
    for i, box in enumerate(scenery.boxes):
        faces = Poly3DCollection(
            faces_of(box), facecolors=ORANGE, edgecolors=ORANGE, alpha=0.3, linewidths=1.0,
            label="box" if i == 0 else None,
        )  # fmt: skip
        axes.add_collection3d(faces)
    for k, points in scenery.postures.items():
        axes.plot(*points.T, "o-", color=scenery.colour(k), ms=3, lw=2.6, label=f"k = {k}")
    axes.plot(*scenery.path.T, color=VERMILION, linewidth=2.0, label="path", zorder=10)
    _set_proportions(axes, scenery)
    axes.view_init(elev=24, azim=scenery.azimuth)
    axes.set(xlabel="x [cm]", ylabel="y [cm]", zlabel="z [cm]")


def draw_flat(axes: Axes, scenery: Scenery, across: int, up: int, title: str) -> None:
    """Draw the picture along one axis."""
    pair = [across, up]
    for box in scenery.boxes:
        corner, size = box[:3][pair], (box[3:] - box[:3])[pair]
        axes.add_patch(
            Rectangle(corner, *size, facecolor=ORANGE, edgecolor=ORANGE, alpha=0.45, linewidth=2)
        )
    for k, points in scenery.postures.items():
        axes.plot(*points[:, pair].T, "o-", color=scenery.colour(k), ms=2, lw=1.8)
    axes.plot(*scenery.path[:, pair].T, color=VERMILION, linewidth=1.6)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    axes.set_title(title)
    axes.set_xlabel(f"{'xyz'[across]} [cm]")
    axes.set_ylabel(f"{'xyz'[up]} [cm]")


def faces_of(box: Array) -> Array:
    """The corners of the faces of a box, of shape (6, 4, 3) [cm]."""
    x, y, z = box[[0, 3]], box[[1, 4]], box[[2, 5]]
    corners = np.array([(i, j, k) for i in x for j in y for k in z])
    faces: Array = corners[np.array(_FACES)]
    return faces


def _set_proportions(axes: Axes3D, scenery: Scenery) -> None:
    room = 0.04 * (scenery.upper - scenery.lower).max()
    lower, upper = scenery.lower - room, scenery.upper + room
    lower[2] = min(scenery.lower[2], 0.0)
    axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]), zlim=(lower[2], upper[2]))
    axes.set_box_aspect(tuple(upper - lower), zoom=0.9)  # leaves room for labels
    ticks = MultipleLocator(next(t for t in _TICKS if 6 * t > (upper - lower).max()))
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(ticks)
