"""Step 4 of Progressive Design, control, and the limits that send it back to step 1.

Kim & Khosla (1992), section 6: between neighbouring stations the arm follows the path by its
pseudo-inverse, and "we check any possible violation of constraints such as JLC along the given
trajectory".
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels.control import follow_path
from tramnet_workers.kernels.design import DM, JLC, RC
from tramnet_workers.kernels.order import wrap
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.stages import Poses
from tramnet_workers.problems.trajectory import intervals

Floats = NDArray[np.float64]

CONTROL_STEPS = 20  # n1 of eq (13)

MOST_RC = 1e-3  # [m], for orientations weighted with the arm's scale
MOST_JLC = 1e-6  # [rad]
MOST_JUMP = np.pi / 4  # between neighbouring stations [rad]
LEAST_DM = 0.05
MOST_END_ERROR = 1e-3  # [rad], of strokes [m]
_STANDSTILL = 0.03  # null motion in an interval of which peak over mean says nothing [rad]


class Violation(NamedTuple):
    """A limit that is not kept.

    Attributes:
        constraint: ``rc``, ``jlc``, ``dm``, ``jump`` or ``end``.
        stations: Path parameters of the station or of both ends of the interval.
        found: The value found [m, rad].
        limit: Its limit.
    """

    constraint: str
    stations: tuple[float, ...]
    found: float
    limit: float


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


def find_violations(
    task: DesignTask, poses: Poses, terms: Floats, motion: Motion
) -> tuple[Violation, ...]:
    """Return what is beyond its limit, station by station, then interval by interval."""
    found = list(violations_at(poses.stations, terms))
    for i in range(len(motion.joints)):
        found += _violations_between(task, poses, motion, i)
    return tuple(found)


def violations_at(stations: Floats, terms: Floats) -> tuple[Violation, ...]:
    """Return what is beyond its limit at stations.

    Args:
        stations: Path parameters, of shape (k,).
        terms: All terms of eq (4) there, of shape (k, 8).
    """
    found: list[Violation] = []
    for s, row in zip(stations, terms, strict=True):
        at = (float(s),)
        if not row[RC] <= MOST_RC:
            found.append(Violation("rc", at, float(row[RC]), MOST_RC))
        if not row[JLC] <= MOST_JLC:
            found.append(Violation("jlc", at, float(row[JLC]), MOST_JLC))
        if not row[DM] >= LEAST_DM:
            found.append(Violation("dm", at, float(row[DM]), LEAST_DM))
    return tuple(found)


def _violations_between(task: DesignTask, poses: Poses, motion: Motion, i: int) -> list[Violation]:
    n, following = task.n_links, (i + 1) % len(poses.stations)
    ends = (float(poses.stations[i]), float(poses.stations[following]))
    turns = poses.joints[following, :n] - poses.joints[i, :n]
    jump = max(abs(wrap(turn)) for turn in turns)
    angles = np.array([[wrap(angle) for angle in pose[:n]] for pose in motion.joints[i]])
    over = np.maximum(angles - task.upper, 0.0) + np.maximum(task.lower - angles, 0.0)
    checks = (
        ("jump", jump, MOST_JUMP),
        ("jlc", float(over.sum(axis=1).max()), MOST_JLC),
        ("rc", float(motion.tracking_errors[i]), MOST_RC),
        ("end", float(motion.end_errors[i]), MOST_END_ERROR),
    )
    return [Violation(name, ends, value, limit) for name, value, limit in checks
            if not value <= limit]  # fmt: skip
