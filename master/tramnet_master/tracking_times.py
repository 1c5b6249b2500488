"""What a step of the paper's task costs by each method, measured in this process.

Times are processor time of this thread, so other work on the machine does not count. The naive searches of the grid
are measured on a few points in the middle of the path, all others along all of it.
"""

import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.problems.line_tracking import track
from tramnet_workers.problems.tracking_report import Summary, report_points, summarise
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.tracking_evolution import Eamp, Evolution, Memetic
from tramnet_workers.tracking_methods import Perturbation, ResolvedRate, TrackingMethod

Array = NDArray[np.float64]

SHARED = "perturbation 5^8, shared"


def label(method: TrackingMethod, n_joints: int = 8) -> str:
    """What reports call a method: its name, and how much it computes."""
    match method:
        case Eamp():
            return f"EAMP {method.population}/{method.generations}"
        case Evolution():
            return f"{method.name} {method.population}/{method.generations}"
        case Perturbation():
            return f"{method.name} {method.levels}^{n_joints}, {method.search}"
        case _:
            return method.name


def _labelled(*methods: TrackingMethod) -> dict[str, TrackingMethod]:
    return {label(method): method for method in methods}


METHODS: Mapping[str, TrackingMethod] = _labelled(
    Eamp(seed=1),
    Eamp(population=1000, seed=1),
    Memetic(seed=1),
    ResolvedRate(),
    Perturbation(5),
    Perturbation(4),
)
"""Methods that are fast enough for a whole path."""

NAIVE_METHODS: Mapping[str, TrackingMethod] = _labelled(
    Perturbation(5, "naive"), Perturbation(4, "naive")
)
"""Methods that evaluate each combination in full, as the paper did."""

NAIVE_POINTS = 10
"""Points on which those are measured."""


class MethodTime(NamedTuple):
    """What a method costs, and what it makes of the path.

    Attributes:
        name: Of the method, as reports call it.
        seconds: Processor time of a step [s].
        evaluations: Candidates compared for a point.
        points: Points that were followed.
        quality: How well the path was followed, None where only a part of it was.
    """

    name: str
    seconds: float
    evaluations: int
    points: int
    quality: Summary | None


def measure_methods(
    task: TrackingTask, told: Callable[[str], None] = lambda name: None
) -> list[MethodTime]:
    """Follow the path of a task by each method.

    Args:
        task: The task.
        told: Is called with the name of each method when its turn comes.
    """
    middle = task.n_steps // 2 + 1
    posture = follow(task, Memetic(seed=1), 1, middle, task.start)[-1]
    found = []
    for name, method in METHODS.items():
        told(name)
        found.append(measure(name, method, task, 1, task.n_steps + 1, task.start))
    for name, method in NAIVE_METHODS.items():
        told(name)
        last = min(middle + NAIVE_POINTS, task.n_steps + 1)
        found.append(measure(name, method, task, middle, last, posture))
    return found


def measure(
    name: str, method: TrackingMethod, task: TrackingTask, first: int, last: int, posture: Array
) -> MethodTime:
    """Follow points ``first`` to ``last - 1`` of a path once, and once before to compile.

    Args:
        name: What the method is called.
        method: The method.
        task: The task.
        first: Number of the first point, from 1.
        last: Number after the last one.
        posture: Joint angles at the point before ``first``, of shape (n_joints,) [rad].
    """
    follow(task, method, first, first + 1, posture)
    began = time.thread_time()
    path = follow(task, method, first, last, posture)
    seconds = (time.thread_time() - began) / (last - first)
    whole = last - first == task.n_steps
    evaluations = method.evaluations_per_step(task.scene(method.clearance_weight))
    return MethodTime(
        name, seconds, evaluations, last - first, quality(task, path) if whole else None
    )


def follow(
    task: TrackingTask, method: TrackingMethod, first: int, last: int, posture: Array
) -> Array:
    """Return the postures from the point before ``first`` to ``last - 1``, of shape (n + 1, n_joints)."""
    return np.vstack([posture, track(task, method, first, last, posture).path])


def quality(task: TrackingTask, path: Array) -> Summary:
    """Return how well a whole path was followed."""
    return summarise(task, path, report_points(task, path))
