"""Link lengths with exact inner poses: what a design is worth, a polish, and the honest reference.

The best pose of given links at a point can be found exactly (``kernels.poses``), so only the links, and
the base if it is free, are left to search: three to five variables, however many task points there
are. With CMA-ES (package ``cma``) on the outside this beats the multi-population genetic algorithm, and
the comparison says so. It leaves out JAC and TC, and needs a planar arm of three revolute joints.

Inner links at least as long as outer ones (HC) is a matter of variables: the lengths are sums of
increments that are not negative, from the last link inwards.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Self

import cma
import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.kernels.poses import best_poses
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.task_fitness import require_exact_poses, require_links_to_find

Floats = NDArray[np.float64]

NAME = "crank-links"

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
        """Mean dexterity, by an exact sum."""
        return math.fsum(self.dexterity.tolist()) / len(self.dexterity)


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
    require_exact_poses(task)
    points = task.points - base
    joints, dexterity = np.empty((len(points), 3)), np.empty(len(points))
    lower, upper = np.array(task.lower), np.array(task.upper)
    best_poses(np.asarray(lengths), points, lower, upper, *inner, joints, dexterity)
    return Worth(np.maximum(dexterity, 0.0), joints, _shortfall(lengths, points))


@dataclass(frozen=True, eq=False)
class LinkDesign:
    """Link lengths, and the base if it is free, as a problem: three to five variables and exact inner poses.

    The objective is minus the mean dexterity, plus what is missing where the arm does not reach.

    Attributes:
        task: The task.
        given_base: Where the arm stands if the base is not free, of shape (2,) [m].
    """

    task: DesignTask
    given_base: Floats

    @classmethod
    def of(cls, task: DesignTask) -> Self:
        """Return the problem of a task.

        Raises:
            InvalidTask: No three links are to be designed for a base that stands still.
        """
        require_links_to_find(task)
        return cls(task, np.array(task.base.position, dtype=np.float64))

    @property
    def name(self) -> str:
        """Name in the registry."""
        return NAME

    @property
    def genome_shape(self) -> tuple[int, ...]:
        """Shape of a vector of variables."""
        return (5,) if self.task.base.free else (3,)

    @property
    def genome_dtype(self) -> np.dtype[np.generic]:
        """Element type of a variable."""
        return np.dtype(np.float64)

    @property
    def evaluations_each(self) -> int:
        """Evaluations of one arm at one task point that a vector takes."""
        return 2 * (sum(_COARSE) + 2) * len(self.task.stations)

    @cached_property
    def start(self) -> Floats:
        """Variables to begin with: links that reach a fifth beyond the farthest point."""
        base = self.given_base
        if self.task.base.free:
            base = 0.5 * (np.array(self.task.base.lower) + np.array(self.task.base.upper))
        return self.variables(np.full(3, 1.2 * self._reach(base) / 3.0), base)

    @property
    def first_step(self) -> float:
        """Standard deviation to begin with [m]."""
        return 0.3 * self._reach(self.arm(self.start)[1]) / 3.0

    def evaluate(self, genomes: NDArray[np.generic]) -> Floats:
        """Return the objectives of vectors of shape (n, variables), of shape (n,)."""
        vectors = genomes.astype(np.float64, copy=False)
        return np.array([self.objective(x) for x in vectors], dtype=np.float64)

    def objective(self, x: Floats) -> float:
        """Return the objective of one vector."""
        lengths, base = self.arm(x)
        found = worth(self.task, lengths, base, _COARSE)
        outside = math.fsum(np.maximum(-x[:3], 0.0).tolist())
        return found.shortfall + outside - found.mean

    def variables(self, lengths: Floats, base: Floats) -> Floats:
        """Return the variables that stand for an arm."""
        x = np.asarray(lengths, dtype=np.float64)[::-1]
        if self._ordered:
            x = np.concatenate([x[:1], np.diff(x)])
        return np.concatenate([x, base]) if self.task.base.free else x

    def arm(self, x: Floats) -> tuple[Floats, Floats]:
        """Return link lengths and base; what is negative counts as nothing."""
        increments = np.maximum(x[:3], [_SHORTEST, 0.0, 0.0] if self._ordered else _SHORTEST)
        lengths = np.cumsum(increments) if self._ordered else increments
        if not self.task.base.free:
            return lengths[::-1], self.given_base
        return lengths[::-1], np.clip(x[3:], self.task.base.lower, self.task.base.upper)

    def found(self, x: Floats, evaluations: int) -> Search:
        """Return what is found at x."""
        lengths, base = self.arm(x)
        return Search(
            tuple(map(float, lengths)),
            (float(base[0]), float(base[1])),
            worth(self.task, lengths, base).mean,
            evaluations,
        )

    def parameters(self) -> dict[str, object]:
        """Return plain values, for the wire."""
        return {"task": self.task.parameters()}

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Rebuild a problem from what ``parameters`` returned.

        Raises:
            InvalidParameters: They are no such values.
            InvalidTask: The task is wrong, or none for this problem.
        """
        match parameters:
            case {"task": Mapping() as task} if len(parameters) == 1:
                return cls.of(DesignTask.from_parameters(task))
        raise InvalidParameters(NAME, f"found {sorted(parameters)}, expected a task")

    @property
    def _ordered(self) -> bool:
        return self.task.weights.get("hc", 1.0) > 0.0

    def _reach(self, base: Floats) -> float:
        return float(np.sqrt(((self.task.points - base) ** 2).sum(axis=1)).max())


def polish(task: DesignTask, lengths: Floats, base: Floats) -> Search:
    """Improve link lengths by a compass search (Kolda, Lewis & Torczon 2003) with exact poses.

    Args:
        task: The task.
        lengths: Link lengths to begin with, of shape (3,) [m].
        base: Base position, of shape (2,) [m].
    """
    fixed = replace(task, base=replace(task.base, free=False))
    problem, evaluations = LinkDesign(fixed, np.asarray(base, dtype=np.float64)), 1
    x = problem.variables(lengths, base)
    best, step = problem.objective(x), _FIRST_STEP
    while step > _LAST_STEP:
        trials = [x + step * direction for direction in _directions(len(x))]
        values = [problem.objective(trial) for trial in trials]
        evaluations += len(trials)
        i = int(np.argmin(values))
        if values[i] < best:
            x, best = trials[i], values[i]
        else:
            step *= 0.5
    return problem.found(x, evaluations * problem.evaluations_each)


def strategy_for(problem: LinkDesign, seed: int) -> cma.CMAEvolutionStrategy:
    """Return CMA-ES (Hansen) about to search the variables of a problem.

    Args:
        problem: The problem.
        seed: Seed of its random numbers.
    """
    rng = np.random.default_rng(seed)
    options = {
        # Its own generator, so that nobody's random numbers depend on another's.
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": np.nan,
        "verbose": -9,
        "tolx": 1e-7,
        "tolfun": 1e-9,
    }
    return cma.CMAEvolutionStrategy(problem.start, problem.first_step, options)


def run_bilevel(task: DesignTask, budget: int, seed: int) -> Search:
    """Search link lengths, and the base if it is free, by CMA-ES.

    Args:
        task: The task.
        budget: Evaluations of one arm at one task point, at most.
        seed: Seed of the run.
    """
    problem, evaluations = LinkDesign.of(task), 0
    strategy = strategy_for(problem, seed)
    best, found = np.inf, problem.start
    while not strategy.stop() and evaluations < budget:
        candidates = strategy.ask()
        values = problem.evaluate(np.array(candidates)).tolist()
        evaluations += len(values) * problem.evaluations_each
        strategy.tell(candidates, values)
        i = int(np.argmin(values))
        if values[i] < best:
            best, found = values[i], candidates[i]
    return problem.found(np.asarray(found), evaluations)


def _shortfall(lengths: Floats, points: Floats) -> float:
    distances = np.sqrt((points**2).sum(axis=1))
    total, longest = lengths.sum(), lengths.max()
    missing = np.maximum(distances - total, 0.0)
    missing += np.maximum(2.0 * longest - total - distances, 0.0)
    return math.fsum(missing.tolist()) / len(missing)


def _directions(n: int) -> Floats:
    """Return the axes and their pairwise diagonals, both ways, of shape (k, n)."""
    axes = np.eye(n)
    diagonals = [axes[i] + sign * axes[j] for i in range(n) for j in range(i) for sign in (1, -1)]
    one_way = np.concatenate([axes, np.array(diagonals).reshape(-1, n)])
    return np.concatenate([one_way, -one_way])
