"""Step 4 of Progressive Design, control, and the limits that send it back to step 1.

Kim & Khosla (1992), section 6: between neighbouring stations the arm follows the path by its
pseudo-inverse, and "we check any possible violation of constraints such as JLC along the given
trajectory".
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels.control import follow_path
from tramnet_workers.kernels.design import DM, JLC, RC, TC
from tramnet_workers.kernels.order import wrap
from tramnet_workers.kernels.planar import PlanarModel, evaluate_planar
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.stages import Poses
from tramnet_workers.problems.trajectory import intervals

Floats = NDArray[np.float64]

CONTROL_STEPS = 20  # n1 of eq (13)

MOST_RC = 1e-3  # [m], for orientations weighted with the arm's scale
MOST_TC = 1e-3  # of links inside boxes [m]; the limits of a user's own terms are not known
MOST_JLC = 1e-6  # [rad]
MOST_JUMP = np.pi / 4  # between neighbouring stations [rad]
LEAST_DM = 0.05
MOST_END_ERROR = 1e-3  # [rad], of strokes [m]

#: By constraint; DM has to be at least its limit, all others at most.
LIMITS: Mapping[str, float] = MappingProxyType(
    {
        "rc": MOST_RC,
        "tc": MOST_TC,
        "jlc": MOST_JLC,
        "dm": LEAST_DM,
        "jump": MOST_JUMP,
        "end": MOST_END_ERROR,
    }
)
_STANDSTILL = 0.03  # null motion in an interval of which peak over mean says nothing [rad]


class Violation(NamedTuple):
    """A limit that is not kept.

    Attributes:
        constraint: ``rc``, ``tc``, ``jlc``, ``dm``, ``jump`` or ``end``.
        stations: Path parameters of the station or of both ends of the interval.
        found: The value found [m, rad].
        limit: Its limit.
    """

    constraint: str
    stations: tuple[float, ...]
    found: float
    limit: float

    @property
    def severity(self) -> float:
        """How far it is beyond the limit, as a ratio above 1; infinite where nothing was found."""
        if not self.found > 0.0:
            return np.inf
        return self.limit / self.found if self.constraint == "dm" else self.found / self.limit


class Motion(NamedTuple):
    """Motion along a path by the pseudo-inverse.

    Attributes:
        joints: Joint values, of shape (intervals, n1 + 1, n_joints) [rad, m].
        end_errors: Largest joint error at the end of each interval, of shape (intervals,) [rad].
        tracking_errors: Largest distance from the path in each, of shape (intervals,) [m].
        null_motion: Lengths of steps in the null space, of shape (intervals, n1) [rad].
    """

    joints: Floats
    end_errors: Floats
    tracking_errors: Floats
    null_motion: Floats

    @property
    def null_peaks(self) -> Floats:
        """Peak over mean of the null motion, in the intervals that have any; near 1 is constant."""
        moving = self.null_motion[self.null_motion.sum(axis=1) > _STANDSTILL]
        peaks: Floats = moving.max(axis=1) / moving.mean(axis=1)
        return peaks


class MotionValues(NamedTuple):
    """What is checked in an interval of a motion.

    Attributes:
        jump: Largest difference of a joint's angle between its ends [rad].
        jlc: Largest excess over joint limits, summed over the joints [rad].
        tc: Largest length of links inside boxes [m].
        rc: Largest distance of the tip from the path [m].
        end: Largest joint error at the end [rad].
    """

    jump: float
    jlc: float
    tc: float
    rc: float
    end: float


def follow_poses(task: DesignTask, poses: Poses, *, exact_gain: bool = True) -> Motion:
    """Return the motion along the path from each station to the next.

    Args:
        task: The task whose path is followed.
        poses: The arm at the stations.
        exact_gain: Whether null motion has the exact gain; else that of eq (13).
    """
    pairs = intervals(task.trajectory, poses.stations)
    prismatic = np.array([stroke.link for stroke in task.strokes], np.int64)
    size = poses.joints.shape[1]
    joints = np.empty((len(pairs), CONTROL_STEPS + 1, size))
    null_motion = np.empty((len(pairs), CONTROL_STEPS))
    errors = np.empty((2, len(pairs)))
    shares = np.arange(CONTROL_STEPS + 1) / CONTROL_STEPS
    for i, (start, end) in enumerate(pairs):
        following = (i + 1) % len(poses.stations)
        path = np.array([task.trajectory.point(start + share * (end - start)) for share in shares])
        moved = poses.bases[i] + shares[:, None] * (poses.bases[following] - poses.bases[i])
        joints[i, 0], goal = poses.joints[i], poses.joints[following]
        follow_path(
            poses.lengths, prismatic, path - moved, goal, exact_gain, joints[i], null_motion[i]
        )
        left = goal - joints[i, -1]
        left[: task.n_links] = [wrap(angle) for angle in left[: task.n_links]]
        tips = moved + tip_of(poses.lengths, prismatic, joints[i])
        errors[:, i] = abs(left).max(), np.sqrt(((tips - path) ** 2).sum(axis=1)).max()
    return Motion(joints, errors[0], errors[1], null_motion)


def tip_of(lengths: Floats, prismatic: NDArray[np.int64], joints: Floats) -> Floats:
    """Return tips relative to the base of poses of shape (k, n_joints), of shape (k, 2) [m]."""
    n = len(lengths)
    reach = np.broadcast_to(lengths, (len(joints), n)).copy()
    for s, link in enumerate(prismatic):
        reach[:, link] += joints[:, n + s]
    absolute = np.cumsum(joints[:, :n], axis=1)
    return np.stack(
        [(reach * np.cos(absolute)).sum(axis=1), (reach * np.sin(absolute)).sum(axis=1)], axis=1
    )


def crossings(task: DesignTask, lengths: Floats, bases: Floats, joints: Floats) -> Floats:
    """Return the length of links inside boxes in each of k poses, of shape (k,) [m].

    Args:
        task: The task, with its boxes.
        lengths: Link lengths without strokes, of shape (n,) [m].
        bases: Base positions, of shape (k, 2) [m].
        joints: Joint angles, then strokes, of shape (k, n_joints) [rad, m].
    """
    k, n = len(joints), task.n_links
    if not task.boxes:
        return np.zeros(k)
    model = PlanarModel(
        by_place=False,
        limits=np.array([task.lower, task.upper]),
        strokes=np.array([(s.link, s.scale) for s in task.strokes]).reshape(-1, 2),
        boxes=np.array(task.boxes),
        printed_hc=False,
    )
    # One population of k individuals; where their points are does not matter here.
    arms = np.concatenate([joints, bases, np.broadcast_to(lengths, (k, n))], axis=1)
    genes = np.ascontiguousarray(arms.T)[None]
    places, traits = np.empty((1, n + 1, 2, k)), np.empty((1, *genes.shape[1:]))
    terms = np.empty((1, 8, k))
    evaluate_planar(model, np.zeros((1, 2)), genes, places, traits, terms)
    found: Floats = terms[0, TC].copy()
    return found


def find_violations(
    task: DesignTask, poses: Poses, terms: Floats, motion: Motion
) -> tuple[Violation, ...]:
    """Return what is beyond its limit, station by station, then interval by interval."""
    found = list(violations_at(task, poses, terms))
    for i, values in enumerate(motion_values(task, poses, motion)):
        ends = poses.stations[i], poses.stations[(i + 1) % len(poses.stations)]
        found += _beyond(values._asdict(), (float(ends[0]), float(ends[1])))
    return tuple(found)


def violations_at(task: DesignTask, poses: Poses, terms: Floats) -> tuple[Violation, ...]:
    """Return what is beyond its limit at stations.

    Args:
        task: The task.
        poses: The arm at the stations.
        terms: All terms of eq (4) there, of shape (k, 8).
    """
    crossed = crossings(task, poses.lengths, poses.bases, poses.joints)
    found: list[Violation] = []
    for s, row, tc in zip(poses.stations, terms, crossed, strict=True):
        values = {"rc": row[RC], "tc": tc, "jlc": row[JLC], "dm": row[DM]}
        found += _beyond(values, (float(s),))
    return tuple(found)


def term_violations(stations: Floats, terms: Floats) -> tuple[Violation, ...]:
    """Return what is beyond its limit at stations of an arm without obstacles.

    Args:
        stations: Path parameters, of shape (k,).
        terms: All terms of eq (4) there, of shape (k, 8).
    """
    found: list[Violation] = []
    for s, row in zip(stations, terms, strict=True):
        found += _beyond({"rc": row[RC], "jlc": row[JLC], "dm": row[DM]}, (float(s),))
    return tuple(found)


def motion_values(task: DesignTask, poses: Poses, motion: Motion) -> list[MotionValues]:
    """Return what is checked in each interval of a motion."""
    n, found = task.n_links, []
    shares = np.arange(CONTROL_STEPS + 1)[:, None] / CONTROL_STEPS
    for i in range(len(motion.joints)):
        following = (i + 1) % len(poses.stations)
        turns = poses.joints[following, :n] - poses.joints[i, :n]
        angles = np.array([[wrap(angle) for angle in pose[:n]] for pose in motion.joints[i]])
        over = np.maximum(angles - task.upper, 0.0) + np.maximum(task.lower - angles, 0.0)
        moved = poses.bases[i] + shares * (poses.bases[following] - poses.bases[i])
        found.append(
            MotionValues(
                jump=max(abs(wrap(turn)) for turn in turns),
                jlc=float(over.sum(axis=1).max()),
                tc=float(crossings(task, poses.lengths, moved, motion.joints[i]).max()),
                rc=float(motion.tracking_errors[i]),
                end=float(motion.end_errors[i]),
            )
        )
    return found


def _beyond(values: Mapping[str, float], stations: tuple[float, ...]) -> list[Violation]:
    """Return those of the values that are beyond their limits; NaN is."""
    return [
        Violation(name, stations, float(value), LIMITS[name])
        for name, value in values.items()
        if not (value >= LIMITS[name] if name == "dm" else value <= LIMITS[name])
    ]
