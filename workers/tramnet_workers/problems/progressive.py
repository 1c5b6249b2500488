"""Progressive Design: four steps from coarse to fine, and back to the first where they fail.

Kim & Khosla (1992), section 6. A ``Progress`` is a value: the search that is to be done next. Whoever
runs populations, in one process or on a network, does it and tells what the best individuals are;
``advance`` returns the next value. Nothing here evolves anything.

    design (or placement) -> prototype -> planning -> control -> finished
       ^                                                 |
       +---- with the offending points added <-----------+   at most ``task.most_returns`` times

What still violates a limit after the last return is reported, not hidden.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels.control import snap_poses
from tramnet_workers.kernels.order import wrap
from tramnet_workers.mpga_settings import MpgaSettings
from tramnet_workers.problems.bilevel import polish
from tramnet_workers.problems.checks import Motion, Violation, find_violations, follow_poses
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.stages import (
    Poses,
    Stage,
    design_stage,
    evaluate_poses,
    planning_stage,
    prototype_stage,
)
from tramnet_workers.problems.steps import Step
from tramnet_workers.problems.task_fitness import (
    require_links_to_find,
    require_something_to_find,
)
from tramnet_workers.problems.trajectory import intervals

Floats = NDArray[np.float64]

SUB_POINTS = 4  # sub-task points between neighbouring task points
MOST_TASK_POINTS = 64  # up to which offending points are added: where all fail, fivefold each time
_STREAMS_A_STEP = 1 << 16
_STEPS = (Step.DESIGN, Step.PROTOTYPE, Step.PLANNING)


class DesignFound(NamedTuple):
    """What step 1 found.

    Attributes:
        lengths: Link lengths: mean of the populations' best ones, of shape (n,) [m].
        spread: Largest difference between populations in one link length [m].
        elbow_agreement: Share of the task points with the most frequent pattern of elbows.
    """

    lengths: Floats
    spread: float
    elbow_agreement: float


@dataclass(frozen=True, eq=False)
class Outcome:
    """What Progressive Design ends with.

    Attributes:
        found: What step 1 found in the last round.
        poses: The arm at all stations, task points and sub-task points.
        at_task_points: Which stations are task points, of shape (t,).
        terms: All terms of eq (4) at the stations, of shape (t, 8).
        motion: Motion along the whole path.
        violations: What violates a limit.
        returns: How often step 1 was done again.
    """

    found: DesignFound
    poses: Poses
    at_task_points: NDArray[np.bool_]
    terms: Floats
    motion: Motion
    violations: tuple[Violation, ...]
    returns: int


@dataclass(frozen=True, eq=False)
class Progress:
    """A state of Progressive Design.

    Attributes:
        task: The task with its present task points.
        settings: Of the method.
        returns: How often step 1 was done again.
        stage: The search to do next, or None at the end.
        found: What step 1 found in this round.
        prototype: The arm at the task points after step 2.
        outcome: What has been reached at the end.
    """

    task: DesignTask
    settings: MpgaSettings
    returns: int = 0
    stage: Stage | None = None
    found: DesignFound | None = None
    prototype: Poses | None = None
    outcome: Outcome | None = None

    @property
    def stream(self) -> int:
        """Number of the first random stream of the next search; no two searches share one."""
        assert self.stage is not None
        step = Step.DESIGN if self.stage.step is Step.PLACEMENT else self.stage.step
        return (self.returns * len(_STEPS) + _STEPS.index(step)) * _STREAMS_A_STEP


def begin(task: DesignTask, settings: MpgaSettings) -> Progress:
    """Return the beginning of Progressive Design.

    Raises:
        InvalidTask: There is nothing to find, or nothing that the settings' polish can improve.
    """
    require_something_to_find(task)
    if settings.polish and task.lengths is None:
        require_links_to_find(task)
    return Progress(task, settings, stage=design_stage(task, settings))


def advance(progress: Progress, traits: Floats) -> Progress:
    """Return what follows from the search that ``progress.stage`` asked for.

    Args:
        progress: The state before the search.
        traits: Traits of the populations' best individuals, of shape (t, n_traits).
    """
    assert progress.stage is not None
    match progress.stage.step:
        case Step.DESIGN | Step.PLACEMENT:
            return _to_prototype(progress, traits)
        case Step.PROTOTYPE:
            return _to_planning(progress, traits)
        case _:
            return _to_control(progress, traits)


def _to_prototype(progress: Progress, traits: Floats) -> Progress:
    """Choose modules for the links found and look for poses with them."""
    task, settings = progress.task, progress.settings
    found = summarise(task, traits)
    bases = _common_bases(task, traits)
    if settings.polish and task.lengths is None:
        polished = polish(task, found.lengths, bases[0]).lengths
        found = found._replace(lengths=np.array(polished))
    if task.lengths is None:
        distances = np.sqrt(((task.points - bases) ** 2).sum(axis=1))
        ordered = task.weights.get("hc", settings.weights.hc) > 0.0
        lengths = task.stock.choose(
            found.lengths, ordered=ordered, reaches=distances, strokes=task.extensions
        )
    else:
        lengths = np.array(task.lengths)
    around = Poses(np.array(task.stations), lengths, bases, traits[:, task.n_links + 2 :])
    return replace(progress, found=found, stage=prototype_stage(task, settings, around))


def _to_planning(progress: Progress, traits: Floats) -> Progress:
    """Fix the poses at the task points and look for those between them."""
    task = progress.task
    prototype = _poses(progress, np.array(task.stations), traits)
    progress = replace(progress, prototype=prototype)
    if len(task.stations) < 2:
        return _finish(progress, prototype)
    around, neighbours = interpolate(task, prototype)
    between = replace(task, stations=tuple(around.stations))
    stage = planning_stage(between, progress.settings, around, neighbours, prototype)
    return replace(progress, stage=stage)


def _to_control(progress: Progress, traits: Floats) -> Progress:
    """Put all poses together, move along the path and look what is wrong."""
    assert progress.stage is not None
    assert progress.prototype is not None
    first = progress.prototype
    between = _poses(progress, progress.stage.stations, traits)
    order = np.argsort(np.concatenate([first.stations, between.stations]), kind="stable")
    poses = Poses(
        np.concatenate([first.stations, between.stations])[order],
        first.lengths,
        np.concatenate([first.bases, between.bases])[order],
        np.concatenate([first.joints, between.joints])[order],
    )
    return _finish(progress, poses)


def _finish(progress: Progress, poses: Poses) -> Progress:
    """End, or go back to step 1 with the points added at which something is wrong."""
    task = progress.task
    assert progress.found is not None
    terms = evaluate_poses(task, progress.settings, poses)
    motion = follow_poses(task, poses)
    violations = find_violations(task, poses, terms, motion)
    if violations and progress.returns < task.most_returns:
        again = replace(task, stations=_with_points(task, poses.stations, violations))
        stage = design_stage(again, progress.settings)
        return Progress(again, progress.settings, returns=progress.returns + 1, stage=stage)
    outcome = Outcome(
        found=progress.found,
        poses=poses,
        at_task_points=np.isin(poses.stations, task.stations),
        terms=terms,
        motion=motion,
        violations=violations,
        returns=progress.returns,
    )
    return replace(progress, stage=None, outcome=outcome)


def summarise(task: DesignTask, traits: Floats) -> DesignFound:
    """Return what step 1 found, from the traits of the populations' best individuals."""
    lengths = traits[:, : task.n_links]
    angles = traits[:, task.n_links + 3 : 2 * task.n_links + 2]
    _, counts = np.unique(angles > 0.0, axis=0, return_counts=True)
    return DesignFound(
        lengths.mean(axis=0),
        float(np.ptp(lengths, axis=0).max()),
        float(counts.max() / len(traits)),
    )


def interpolate(task: DesignTask, poses: Poses) -> tuple[Poses, NDArray[np.int64]]:
    """Return poses at the sub-task points, linear between task points, and rows of their neighbours.

    Rows from t on, t being the number of sub-task points, are those of ``poses``.
    """
    pairs = intervals(task.trajectory, poses.stations)
    t, n = len(pairs) * SUB_POINTS, task.n_links
    stations, bases, joints = np.empty(t), np.empty((t, 2)), np.empty((t, poses.joints.shape[1]))
    neighbours = np.stack([np.arange(-1, t - 1), np.arange(1, t + 1)], axis=1)
    for i, (start, end) in enumerate(pairs):
        following = (i + 1) % len(poses.stations)
        turn = poses.joints[following] - poses.joints[i]
        turn[:n] = [wrap(angle) for angle in turn[:n]]
        for k in range(SUB_POINTS):
            row, share = i * SUB_POINTS + k, (k + 1) / (SUB_POINTS + 1)
            stations[row] = start + share * (end - start)
            bases[row] = poses.bases[i] + share * (poses.bases[following] - poses.bases[i])
            joints[row] = poses.joints[i] + share * turn
        neighbours[i * SUB_POINTS, 0] = t + i
        neighbours[(i + 1) * SUB_POINTS - 1, 1] = t + following
    return Poses(stations, poses.lengths, bases, joints), neighbours


def _common_bases(task: DesignTask, traits: Floats) -> Floats:
    """Return where the arm stands at each task point, of shape (t, 2); one place, unless mobile."""
    bases = traits[:, task.n_links : task.n_links + 2].copy()
    if task.mobility is None:
        bases[:] = bases.mean(axis=0)
    return bases


def _poses(progress: Progress, stations: Floats, traits: Floats) -> Poses:
    """Return the poses found with given links, moved onto their points if the settings say so."""
    task, n = progress.task, progress.task.n_links
    assert progress.stage is not None
    lengths = traits[0, :n].copy()
    planning = progress.stage.step is Step.PLANNING
    bases = traits[:, n : n + 2].copy() if planning else _common_bases(task, traits)
    joints = traits[:, n + 2 :].copy()
    if progress.settings.snap:
        prismatic = np.array([stroke.link for stroke in task.strokes], np.int64)
        snap_poses(lengths, prismatic, bases, progress.stage.problem.points, joints)
    return Poses(stations, lengths, bases, joints)


def _with_points(
    task: DesignTask, stations: Floats, violations: tuple[Violation, ...]
) -> tuple[float, ...]:
    """Return the task points with the stations that fail, the worst first as long as there is room."""
    severity = np.zeros(len(stations))
    for violation in violations:
        at = np.isin(stations, violation.stations)
        severity[at] = np.maximum(severity[at], violation.severity)
    severity[np.isin(stations, task.stations)] = 0.0
    room = max(MOST_TASK_POINTS - len(task.stations), 0)
    worst = np.argsort(-severity, kind="stable")[:room]
    return tuple(sorted([*task.stations, *(float(stations[i]) for i in worst if severity[i] > 0)]))
