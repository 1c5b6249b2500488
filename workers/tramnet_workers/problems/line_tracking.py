"""Following paths: the problem that the workers solve, run by run of points."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Self

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters, InvalidTask
from tramnet_workers.kernels.scenes import Scene
from tramnet_workers.problems.problem import Run
from tramnet_workers.problems.tracking_task import MOST_STEPS, TrackingTask
from tramnet_workers.tracking_evolution import Evolution
from tramnet_workers.tracking_methods import TrackingMethod, build_method

Array = NDArray[np.float64]

_NAME = "line-tracking"


def track(
    task: TrackingTask,
    method: TrackingMethod,
    first: int,
    last: int,
    posture: Array,
    subpopulation: int = 0,
) -> Run:
    """Follow points ``first`` to ``last - 1`` of a path; point 0 is the start.

    The run depends on nothing but the arguments, so a path may be cut into runs anywhere.

    Args:
        task: The task.
        method: How to follow, seed included.
        first: Number of the first point, from 1.
        last: Number after the last one, at most ``task.n_steps + 1``.
        posture: Joint angles at the point before ``first``, of shape (n_joints,) [rad].
        subpopulation: Number of the sub-population, from 0.

    Raises:
        InvalidTask: There are no such points, or the posture is none.
    """
    if not 1 <= first <= last <= task.n_steps + 1:
        raise InvalidTask(
            "points", f"{first} to {last}", f"points from 1 to {task.n_steps + 1}, in order"
        )
    q = np.array(posture, dtype=np.float64)
    if q.shape != task.start.shape or not np.isfinite(q).all():
        raise InvalidTask("posture", f"{q}", f"{task.n_joints} finite angles")
    run = Run(np.empty((last - first, task.n_joints)), np.empty(last - first))
    scene = task.scene(method.clearance_weight)
    method.follow(scene, first, q, subpopulation, run.path, run.cost)
    return run


@dataclass(frozen=True, eq=False)
class LineTracking:
    """Paths to follow with one method, each by one or several sub-populations.

    Attributes:
        tasks: The scenes: paths that have nothing to do with each other.
        method: How to follow, with the population of all sub-populations together.
        subpopulations: Into how many sub-populations each scene's population is split.
    """

    tasks: tuple[TrackingTask, ...]
    method: TrackingMethod
    subpopulations: int = 1

    def __post_init__(self) -> None:
        if not self.tasks:
            raise InvalidParameters(_NAME, "no task, but at least one is needed")
        if len({task.n_steps for task in self.tasks}) > 1:
            raise InvalidParameters(_NAME, "scenes with different numbers of steps")
        if self.subpopulations < 1:
            raise InvalidParameters(_NAME, f"{self.subpopulations} sub-populations, not 1 or more")
        if self.subpopulations > 1 and not isinstance(self.method, Evolution):
            reason = f"{self.method.name} has no population to split into {self.subpopulations}"
            raise InvalidParameters(_NAME, reason)
        _ = self._shares

    @property
    def name(self) -> str:
        """Name under which the registry builds it."""
        return _NAME

    def track(self, population: int, first: int, last: int, posture: Array) -> Run:
        """Follow a run of points of a scene with one of its sub-populations.

        Args:
            population: Number of the scene times the number of sub-populations, plus the number of
                the sub-population.
            first: Number of the first point, from 1.
            last: Number after the last one.
            posture: Joint angles at the point before ``first``, of shape (n_joints,) [rad].

        Raises:
            InvalidTask: There is no such scene, no such point, or the posture is none.
        """
        scene, subpopulation = divmod(population, self.subpopulations)
        if not 0 <= scene < len(self.tasks):
            raise InvalidTask("scene", f"{scene}", f"0 to {len(self.tasks) - 1}")
        method = self._shares[subpopulation]
        return track(self.tasks[scene], method, first, last, posture, subpopulation)

    def warm_up(self) -> None:
        """Follow the first point of the first scene, so that the compiled kernels are loaded."""
        self.track(0, 1, 2, self.tasks[0].start)

    def evaluations_per_step(self) -> int:
        """Return how many candidates are compared for a point of one scene."""
        scene: Scene = self.tasks[0].scene(self.method.clearance_weight)
        return sum(method.evaluations_per_step(scene) for method in self._shares)

    def parameters(self) -> dict[str, object]:
        """Return the problem as plain values, for the wire; the points of all paths in one binary string."""
        tasks = [task.parameters() for task in self.tasks]
        for task in tasks:
            del task["path"]
        return {
            "paths": np.stack([task.path for task in self.tasks]).astype("<f8").tobytes(),
            "steps": self.tasks[0].n_steps,
            "tasks": tasks,
            "method": self.method.parameters(),
            "subpopulations": self.subpopulations,
        }

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Rebuild a problem from what ``parameters`` returned.

        Raises:
            InvalidParameters: If a key is missing or unknown, or a setting is wrong.
            InvalidTask: If a task is wrong.
        """
        try:
            plain = msgspec.convert(dict(parameters), _Plain, strict=True)
        except msgspec.ValidationError as error:
            raise InvalidParameters(_NAME, str(error)) from error
        found, expected = len(plain.paths), len(plain.tasks) * (plain.steps + 1) * _POINT_BYTES
        if found != expected:
            raise InvalidParameters(_NAME, f"paths of {found} bytes, not {expected}")
        paths = np.frombuffer(plain.paths, "<f8").reshape(len(plain.tasks), plain.steps + 1, 3)
        tasks = (
            TrackingTask.from_parameters({**task, "path": path.tolist()})
            for task, path in zip(plain.tasks, paths, strict=True)
        )
        return cls(tuple(tasks), build_method(plain.method), plain.subpopulations)

    @cached_property
    def _shares(self) -> tuple[TrackingMethod, ...]:
        if not isinstance(self.method, Evolution):
            return (self.method,)
        return tuple(self.method.share(i, self.subpopulations) for i in range(self.subpopulations))


_POINT_BYTES = 24


class _Plain(Struct, frozen=True, forbid_unknown_fields=True):
    paths: bytes
    steps: Annotated[int, Meta(ge=1, le=MOST_STEPS)]
    tasks: Annotated[list[dict[str, object]], Meta(min_length=1)]
    method: dict[str, object]
    subpopulations: Annotated[int, Meta(ge=1, le=4096)]
