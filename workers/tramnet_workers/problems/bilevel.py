"""Link lengths with exact inner poses: what a design is worth, a polish, and the honest reference.

The best pose of given links at a point can be found exactly (``kernels.poses``), so only the links, and
the base if it is free, are left to search: three to five variables, however many task points there
are. With CMA-ES (package ``cma``) on the outside this beats the multi-population genetic algorithm, and
the comparison says so. It leaves out JAC and TC, and needs a planar arm of three revolute joints.

Inner links at least as long as outer ones (HC) is a matter of variables: the lengths are sums of
increments that are not negative, from the last link inwards.
"""

from dataclasses import dataclass
from typing import NamedTuple

import cma
import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidTask
from tramnet_workers.kernels.poses import best_poses
from tramnet_workers.problems.design_task import DesignTask

Floats = NDArray[np.float64]

_FINE = (360, 40)  # samples and steps of the inner search where the result counts
_COARSE = (36, 16)  # and where it is repeated a thousand times
_SHORTEST = 0.01  # [m]
_FIRST_STEP, _LAST_STEP = 0.05, 1e-5  # of the polish [m]


class Worth(NamedTuple):
    """What an arm is worth at task points.

    Attributes:
        dexterity: Largest DM at each point, of shape (t,); 0 where it does not reach.
        joints: Joint angles there, of shape (t, 3) [rad].
        shortfall: By how much it misses the points, in the mean [m].
    """

    dexterity: Floats
    joints: Floats
    shortfall: float

    @property
    def mean(self) -> float:
        """Mean dexterity."""
        return float(self.dexterity.mean())


@dataclass(frozen=True)
class Search:
    """What a search over link lengths found.

    Attributes:
        lengths: Link lengths [m].
        base: Base position [m].
        dexterity: Mean of the largest DM at the task points.
        evaluations: Evaluations of one arm at one task point.
    """

    lengths: tuple[float, ...]
    base: tuple[float, float]
    dexterity: float
    evaluations: int


def worth(task: DesignTask, lengths: Floats, base: Floats, inner: tuple[int, int] = _FINE) -> Worth:
    """Return what an arm is worth at the task points.

    Args:
        task: The task.
        lengths: Link lengths, of shape (3,) [m].
        base: Base position, of shape (2,) [m].
        inner: Samples and steps of the search for poses.

    Raises:
        InvalidTask: The arm has not three revolute joints alone.
    """
    if task.n_links != 3 or task.strokes:
        found = f"{task.n_links} links and {len(task.strokes)} strokes"
        raise InvalidTask("lower", found, "three links and no stroke, for exact poses")
    points = task.points - base
    joints, dexterity = np.empty((len(points), 3)), np.empty(len(points))
    lower, upper = np.array(task.lower), np.array(task.upper)
    best_poses(np.asarray(lengths), points, lower, upper, *inner, joints, dexterity)
    return Worth(np.maximum(dexterity, 0.0), joints, _shortfall(lengths, points))


def polish(task: DesignTask, lengths: Floats, base: Floats) -> Search:
    """Improve link lengths by a compass search (Kolda, Lewis & Torczon 2003) with exact poses.

    Args:
        task: The task.
        lengths: Link lengths to begin with, of shape (3,) [m].
        base: Base position, of shape (2,) [m].
    """
    objective = _Objective(task, base, free_base=False)
    x = objective.variables(lengths, base)
    best, step = objective(x), _FIRST_STEP
    while step > _LAST_STEP:
        trials = [x + step * direction for direction in _directions(len(x))]
        values = [objective(trial) for trial in trials]
        i = int(np.argmin(values))
        if values[i] < best:
            x, best = trials[i], values[i]
        else:
            step *= 0.5
    return objective.result(x)


def run_bilevel(task: DesignTask, budget: int, seed: int) -> Search:
    """Search link lengths, and the base if it is free, by CMA-ES.

    Args:
        task: The task.
        budget: Evaluations of one arm at one task point, at most.
        seed: Seed of the run.
    """
    base = np.array(task.base.position)
    if task.base.free:
        base = 0.5 * (np.array(task.base.lower) + np.array(task.base.upper))
    objective = _Objective(task, base, free_base=task.base.free)
    reach = np.sqrt(((task.points - base) ** 2).sum(axis=1)).max()
    x = objective.variables(np.full(3, 1.2 * reach / 3.0), base)
    rng = np.random.default_rng(seed)
    strategy = cma.CMAEvolutionStrategy(
        x,
        0.3 * reach / 3.0,
        {
            # Its own generator, so that nobody's random numbers depend on another's.
            "randn": lambda *shape: rng.standard_normal(shape),
            "seed": np.nan,
            "verbose": -9,
            "tolx": 1e-7,
            "tolfun": 1e-9,
        },
    )
    best, found = np.inf, x
    while not strategy.stop() and objective.evaluations < budget:
        candidates = strategy.ask()
        values = [objective(candidate) for candidate in candidates]
        strategy.tell(candidates, values)
        i = int(np.argmin(values))
        if values[i] < best:
            best, found = values[i], candidates[i]
    return objective.result(np.asarray(found))


class _Objective:
    """Minus the mean dexterity, plus what is missing where the arm does not reach."""

    def __init__(self, task: DesignTask, base: Floats, *, free_base: bool) -> None:
        self._task, self._base, self._free_base = task, base, free_base
        self._ordered = task.weights.get("hc", 1.0) > 0.0
        self.evaluations = 0

    def variables(self, lengths: Floats, base: Floats) -> Floats:
        """Return the variables that stand for an arm."""
        x = np.asarray(lengths, dtype=np.float64)[::-1]
        if self._ordered:
            x = np.concatenate([x[:1], np.diff(x)])
        return np.concatenate([x, base]) if self._free_base else x

    def arm(self, x: Floats) -> tuple[Floats, Floats]:
        """Return link lengths and base; what is negative counts as nothing."""
        increments = np.maximum(x[:3], [_SHORTEST, 0.0, 0.0] if self._ordered else _SHORTEST)
        lengths = np.cumsum(increments) if self._ordered else increments
        if not self._free_base:
            return lengths[::-1], self._base
        return lengths[::-1], np.clip(x[3:], self._task.base.lower, self._task.base.upper)

    def __call__(self, x: Floats) -> float:
        """Return the value, to be minimised."""
        lengths, base = self.arm(x)
        found = worth(self._task, lengths, base, _COARSE)
        self.evaluations += 2 * (sum(_COARSE) + 2) * len(found.dexterity)
        outside = np.maximum(-x[:3], 0.0).sum()
        return float(found.shortfall + outside - found.mean)

    def result(self, x: Floats) -> Search:
        """Return what is found at x."""
        lengths, base = self.arm(x)
        return Search(
            tuple(map(float, lengths)),
            (float(base[0]), float(base[1])),
            worth(self._task, lengths, base).mean,
            self.evaluations,
        )


def _shortfall(lengths: Floats, points: Floats) -> float:
    distances = np.sqrt((points**2).sum(axis=1))
    total, longest = lengths.sum(), lengths.max()
    missing = np.maximum(distances - total, 0.0)
    missing += np.maximum(2.0 * longest - total - distances, 0.0)
    return float(missing.mean())


def _directions(n: int) -> Floats:
    """Return the axes and their pairwise diagonals, both ways, of shape (k, n)."""
    axes = np.eye(n)
    diagonals = [axes[i] + sign * axes[j] for i in range(n) for j in range(i) for sign in (1, -1)]
    one_way = np.concatenate([axes, np.array(diagonals).reshape(-1, n)])
    return np.concatenate([one_way, -one_way])
