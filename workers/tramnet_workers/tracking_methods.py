"""Methods that lead an arm along a path, under the names by which users ask for them.

``eamp`` is the evolution of Lin, Chen & Yu (2017), ``perturbation`` their baseline; ``memetic`` and
``resolved-rate`` are what one would use today. A method is a frozen value: its settings and, where
it draws random numbers, the seed. What it computes for a run of points depends on that value, the
task, the posture before the run and the number of the sub-population, and on nothing else.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import ClassVar, Literal, Protocol

import msgspec
import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.kernels import paths
from tramnet_workers.kernels.scenes import Scene
from tramnet_workers.tracking_evolution import Eamp, Memetic, ascent_for, check_range

Array = NDArray[np.float64]


class TrackingMethod(Protocol):
    """A method of following a path.

    Attributes:
        name: What users call it.
        clearance_weight: w2 for tasks that do not say theirs [cm²].
    """

    name: ClassVar[str]

    @property
    def clearance_weight(self) -> float:
        """Weight of 1/d² in the cost where the task gives none [cm²]."""

    def evaluations_per_step(self, scene: Scene) -> int:
        """Return how many candidates are compared for each point."""

    def follow(
        self,
        scene: Scene,
        first: int,
        posture: Array,
        subpopulation: int,
        path: Array,
        costs: Array,
    ) -> None:
        """Follow a run of points.

        Args:
            scene: The task.
            first: Number of the first point, from 1.
            posture: Joint angles at the point before it, of shape (n,) [rad].
            subpopulation: Number of the sub-population, from 0.
            path: Receives the joint angles at the points, of shape (n_points, n) [rad].
            costs: Receives the costs of the steps, of shape (n_points,).
        """

    def parameters(self) -> dict[str, object]:
        """Return the method as plain values, ``name`` included."""


@dataclass(frozen=True)
class ResolvedRate:
    """Resolved-rate control with ascent of the clearance in the null space (eq. 6).

    Attributes:
        corrections: Number of Gauss-Newton steps after each step.
        ascent: Step in the null space per gradient, relative to arm and clearance; 0 for none.
        sharpness: How much a nearer link counts more than a farther one in the gradient.
        clearance_weight: w2 for tasks that do not say theirs; only the reported cost has it [cm²].
    """

    name: ClassVar[str] = "resolved-rate"

    corrections: int = 1
    ascent: float = 10.0
    sharpness: int = 4
    clearance_weight: float = 0.1

    def __post_init__(self) -> None:
        check_range(self, "corrections", 0, 100)
        check_range(self, "ascent", 0.0, 1e6)
        check_range(self, "sharpness", 1, 100)
        check_range(self, "clearance_weight", 0.0, 1e9)

    def evaluations_per_step(self, scene: Scene) -> int:
        """Return how many candidates are compared for each point: there is one."""
        return 1

    def parameters(self) -> dict[str, object]:
        """Return the method as plain values."""
        return {"name": self.name, **asdict(self)}

    def follow(
        self,
        scene: Scene,
        first: int,
        posture: Array,
        subpopulation: int,
        path: Array,
        costs: Array,
    ) -> None:
        """Follow a run of points; see ``TrackingMethod``."""
        ascent = ascent_for(scene, self.ascent, self.sharpness)
        paths.follow_by_rates(scene, ascent, self.corrections, first, posture, path, costs)


@dataclass(frozen=True)
class Perturbation:
    """The perturbation method: all combinations on a regular grid of joint steps.

    Attributes:
        levels: Values of each joint's step; the paper's n_i = 4 intervals are 5 values.
        search: Shared common parts of combinations, or each combination in full, as in the paper.
            Both find the same steps.
        clearance_weight: w2 for tasks that do not say theirs [cm²].
    """

    name: ClassVar[str] = "perturbation"

    levels: int = 5
    search: Literal["shared", "naive"] = "shared"
    clearance_weight: float = 0.1

    def __post_init__(self) -> None:
        check_range(self, "levels", 2, 101)
        check_range(self, "clearance_weight", 0.0, 1e9)

    def evaluations_per_step(self, scene: Scene) -> int:
        """Return how many candidates are compared for each point."""
        n_joints = len(scene.step) if self.search == "naive" else scene.n_moving
        return int(self.levels**n_joints)

    def parameters(self) -> dict[str, object]:
        """Return the method as plain values."""
        return {"name": self.name, **asdict(self)}

    def follow(
        self,
        scene: Scene,
        first: int,
        posture: Array,
        subpopulation: int,
        path: Array,
        costs: Array,
    ) -> None:
        """Follow a run of points; see ``TrackingMethod``."""
        if self.levels ** len(posture) >= 2**62:
            found = f"{self.levels} levels for each of {len(posture)} joints"
            raise InvalidParameters(self.name, f"{found} make too many combinations to number")
        if self.search == "naive":
            paths.follow_by_naive_perturbation(scene, self.levels, first, posture, path, costs)
        else:
            paths.follow_by_perturbation(scene, self.levels, first, posture, path, costs)


_METHODS: Mapping[str, type[Eamp | Memetic | ResolvedRate | Perturbation]] = {
    method.name: method for method in (Eamp, Memetic, ResolvedRate, Perturbation)
}


def method_names() -> list[str]:
    """Return the names of all methods."""
    return list(_METHODS)


def build_method(parameters: Mapping[str, object]) -> TrackingMethod:
    """Return a method from plain values: its ``name``, and settings that differ from its own.

    Raises:
        InvalidParameters: There is no such method or setting, or a value makes no sense.
    """
    settings = dict(parameters)
    name = settings.pop("name", None)
    if not isinstance(name, str) or name not in _METHODS:
        raise InvalidParameters("tracking", f"method {name!r}; known are {', '.join(_METHODS)}")
    kind = _METHODS[name]
    known = [field.name for field in fields(kind)]
    unknown = sorted(set(settings) - set(known))
    if unknown:
        raise InvalidParameters(name, f"no setting {unknown[0]!r}; known are {', '.join(known)}")
    try:
        return msgspec.convert(settings, kind, strict=True)
    except msgspec.ValidationError as error:
        raise InvalidParameters(name, str(error)) from error
