"""What a spatial arm is to be designed for: the ``spatial`` variant of ``crank``.

Kim & Khosla (1992), sections 2 and 5: RC in place of inverse kinematics, HC among the links that are no
zero links. Link lengths are genes, the twists of the arm's template stay.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import NamedTuple, Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidTask
from tramnet_workers.kernels.design import Coupling
from tramnet_workers.kernels.spatial import SpatialModel, snap_spatial
from tramnet_workers.kernels.transforms import sincos
from tramnet_workers.mpga_settings import MpgaSettings
from tramnet_workers.problems.design_task import check_weights
from tramnet_workers.problems.spatial_design import SpatialDesign
from tramnet_workers.problems.stages import Stage, ring_neighbours
from tramnet_workers.problems.steps import CONSTRAINTS, TERM_NAMES, Step
from tramnet_workers.robots.revolute_chain import ChainRow, six_joint_template

Floats = NDArray[np.float64]
Triple = tuple[float, float, float]
Turn = tuple[Triple, Triple, Triple]

_UNTURNED: Turn = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _crank_points() -> tuple[Triple, ...]:
    """Return four points on an upright circle, in front of the base and beside it."""
    return ((0.55, 0.2, 0.2), (0.55, 0.0, 0.4), (0.55, -0.2, 0.2), (0.55, 0.0, 0.0))


@dataclass(frozen=True)
class SpatialTask:
    """A design task for a spatial arm.

    Attributes:
        points: Positions of the tip [m].
        orientations: Its axes in base coordinates, as columns of one matrix for each point; none if
            only positions matter.
        closed: Whether the last point's neighbour is the first.
        arm: Template of the arm; lengths marked as designed are found.
        lengths: Smallest and largest designed length [m].
        base_lower: Smallest base coordinates [m].
        base_upper: Largest ones, equal to the smallest where the base is given [m].
        weights: Weights of eq (4) by name that replace those of the settings.
        scale: Length that makes an angle comparable to a distance [m].
        bits: Bits of a gene.
    """

    points: tuple[Triple, ...] = field(default_factory=_crank_points)
    orientations: tuple[Turn, ...] = ()
    closed: bool = True
    arm: tuple[ChainRow, ...] = field(default_factory=six_joint_template)
    lengths: tuple[float, float] = (0.1, 0.8)
    base_lower: Triple = (-0.2, -0.2, -0.2)
    base_upper: Triple = (0.2, 0.2, 0.2)
    weights: Mapping[str, float] = field(default_factory=dict)
    scale: float = 0.3
    bits: int = 10

    def __post_init__(self) -> None:
        if not self.points:
            raise InvalidTask("points", "none", "one point at least")
        if self.orientations and len(self.orientations) != len(self.points):
            found = f"{len(self.orientations)} for {len(self.points)} points"
            raise InvalidTask("orientations", found, "none, or as many as points")
        for i, turn in enumerate(self.orientations):
            matrix = np.array(turn)
            if matrix.shape != (3, 3) or abs(matrix @ matrix.T - np.eye(3)).max() > 1e-6:
                raise InvalidTask(f"orientations[{i}]", f"{turn}", "an orthonormal 3 x 3 matrix")
        if not any(row.designed for row in self.arm):
            raise InvalidTask("arm", "no designed length", "one length to be designed at least")
        if not 0.0 <= self.lengths[0] < self.lengths[1]:
            raise InvalidTask("lengths", f"{self.lengths}", "0 <= smallest < largest length")
        for i in range(3):
            if not self.base_lower[i] <= self.base_upper[i]:
                expected = f"at most base_upper[{i}] = {self.base_upper[i]}"
                raise InvalidTask(f"base_lower[{i}]", f"{self.base_lower[i]}", expected)
        if not 0.0 < self.scale < np.inf:
            raise InvalidTask("scale", f"{self.scale}", "a finite length above 0 m")
        if not 5 <= self.bits <= 16:
            raise InvalidTask("bits", f"{self.bits}", "a whole number from 5 to 16")
        check_weights(self.weights)

    @property
    def designed(self) -> list[tuple[int, str]]:
        """Joint and name of each designed length, from the base on."""
        return [(i, row.designed) for i, row in enumerate(self.arm) if row.designed]

    @property
    def goals(self) -> Floats:
        """Task points for the kernels, of shape (t, 12)."""
        turns = self.orientations or (_UNTURNED,) * len(self.points)
        # Kernels keep axes as rows, people write them as columns.
        axes = np.array(turns).transpose(0, 2, 1).reshape(-1, 9)
        return np.concatenate([np.array(self.points), axes], axis=1)

    @property
    def model(self) -> SpatialModel:
        """The arm for the kernels."""
        twists = [sincos(row.alpha) for row in self.arm]
        rows = [(row.a, row.d, t.cosine, t.sine) for row, t in zip(self.arm, twists, strict=True)]
        return SpatialModel(
            rows=_exact_quarters(np.array(rows)),
            designed=np.array([(i, "ad".index(name)) for i, name in self.designed], np.int64),
            limits=np.array([[row.lower for row in self.arm], [row.upper for row in self.arm]]),
            order=6 if self.orientations else 3,
            scale=self.scale,
        )

    def parameters(self) -> dict[str, object]:
        """Return the task as plain values, for run files."""
        decoded: dict[str, object] = msgspec.json.decode(msgspec.json.encode(self))
        return decoded

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Rebuild a task from what ``parameters`` returned; what is left out has its default.

        Raises:
            InvalidTask: With the field, what was found and what was expected.
        """
        try:
            return msgspec.convert(parameters, cls)
        except msgspec.ValidationError as error:
            expected, _, place = f"{error}".replace("`", "").partition(" - at $.")
            raise InvalidTask(place or "task", "another value", expected) from error


def spatial_stage(task: SpatialTask, settings: MpgaSettings) -> Stage:
    """Return the search for lengths, base and angles at all task points."""
    n, t = len(task.arm), len(task.points)
    shortest, longest = task.lengths
    low = [row.lower for row in task.arm], task.base_lower, [shortest] * len(task.designed)
    high = [row.upper for row in task.arm], task.base_upper, [longest] * len(task.designed)
    rule = settings.placement
    weights = {**asdict(settings.weights), "rc": rule.rc, "lc": rule.connecting,
               "bpc": rule.connecting, **task.weights}  # fmt: skip
    active = CONSTRAINTS[Step.DESIGN] | {"rc"}
    problem = SpatialDesign(
        points=task.goals,
        lower=np.tile(np.concatenate(low), (t, 1)),
        upper=np.tile(np.concatenate(high), (t, 1)),
        coupling=Coupling(
            n_links=len(task.designed),
            n_base=3,
            n_angles=n,
            n_populations=t,
            neighbours=ring_neighbours(t, task.closed),
            weights=np.array([weights[name] if name in active else 0.0 for name in TERM_NAMES]),
            reach=-1.0,
        ),
        ramp=rule.ramp,
        generations=settings.genetic.generations,
        fixed=np.zeros((0, len(task.designed) + 3 + n)),
        model=task.model,
    )
    genetic = replace(settings.genetic, bits=task.bits)
    return Stage(Step.DESIGN, problem, genetic, np.arange(float(t)))


class SpatialFound(NamedTuple):
    """A spatial arm at its task points.

    Attributes:
        lengths: Designed lengths, means of the populations' best ones, of shape (n_lengths,) [m].
        base: Base position, likewise, of shape (3,) [m].
        angles: Joint angles, of shape (t, n) [rad].
        terms: All terms of eq (4) at the points, of shape (t, 8).
        spread: Largest difference between populations in one length [m].
    """

    lengths: Floats
    base: Floats
    angles: Floats
    terms: Floats
    spread: float


def find_spatial(task: SpatialTask, settings: MpgaSettings, traits: Floats) -> SpatialFound:
    """Return the arm that populations agree on, its poses moved onto their points if so set.

    Args:
        task: The task.
        settings: Of the method.
        traits: Traits of the populations' best individuals, of shape (t, n_traits).
    """
    t, n_lengths, stage = len(traits), len(task.designed), spatial_stage(task, settings)
    common = traits[:, : n_lengths + 3].mean(axis=0)
    lengths, base = common[:n_lengths], common[n_lengths:]
    angles = traits[:, n_lengths + 3 :].copy()
    bases = np.tile(base, (t, 1))
    if settings.snap:
        snap_spatial(task.model, task.goals, lengths, bases, angles)
    genes = np.concatenate([angles, bases, np.tile(lengths, (t, 1))], axis=1)[:, :, None].copy()
    arms, terms = np.empty((t, traits.shape[1], 1)), np.empty((t, 8, 1))
    stage.problem.evaluate(0, genes, arms, terms)
    stage.problem.rate(0, 0, arms[:, :, 0].copy(), arms, terms, np.empty((t, 1)))
    spread = float(np.ptp(traits[:, :n_lengths], axis=0).max())
    return SpatialFound(lengths, base, arms[:, n_lengths + 3 :, 0], terms[:, :, 0], spread)


def _exact_quarters(rows: Floats) -> Floats:
    """Return the rows with the cosines and sines of quarter turns made exact."""
    near = abs(rows[:, 2:] - np.round(rows[:, 2:])) < 1e-12
    rows[:, 2:] = np.where(near, np.round(rows[:, 2:]), rows[:, 2:])
    return rows
