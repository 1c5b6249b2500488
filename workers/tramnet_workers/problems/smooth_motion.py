"""The better planner's problem: smooth paths, each timed optimally, as chromosomes of real numbers.

Our own, not Wang & Zalzala's. A chromosome holds the amplitudes of a path's modes, joint by joint,
as fractions of a range that shrinks with the mode; genes lie in [-1, 1], and all zeros make the
straight line. How fast to go along the path is no matter of evolution: ``kernels.topp`` knows.

Only if torque costs something, two more genes set the pace, since then the fastest motion is not the
best one. One caps the path speed: the arm coasts between accelerating and braking, as the motions
of least fuel do. The other stretches time, so that all torques but gravity's fall.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, NamedTuple, Self

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.kernels.path_objectives import PathTask, path_objectives
from tramnet_workers.kernels.smooth_paths import path_modes
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.path_limits import path_within_limits
from tramnet_workers.problems.path_timing import grid, stops, time_path
from tramnet_workers.problems.plan import PathPlan
from tramnet_workers.problems.straight_line import straight_path

Array = NDArray[np.float64]

NAME = "puma560-smooth"
MODES = 6
INTERVALS = 48

_REACH = 4.0  # range of the first mode's amplitude, in widest joint motions of the straight line
_PACE_GENES = 2
_TOP_CAP = 1.5  # cap where it begins to matter, in top speeds of the straight line
_LEAST_CAP = 0.02
_MOST_STRETCH = 5.0


class Decoded(NamedTuple):
    """What k chromosomes say.

    Attributes:
        amplitudes: Amplitudes of the modes, of shape (k, n_joints, n_modes) [rad].
        caps: Largest path speeds, of shape (k,) [1/s].
        stretches: Factors by which the motions are slowed down, of shape (k,).
    """

    amplitudes: Array
    caps: Array
    stretches: Array


@dataclass(frozen=True, eq=False)
class SmoothMotion:
    """Minimise a task's objective over smooth paths.

    Attributes:
        task: The task.
        n_modes: Number of modes of each joint.
        intervals: Intervals of the grid on which chromosomes are judged.
    """

    task: MotionTask
    n_modes: int = MODES
    intervals: int = INTERVALS

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Build the problem from plain values.

        Raises:
            InvalidParameters: One is unknown, missing or out of range.
            InvalidTask: The task is wrong.
        """
        try:
            read = msgspec.convert(dict(parameters), _Parameters, strict=True)
        except msgspec.ValidationError as error:
            raise InvalidParameters(NAME, str(error)) from error
        return cls(MotionTask.from_parameters(read.task), read.n_modes, read.intervals)

    def parameters(self) -> dict[str, object]:
        """Return the problem as plain values."""
        return {
            "task": self.task.parameters(),
            "n_modes": self.n_modes,
            "intervals": self.intervals,
        }

    @property
    def name(self) -> str:
        """Name in the registry."""
        return NAME

    @property
    def genome_shape(self) -> tuple[int, ...]:
        """Shape of one chromosome."""
        return (self._n_shape_genes + (_PACE_GENES if self._is_paced else 0),)

    @property
    def genome_dtype(self) -> np.dtype[np.generic]:
        """Element type of a chromosome."""
        return np.dtype(np.float64)

    @property
    def lower(self) -> Array:
        """Smallest genes, of the shape of a chromosome."""
        return np.full(self.genome_shape, -1.0)

    @property
    def upper(self) -> Array:
        """Largest genes, of the shape of a chromosome."""
        return np.full(self.genome_shape, 1.0)

    def evaluate(self, genomes: NDArray[np.generic]) -> Array:
        """Return the objectives of chromosomes of shape (k, *genome_shape), of shape (k,)."""
        return path_objectives(self._path_task, *self.decode(genomes))

    def decode(self, genomes: NDArray[np.generic]) -> Decoded:
        """Return what chromosomes of shape (k, *genome_shape) say."""
        genes = np.clip(genomes.astype(np.float64, copy=False), -1.0, 1.0)
        shape = (len(genes), self.task.n_joints, self.n_modes)
        amplitudes = genes[:, : self._n_shape_genes].reshape(shape) * self._ranges
        if not self._is_paced:
            return Decoded(amplitudes, np.full(len(genes), np.inf), np.ones(len(genes)))
        coasting, patience = genes[:, -2], genes[:, -1]
        caps = _TOP_CAP * self._line_speed * np.maximum(1.0 + coasting, _LEAST_CAP)
        stretches = 1.0 + (_MOST_STRETCH - 1.0) * np.maximum(patience, 0.0)
        return Decoded(amplitudes, np.where(coasting < 0.0, caps, np.inf), stretches)

    def plan(self, genome: NDArray[np.generic]) -> PathPlan | None:
        """Return a chromosome's motion, timed on a fine grid and ready to be carried out.

        Returns:
            The plan, or None if no motion can follow the path.
        """
        decoded = self.decode(genome[None])
        path = path_within_limits(self.task, decoded.amplitudes[0])
        plan = time_path(self.task, path, float(decoded.caps[0]))
        return plan.stretched(float(decoded.stretches[0])) if plan is not None else None

    @property
    def _n_shape_genes(self) -> int:
        return self.task.n_joints * self.n_modes

    @property
    def _is_paced(self) -> bool:
        return self.task.weights.torque > 0.0

    @cached_property
    def _ranges(self) -> Array:
        """Ranges of the amplitudes, of shape (n_modes,): a joint that need not move may, too."""
        widest = float(np.abs(self.task.goal - self.task.start).max())
        order = np.arange(1.0, self.n_modes + 1.0)
        ranges: Array = _REACH * widest / (order * np.sqrt(order))
        return ranges

    @cached_property
    def _line_speed(self) -> float:
        """Top path speed on the straight line [1/s]; inf where the arm cannot follow it."""
        line = time_path(self.task, straight_path(self.task), intervals=self.intervals)
        return float(line.speed.max()) if line is not None else np.inf

    @cached_property
    def _path_task(self) -> PathTask:
        task, s = self.task, grid(self.intervals)
        return PathTask(
            arm=task.arm.table,
            gravity=task.arm.gravity,
            start=task.start,
            goal=task.goal,
            lower=task.position_lower,
            upper=task.position_upper,
            torque_limits=task.torque_limits,
            velocity_limits=task.velocity_limits,
            time_weight=task.weights.time,
            torque_weight=task.weights.torque,
            stops=stops(task),
            s=s,
            modes=path_modes(s, self.n_modes),
        )


class _Parameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    task: dict[str, object]
    n_modes: Annotated[int, Meta(ge=0, le=40)] = MODES
    intervals: Annotated[int, Meta(ge=4, le=10_000)] = INTERVALS
