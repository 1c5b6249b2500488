"""What a motion has to do: from where to where, within which limits, and what counts as good.

The motion starts at rest. All numbers are checked here, once; what stands in a ``MotionTask`` can be
relied on everywhere else.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self, cast

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tramnet_workers.errors import InvalidTask
from tramnet_workers.problems import task_checks
from tramnet_workers.robots.arm import InvalidArm, SerialArm

Array = NDArray[np.float64]

MOST_SEGMENTS = 1000
MOST_MARGIN_LEVELS = 10_000


@dataclass(frozen=True)
class ObjectiveWeights:
    """Weights of the objective: Wang & Zalzala (1995), eqs 7-10, in one formula.

    J = time * sum_j h_j + torque * sum_j tau_j + end_velocity * sum_i |v_n^i|

    The paper leaves tau_j undefined. Here it is the torque impulse of segment j,
    h_j * mean_i |tau_i| / bound_i [s], so that a slow motion is not taken for an easy one.

    Attributes:
        time: Weight of the motion time [1/s].
        torque: Weight lambda_tau of the torque impulse [1/s].
        end_velocity: Weight lambda_v of the end velocities [s/rad]; 0 leaves them free.
    """

    time: float = 1.0
    torque: float = 0.0
    end_velocity: float = 0.1

    def __post_init__(self) -> None:
        for name in ("time", "torque", "end_velocity"):
            value = task_checks.number(f"weights.{name}", getattr(self, name))
            if not 0.0 <= value < np.inf:
                raise InvalidTask(f"weights.{name}", f"{value}", "a finite number, at least 0")
            object.__setattr__(self, name, value)
        if self.time == self.torque == 0.0:
            raise InvalidTask("weights", "0 for time and torque", "a positive weight for either")


@dataclass(frozen=True, eq=False)
class MotionTask:
    """A motion of a serial arm from rest at one joint position to another.

    Arrays are copied and read-only.

    Attributes:
        arm: The arm, payload included.
        start: Joint angles at the start, of shape (n_joints,) [rad].
        goal: Joint angles at the end, of shape (n_joints,) [rad].
        torque_limits: Largest torques in either direction, of shape (n_joints,) [N m].
        velocity_limits: Largest speeds in either direction, of shape (n_joints,) [rad/s]; inf where
            there is none.
        position_lower: Smallest joint angles, of shape (n_joints,) [rad]; may be -inf.
        position_upper: Largest joint angles, of shape (n_joints,) [rad]; may be inf.
        weights: What counts as good.
        segments: Number n of segments of a trajectory on the grid.
        margin_levels: How many grid levels a joint may go beyond start and goal.
    """

    arm: SerialArm
    start: Array
    goal: Array
    torque_limits: Array
    velocity_limits: Array
    position_lower: Array
    position_upper: Array
    weights: ObjectiveWeights = ObjectiveWeights()
    segments: int = 16
    margin_levels: int = 0

    def __post_init__(self) -> None:
        for name in _PER_JOINT:
            checked = task_checks.column(name, getattr(self, name), self.arm)
            object.__setattr__(self, name, checked)
        lower, upper = self.position_lower, self.position_upper
        task_checks.check_limits(self.torque_limits, self.velocity_limits, lower, upper)
        task_checks.check_ends(self.start, self.goal, lower, upper)
        task_checks.check_strength(self.arm, "start", self.start, self.torque_limits)
        task_checks.check_strength(self.arm, "goal", self.goal, self.torque_limits)
        task_checks.whole_number("segments", self.segments, 2, MOST_SEGMENTS)
        task_checks.whole_number("margin_levels", self.margin_levels, 0, MOST_MARGIN_LEVELS)

    @classmethod
    def for_arm(
        cls,
        arm: SerialArm,
        start: ArrayLike,
        goal: ArrayLike,
        *,
        torque_limits: ArrayLike | None = None,
        velocity_limits: ArrayLike | None = None,
        position_lower: ArrayLike | None = None,
        position_upper: ArrayLike | None = None,
        weights: ObjectiveWeights = ObjectiveWeights(),
        segments: int = 16,
        margin_levels: int = 0,
    ) -> Self:
        """Return a task from any sequences of numbers, with the arm's own limits where none is given.

        The arguments are the attributes.

        Raises:
            InvalidTask: If they make no task.
        """
        return cls(
            arm,
            cast(Array, start),  # made an array and checked on construction, as are all others
            cast(Array, goal),
            arm.torque_limits if torque_limits is None else cast(Array, torque_limits),
            arm.velocity_limits if velocity_limits is None else cast(Array, velocity_limits),
            arm.position_lower if position_lower is None else cast(Array, position_lower),
            arm.position_upper if position_upper is None else cast(Array, position_upper),
            weights,
            segments,
            margin_levels,
        )

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return self.arm.n_joints

    def parameters(self) -> dict[str, object]:
        """Return the task as plain values, for the wire and for run files."""
        columns: dict[str, object] = {name: getattr(self, name).tolist() for name in _PER_JOINT}
        return {
            "arm": self.arm.parameters(),
            **columns,
            "weights": msgspec.to_builtins(self.weights),
            "segments": self.segments,
            "margin_levels": self.margin_levels,
        }

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
            raise InvalidTask("task", str(error), "what MotionTask.parameters returned") from error
        return cls(
            arm,
            np.array(read.start),
            np.array(read.goal),
            np.array(read.torque_limits),
            np.array(read.velocity_limits),
            np.array(read.position_lower),
            np.array(read.position_upper),
            read.weights,
            read.segments,
            read.margin_levels,
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MotionTask) and self.parameters() == other.parameters()

    def __hash__(self) -> int:
        return hash((self.arm, self.start.tobytes(), self.goal.tobytes(), self.weights))


_PER_JOINT = (
    "start",
    "goal",
    "torque_limits",
    "velocity_limits",
    "position_lower",
    "position_upper",
)


class _TaskParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    arm: dict[str, object]
    start: list[float]
    goal: list[float]
    torque_limits: list[float]
    velocity_limits: list[float]
    position_lower: list[float]
    position_upper: list[float]
    weights: ObjectiveWeights
    segments: int
    margin_levels: int
