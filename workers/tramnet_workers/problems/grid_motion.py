"""Motions on a grid of joint angles: the problem of Wang & Zalzala (1995), sections 4.1, 4.2 and 4.4.

A chromosome holds the levels of the n - 1 inner nodes of a trajectory, joint by joint. A joint that moves spans
its way from start to goal with n levels, so that one level a segment is the straight line. A joint that hardly
moves, or not at all, has no way to span: its levels lie about its straight line, as far apart as the others' are
on the average, and it may go out and come back.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal, NamedTuple, Self

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.kernels import segment, switching
from tramnet_workers.kernels.grid import LevelGrid
from tramnet_workers.kernels.motion import Rules
from tramnet_workers.kernels.switching import CONTINUOUS, LITERAL, Decoder
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.plan import ParabolicPlan
from tramnet_workers.problems.recall import Recall

Array = NDArray[np.float64]
Levels = NDArray[np.int16]

NAME = "puma560-grid"

_SWITCHES = {"literal": LITERAL, "continuous": CONTINUOUS}
_POSTURES = {"start": segment.START, "middle": segment.MIDDLE, "exact": segment.EXACT}
_FARTHEST = 2**14  # levels beyond which no trajectory of 1,000 segments comes
_REMEMBERED = 1000  # some generations
_HARDLY = 0.02  # a joint that moves by less than this part of the farthest one hardly moves


class DecodingSettings(Struct, frozen=True, forbid_unknown_fields=True):
    """How trajectories are decoded.

    Attributes:
        switch: When the motion begins to brake: ``literal`` after n // 2 segments, ``continuous`` where that gives
            the best objective. The paper says only that intervals begin at 0.01 in the first part of the motion and
            at 0.5 in the last, which cancels from eq 5.
        posture: Posture of a segment at which torques are bounded: its ``start``, its ``middle``, or ``exact`` for
            both ends and the middle. The paper does not say.
        scan_points: Switches per segment that the search for the continuous switch scans.
        refinements: Steps of its golden section.
        slowest: Least 1 / h that braking may choose [1/s].
    """

    switch: Literal["literal", "continuous"] = "literal"
    posture: Literal["start", "middle", "exact"] = "start"
    scan_points: Annotated[int, Meta(ge=1, le=100)] = 2
    refinements: Annotated[int, Meta(ge=0, le=100)] = 30
    slowest: Annotated[float, Meta(gt=0.0)] = 0.05


class Decoded(NamedTuple):
    """What a chromosome says.

    Attributes:
        plan: The motion.
        torques: Torques of each segment at its first bounded posture, of shape (n, n_joints) [N m].
        switch: Where it begins to brake, in [0, n].
    """

    plan: ParabolicPlan
    torques: Array
    switch: float


@dataclass(frozen=True, eq=False)
class GridMotion:
    """Minimise a task's objective over trajectories on a grid.

    Attributes:
        task: The task.
        settings: How trajectories are decoded.
    """

    task: MotionTask
    settings: DecodingSettings = DecodingSettings()  # noqa: RUF009  frozen

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
        return cls(MotionTask.from_parameters(read.task), read.settings)

    def parameters(self) -> dict[str, object]:
        """Return the problem as plain values."""
        return {
            "task": self.task.parameters(),
            "settings": msgspec.to_builtins(self.settings),
        }

    @property
    def name(self) -> str:
        """Name in the registry."""
        return NAME

    @property
    def genome_shape(self) -> tuple[int, ...]:
        """Shape of one chromosome: (n_joints, n - 1)."""
        return (self.task.n_joints, self.task.segments - 1)

    @property
    def genome_dtype(self) -> np.dtype[np.generic]:
        """Element type of a chromosome."""
        return np.dtype(np.int16)

    @cached_property
    def grid(self) -> LevelGrid:
        """Levels that trajectories may take, within the position limits and the margin."""
        task, n = self.task, self.task.segments
        start, _, line, step = self._placement
        favoured = self._moves.astype(np.int16)
        goal = n * favoured
        straight = np.outer(favoured, np.arange(1, n))
        zero = start[:, None] + line[:, None] * np.arange(1, n)
        ends = [
            np.clip((limit[:, None] - zero) / step[:, None], -_FARTHEST, _FARTHEST)
            for limit in (task.position_lower, task.position_upper)
        ]
        # A joint that goes down has its limits the other way round.
        least = np.minimum(np.ceil(np.minimum(*ends)), straight)
        most = np.maximum(np.floor(np.maximum(*ends)), straight)
        # What hardly moves may still go as far as what moves: n levels in all.
        margin = np.where(self._moves, task.margin_levels, n // 2 + task.margin_levels)
        return LevelGrid(
            start=np.zeros(task.n_joints, np.int16),
            goal=goal,
            favoured=favoured,
            lower=np.maximum(least, -margin[:, None]).astype(np.int16),
            upper=np.minimum(most, (goal + margin)[:, None]).astype(np.int16),
        )

    def evaluate(self, genomes: NDArray[np.generic]) -> Array:
        """Return the objectives of chromosomes of shape (k, *genome_shape), of shape (k,)."""
        levels = np.ascontiguousarray(genomes, dtype=np.int16)
        if self.settings.switch == "continuous":
            return self._recall.evaluate(levels, self._evaluate)
        return self._evaluate(levels)

    def _evaluate(self, levels: NDArray[np.generic]) -> Array:
        objectives = np.empty(len(levels))
        switching.evaluate(self.decoder, levels.astype(np.int16, copy=False), objectives)
        return objectives

    def decode(self, genome: NDArray[np.generic]) -> Decoded | None:
        """Return the motion of a chromosome of shape ``genome_shape``, or None if it has none."""
        task, n = self.task, self.task.segments
        x, torques = np.empty(n), np.empty((n, task.n_joints))
        levels = np.ascontiguousarray(genome, dtype=np.int16)
        switch = switching.decode(self.decoder, levels[None], x, torques)
        if np.isnan(switch):
            return None
        start, goal, line, step = self._placement
        inner = start + line * np.arange(1, n)[:, None] + step * levels.T
        q = np.vstack([start, inner, goal])
        qd = np.zeros_like(q)
        for j, moved in enumerate(np.diff(q, axis=0)):
            qd[j + 1] = 2.0 * moved * x[j] - qd[j]  # eqs 3, 4 and step 7
        qdd = np.diff(qd, axis=0) * x[:, None]
        return Decoded(ParabolicPlan(1.0 / x, q, qd, qdd), torques, float(switch))

    def plan(self, genome: NDArray[np.generic]) -> ParabolicPlan | None:
        """Return the plan of a chromosome, or None if it has none."""
        decoded = self.decode(genome)
        return None if decoded is None else decoded.plan

    @cached_property
    def _recall(self) -> Recall:
        return Recall(_REMEMBERED)

    @cached_property
    def _moves(self) -> NDArray[np.bool_]:
        """Which joints have a way to span, of shape (n_joints,)."""
        way = np.abs(self.task.goal - self.task.start)
        return np.asarray(way >= _HARDLY * way.max())

    @cached_property
    def _placement(self) -> Array:
        """Where the levels are, of shape (4, n_joints); see ``kernels.motion.lay_out``."""
        task = self.task
        way = (task.goal - task.start) / task.segments
        line = np.where(self._moves, 0.0, way)
        step = np.where(self._moves, way, np.abs(way[self._moves]).mean())
        return np.stack([task.start, task.goal, line, step])

    @cached_property
    def decoder(self) -> Decoder:
        """What kernels need to decode chromosomes."""
        task, settings, weights = self.task, self.settings, self.task.weights
        limits = np.stack(
            [task.torque_limits, task.velocity_limits, task.position_lower, task.position_upper]
        )
        return Decoder(
            task.arm.table,
            task.arm.gravity,
            limits,
            self._placement,
            Rules(
                _POSTURES[settings.posture],
                _SWITCHES[settings.switch],
                settings.scan_points,
                settings.refinements,
                settings.slowest,
                weights.time,
                weights.torque,
                weights.end_velocity,
            ),
        )


class _Parameters(Struct, frozen=True, forbid_unknown_fields=True):
    task: dict[str, object]
    settings: DecodingSettings = DecodingSettings()
