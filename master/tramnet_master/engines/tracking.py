"""Tracking: points one after the other, each from the posture that the one before left.

A *scene* is one path to follow; scenes are independent of each other and may run at once. In a scene the next work
is a run of consecutive points, long enough to take long against a message. With several sub-populations it is one
point for each of them; the best posture of all is where all go on from, and among equal ones that of the lowest
sub-population. How long the runs are depends on the clock, what comes out of them does not.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tramnet_master.engines.engine import Best, GenerationRow, State
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Kind, Outcome, Track, Tracked, Work, WorkId

CHUNK_SECONDS = 0.05
"""Time that a run of points should take [s]."""

GROWTH = 32
"""How much longer a run of points may be than the one its cost was measured with."""

Floats = NDArray[np.float64]


@dataclass
class _Scene:
    """One path on its way.

    Attributes:
        path: Postures, of shape (steps + 1, joints); those up to ``done`` are settled.
        costs: Costs of the points, of shape (steps,).
        done: Points settled.
        asked: Last point asked for.
        answers: Answers for the point that is being settled, by sub-population.
    """

    path: Floats
    costs: Floats
    done: int = 0
    asked: int = 0
    answers: dict[int, Tracked] = field(default_factory=dict)

    @property
    def steps(self) -> int:
        return len(self.costs)


class TrackingEngine:
    """Follow one path or several.

    Args:
        starts: Postures at the beginning of each scene, of shape (scenes, joints) [rad].
        steps: Number of points of each scene.
        subpopulations: Number of sub-populations that work on each point.
        evaluations: Individuals evaluated for each point, over all sub-populations.

    Attributes:
        step_seconds: Compute time of each settled point, of all its sub-populations together [s].
    """

    def __init__(self, starts: Floats, steps: int, subpopulations: int, evaluations: int) -> None:
        self._subpopulations = subpopulations
        self._evaluations = evaluations
        self._steps = steps
        self._scenes = [_new_scene(start, steps) for start in starts]
        self._rows = 0  # points that every scene has settled
        self._chunk = 1
        self.step_seconds = 0.0

    @property
    def finished(self) -> bool:
        """Whether every scene has reached its last point."""
        return self._rows == self._steps

    @property
    def generation(self) -> int:
        """Number of points that every scene has settled."""
        return self._rows

    @property
    def evaluations(self) -> int:
        """Individuals evaluated up to there."""
        return self._rows * self._evaluations * len(self._scenes)

    @property
    def best(self) -> Best:
        """The point of the highest cost, which is what a path is judged by, with its posture."""
        costs = np.stack([scene.costs[: self._rows] for scene in self._scenes])
        assert costs.size, "no point is settled yet"
        scene, point = np.unravel_index(int(np.argmax(costs)), costs.shape)
        posture = self._scenes[scene].path[point + 1].copy()
        posture.setflags(write=False)
        return Best(float(costs[scene, point]), int(point) + 1, posture)

    @property
    def paths(self) -> list[Floats]:
        """Postures of each scene, of shape (steps + 1, joints) [rad]."""
        return [scene.path for scene in self._scenes]

    def ask(self) -> list[Work]:
        """Return the next points of every scene that waits for none."""
        work: list[Work] = []
        for index, scene in enumerate(self._scenes):
            if scene.asked == scene.done < scene.steps:
                work += self._next_points(index, scene)
        return work

    def tell(self, work: Work, outcome: Outcome) -> list[GenerationRow]:
        """Settle the points that an outcome settles."""
        assert isinstance(outcome, Tracked)
        index, sub = divmod(work.work.population, self._subpopulations)
        scene = self._scenes[index]
        scene.answers[sub] = outcome
        if len(scene.answers) == self._subpopulations:
            self._settle(scene)
        return self._new_rows()

    def final_arrays(self) -> Sequence[NDArray[np.generic]]:
        """Return the paths, in the order of scenes."""
        return self.paths

    def state(self) -> State:
        """Return the settled points of every scene."""
        return {
            "done": np.array([scene.done for scene in self._scenes]),
            "paths": np.stack(self.paths),
            "costs": np.stack([scene.costs for scene in self._scenes]),
        }

    def restore(self, state: Mapping[str, int | float | str | NDArray[np.generic]]) -> None:
        """Go on from saved points."""
        done, paths, costs = (np.asarray(state[name]) for name in ("done", "paths", "costs"))
        self._scenes = [
            _Scene(path.astype(np.float64), cost.astype(np.float64), int(count), int(count))
            for path, cost, count in zip(paths, costs, done, strict=True)
        ]
        self._rows = int(done.min())

    def _next_points(self, index: int, scene: _Scene) -> list[Work]:
        count = 1 if self._subpopulations > 1 else self._chunk
        first = scene.done + 1
        last = min(scene.done + count, scene.steps)
        scene.asked = last
        posture = Array.pack(scene.path[scene.done])
        populations = range(self._subpopulations * index, self._subpopulations * (index + 1))
        return [
            Track(WorkId(Kind.TRACK, population, scene.done, first, last + 1), posture)
            for population in populations
        ]

    def _settle(self, scene: _Scene) -> None:
        answers = [scene.answers[sub] for sub in range(self._subpopulations)]
        scene.answers = {}
        costs = [answer.cost.unpack() for answer in answers]
        winner = min(range(len(answers)), key=lambda sub: (float(costs[sub][-1]), sub))
        first, last = answers[winner].work.first, answers[winner].work.last
        scene.path[first:last] = answers[winner].path.unpack()
        scene.costs[first - 1 : last - 1] = costs[winner]
        scene.done = scene.asked
        seconds = sum(answer.seconds for answer in answers)
        self.step_seconds += seconds
        each = max(seconds / (last - first), 1e-9)
        self._chunk = max(1, min(int(CHUNK_SECONDS / each), GROWTH * self._chunk))

    def _new_rows(self) -> list[GenerationRow]:
        first, last = self._rows, min(scene.done for scene in self._scenes)
        columns = zip(*(scene.costs[first:last].tolist() for scene in self._scenes), strict=True)
        each = self._evaluations * len(self._scenes)
        rows = []
        for number, costs in enumerate(columns, first + 1):
            best = min(costs)
            mean = sum(costs) / len(costs)
            rows.append(GenerationRow(number, number * each, best, mean, max(costs), best))
        self._rows = last
        return rows


def _new_scene(start: Floats, steps: int) -> _Scene:
    path = np.full((steps + 1, len(start)), np.nan)
    path[0] = start
    return _Scene(path, np.full(steps, np.nan))
