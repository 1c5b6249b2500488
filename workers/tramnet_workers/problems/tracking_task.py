"""What an arm has to follow, past which boxes, in which steps.

The arm itself is in metres, like all arms; everything else here is in centimetres, as in Lin, Chen &
Yu (2017). All numbers are checked here, once.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Self, cast

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tramnet_workers.errors import InvalidTask
from tramnet_workers.kernels.kinematics import LARGEST_TURN
from tramnet_workers.kernels.scenes import Objective, Scene
from tramnet_workers.problems import task_checks, tracking_checks
from tramnet_workers.robots.arm import InvalidArm, SerialArm
from tramnet_workers.robots.link_chain import LinkChain, link_chain
from tramnet_workers.robots.redundant8 import LINE, TOP_PLANE, redundant8, start_posture

Array = NDArray[np.float64]

#: Largest number of joints.
MOST_JOINTS = 12

#: Largest number of steps of a path.
MOST_STEPS = 100_000

_PAPER_STEPS = 1000
_PAPER_STEP = np.radians(0.5)


@dataclass(frozen=True, eq=False)
class TrackingTask:
    """A path for the tip of a serial arm, past boxes.

    Arrays are copied and read-only.

    Attributes:
        arm: The arm.
        start: Joint angles at the first point of the path, of shape (n_joints,) [rad].
        path: Points of the path, the first one where the tip starts, of shape (n_steps + 1, 3) [cm].
        boxes: Boxes (lower x, y, z, upper x, y, z), of shape (n_boxes, 6) [cm].
        step: Largest change M of each joint's angle in a step, of shape (n_joints,) [rad].
        zone: Radius rho of the permissible zone about each point [cm].
        radius: Radius of the links [cm].
        error_weight: w1 of the cost [1/cm²].
        clearance_weight: w2 of the cost [cm²], or None for the method's own.
    """

    arm: SerialArm
    start: Array
    path: Array
    boxes: Array
    step: Array
    zone: float = 0.1
    radius: float = 0.0
    error_weight: float = 1.0
    clearance_weight: float | None = None

    def __post_init__(self) -> None:
        tracking_checks.check_arm(self.arm, self.chain, MOST_JOINTS)
        self._set("start", task_checks.column("start", self.start, self.arm))
        self._set("path", tracking_checks.rows("path", self.path, 3, 2, MOST_STEPS + 1))
        self._set("boxes", tracking_checks.rows("boxes", self.boxes, 6, 0, 10_000))
        self._set("step", task_checks.column("step", self.step, self.arm))
        for name in ("zone", "radius", "error_weight", "clearance_weight"):
            if getattr(self, name) is not None:
                self._set(name, task_checks.number(name, getattr(self, name)))
        tracking_checks.check_sizes(self.step, LARGEST_TURN, self.zone, self.radius)
        tracking_checks.check_weights(self.error_weight, self.clearance_weight)
        tracking_checks.check_boxes(self.boxes)
        tracking_checks.check_start(self.arm, self.chain, self.start, self.path[0], self.zone)
        tracking_checks.check_reach(self.chain, self.path, self.step, self.zone)

    @classmethod
    def for_arm(
        cls,
        arm: SerialArm,
        start: ArrayLike,
        path: ArrayLike,
        *,
        boxes: ArrayLike = (),
        step: ArrayLike = _PAPER_STEP,
        zone: float = 0.1,
        radius: float = 0.0,
        error_weight: float = 1.0,
        clearance_weight: float | None = None,
    ) -> Self:
        """Return a task from any sequences of numbers; ``step`` may be one number for all joints.

        The arguments are the attributes.

        Raises:
            InvalidTask: If they make no task.
        """
        steps = np.full(arm.n_joints, step) if np.ndim(step) == 0 else cast(Array, step)
        return cls(
            arm,
            cast(Array, start),  # made an array and checked on construction, as are all others
            cast(Array, path),
            cast(Array, boxes),
            steps,
            zone,
            radius,
            error_weight,
            clearance_weight,
        )

    @classmethod
    def of_paper(cls, height: float = 0.0, n_steps: int = _PAPER_STEPS) -> Self:
        """Return the task of Lin, Chen & Yu (2017), table 3.

        Args:
            height: Height of the obstacle below the printed top plane [cm]. The paper gives none;
                from 11.8 cm on, the line itself runs through it.
            n_steps: Number of steps.
        """
        box = np.array(TOP_PLANE)
        box[2] -= height
        path = points_along(LINE, n_steps)
        return cls.for_arm(redundant8(), start_posture(), path, boxes=[box])

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return self.arm.n_joints

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return len(self.path) - 1

    @property
    def chain(self) -> LinkChain:
        """The arm's points and links."""
        return link_chain(self.arm)

    def scene(self, clearance_weight: float) -> Scene:
        """Return the task as kernels want it.

        Args:
            clearance_weight: w2 where the task does not say its own [cm²].
        """
        weight = clearance_weight if self.clearance_weight is None else self.clearance_weight
        objective = Objective(self.radius, self.zone, self.error_weight, weight)
        return self._scene._replace(objective=objective)

    @cached_property
    def _scene(self) -> Scene:
        # Copies: Numba compiles a kernel anew for arrays that are read-only.
        chain = type(self.chain.chain)(*(array.copy() for array in self.chain.chain))
        return Scene(
            chain,
            self.chain.links.copy(),
            self.chain.arms @ self.step,
            self.boxes.copy(),
            self.path.copy(),
            self.step.copy(),
            self.arm.position_lower.copy(),
            self.arm.position_upper.copy(),
            int((~self.chain.inert).sum()),
            Objective(self.radius, self.zone, self.error_weight, 0.0),
        )

    def parameters(self) -> dict[str, object]:
        """Return the task as plain values, for the wire and for run files."""
        columns: dict[str, object] = {name: getattr(self, name).tolist() for name in _ARRAYS}
        numbers: dict[str, object] = {name: getattr(self, name) for name in _NUMBERS}
        return {"arm": self.arm.parameters(), **columns, **numbers}

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Rebuild a task from what ``parameters`` returned.

        Raises:
            InvalidTask: If a key is missing or unknown, or a value is wrong.
        """
        try:
            read = msgspec.convert(dict(parameters), _TaskParameters, strict=True)
            arm = SerialArm.from_parameters(read.arm)
        except (msgspec.ValidationError, InvalidArm) as error:
            raise InvalidTask(
                "task", str(error), "what TrackingTask.parameters returned"
            ) from error
        columns = {name: np.array(getattr(read, name)) for name in _ARRAYS}
        return cls(
            arm,
            columns["start"],
            columns["path"],
            columns["boxes"],
            columns["step"],
            read.zone,
            read.radius,
            read.error_weight,
            read.clearance_weight,
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TrackingTask) and self.parameters() == other.parameters()

    def __hash__(self) -> int:
        return hash((self.arm, self.start.tobytes(), self.path.tobytes(), self.boxes.tobytes()))

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)


def points_along(points: ArrayLike, n_steps: int) -> Array:
    """Return the points of a polyline at equal distances along it (eq. 21 for a straight line).

    Corners are cut where they fall between two points.

    Args:
        points: Corners, the first one where the path starts, of shape (at least 2, 3) [cm].
        n_steps: Number of steps.

    Returns:
        Points, of shape (n_steps + 1, 3) [cm].

    Raises:
        InvalidTask: The corners are no polyline.
    """
    task_checks.whole_number("steps", n_steps, 1, MOST_STEPS)
    corners = tracking_checks.rows("points", points, 3, 2, MOST_STEPS)
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    if not lengths.sum() > 0.0:
        raise InvalidTask("points", "a line of no length", "two different points at least")
    along = np.append(0.0, np.cumsum(lengths))
    # Corners that are given twice, or nearly so, have no place of their own along the line.
    kept = np.append(True, np.diff(along) > 0.0)
    corners, along = corners[kept], along[kept]
    places = along[-1] * np.arange(n_steps + 1) / n_steps
    piece = np.clip(np.searchsorted(along, places, side="right") - 1, 0, len(corners) - 2)
    share = (places - along[piece]) / (along[piece + 1] - along[piece])
    path: Array = corners[piece] + share[:, None] * (corners[piece + 1] - corners[piece])
    return path


_ARRAYS = ("start", "path", "boxes", "step")
_NUMBERS = ("zone", "radius", "error_weight", "clearance_weight")


class _TaskParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    arm: dict[str, object]
    start: list[float]
    path: list[list[float]]
    boxes: list[list[float]]
    step: list[float]
    zone: float
    radius: float
    error_weight: float
    clearance_weight: float | None = None  # run files cannot say None
