"""What came out of following a path, point by point and in all."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels.distances import segment_box_distances
from tramnet_workers.problems.tracking_task import TrackingTask

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Points after which the clearance no longer shows the start, in the paper's task.
SETTLED = 50


class PointReport(NamedTuple):
    """What an arm does at each point of a path, the start included; N is the number of steps.

    Attributes:
        position: Where the tip is, of shape (N + 1, 3) [cm].
        error: Distance of the tip from the point, of shape (N + 1,) [cm].
        clearance: Distance between arm and boxes, of shape (N + 1,); 0 where they touch [cm].
        nearest_link: Number of the link nearest to a box, from 1, of shape (N + 1,).
        nearest_box: Number of the box nearest to the arm, from 1, of shape (N + 1,); both 0 where
            there is no box.
        step: Largest change of a joint's angle since the point before, of shape (N + 1,) [rad].
    """

    position: Array
    error: Array
    clearance: Array
    nearest_link: Indices
    nearest_box: Indices
    step: Array


class Summary(NamedTuple):
    """How well a path was followed.

    Attributes:
        error_mean: Mean error of the points after the start [cm].
        error_max: Largest error [cm].
        clearance_min: Smallest clearance after the start [cm]; inf without boxes.
        clearance_min_settled: Smallest clearance after the first ``SETTLED`` points [cm]; inf
            without boxes or so many points.
        clearance_mean: Mean clearance [cm].
        points_outside_zone: Number of points with an error above rho.
        step_max: Largest change of a joint's angle in a step [rad].
        roughness: Mean absolute difference between a joint's successive steps [rad].
    """

    error_mean: float
    error_max: float
    clearance_min: float
    clearance_min_settled: float
    clearance_mean: float
    points_outside_zone: int
    step_max: float
    roughness: float


def report_points(task: TrackingTask, path: Array) -> PointReport:
    """Measure each point of a path that was followed.

    Args:
        task: The task.
        path: Joint angles at all points, the start included, of shape (N + 1, n_joints) [rad].
    """
    points = task.chain.points(path)
    position = points[:, -1].copy()
    error = np.linalg.norm(position - task.path[: len(path)], axis=1)
    clearance, link, box = _nearest(task, points)
    step = np.append(0.0, np.abs(np.diff(path, axis=0)).max(axis=1, initial=0.0))
    return PointReport(position, error, clearance, link, box, step)


def summarise(task: TrackingTask, path: Array, report: PointReport) -> Summary:
    """Sum up a report.

    Args:
        task: The task.
        path: Joint angles at all points, the start included, of shape (N + 1, n_joints) [rad].
        report: What ``report_points`` returned for them.
    """
    steps = np.diff(path, axis=0)
    error, clearance = report.error[1:], report.clearance[1:]
    return Summary(
        error_mean=float(error.mean()),
        error_max=float(error.max()),
        clearance_min=float(clearance.min()),
        clearance_min_settled=float(clearance[SETTLED:].min(initial=np.inf)),
        clearance_mean=float(clearance.mean()),
        points_outside_zone=int((error > task.zone).sum()),
        step_max=float(report.step.max()),
        roughness=float(np.abs(np.diff(steps, axis=0)).mean()) if len(steps) > 1 else 0.0,
    )


def _nearest(task: TrackingTask, points: Array) -> tuple[Array, Indices, Indices]:
    """Return clearances, and the numbers of the nearest links and boxes; the lowest of equals."""
    clearance = np.full(len(points), np.inf)
    link, box = np.zeros((2, len(points)), np.int64)
    for i, (start, end) in enumerate(task.chain.links):
        starts, ends = points[:, start].copy(), points[:, end].copy()
        for k, obstacle in enumerate(task.boxes):
            obstacles = np.tile(obstacle, (len(points), 1))
            distance = segment_box_distances(starts, ends, obstacles)
            distance = np.maximum(distance - task.radius, 0.0)
            nearer = distance < clearance
            clearance[nearer], link[nearer], box[nearer] = distance[nearer], i + 1, k + 1
    return clearance, link, box
