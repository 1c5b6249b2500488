"""What a design ends with, whatever the method: an arm with its poses, and that as plain values.

``describe_design`` is the content of ``design.json``, ``planar_arm`` that of the URDF file.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels.design import DM
from tramnet_workers.kernels.order import wrap
from tramnet_workers.mpga_settings import MpgaSettings
from tramnet_workers.problems.bilevel import worth
from tramnet_workers.problems.checks import (
    Motion,
    MotionValues,
    Violation,
    motion_values,
    violations_at,
)
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.progressive import DesignFound, Outcome
from tramnet_workers.problems.stages import Poses, evaluate_poses
from tramnet_workers.problems.steps import TERM_NAMES
from tramnet_workers.problems.trajectory import Circle
from tramnet_workers.robots.planar import PlanarArm

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DesignedArm:
    """A planar arm as a method ends with it.

    Attributes:
        task: The task as it was at the end, with all points that were added.
        poses: The arm at all stations.
        at_task_points: Which stations are task points, of shape (k,).
        terms: All terms of eq (4) at the stations, of shape (k, 8).
        violations: What violates a limit.
        found: What step 1 of Progressive Design found, None without it.
        motion: Motion along the whole path, None where none was planned.
        returns: How often step 1 was done again, None without Progressive Design.
    """

    task: DesignTask
    poses: Poses
    at_task_points: NDArray[np.bool_]
    terms: Floats
    violations: tuple[Violation, ...]
    found: DesignFound | None = None
    motion: Motion | None = None
    returns: int | None = None

    @classmethod
    def after(cls, task: DesignTask, outcome: Outcome) -> Self:
        """Return what Progressive Design ended with.

        Args:
            task: The task as it was at the end.
            outcome: The end.
        """
        return cls(
            task,
            outcome.poses,
            outcome.at_task_points,
            outcome.terms,
            outcome.violations,
            outcome.found,
            outcome.motion,
            outcome.returns,
        )

    @classmethod
    def at_points(cls, task: DesignTask, settings: MpgaSettings, poses: Poses) -> Self:
        """Return a design that has been given poses at its task points and nothing between.

        Args:
            task: The task.
            settings: Of the method it is compared with.
            poses: The arm at the task points; see ``exact_poses`` and ``single_poses``.
        """
        terms = evaluate_poses(task, settings, poses)
        everywhere = np.ones(len(poses.stations), np.bool_)
        return cls(task, poses, everywhere, terms, violations_at(task, poses, terms))


def exact_poses(task: DesignTask, lengths: Floats, base: Floats) -> Poses:
    """Return the most dexterous poses of an arm at the task points; what ``bilevel-cma`` ends with.

    Args:
        task: The task.
        lengths: Link lengths, of shape (3,) [m].
        base: Base position, of shape (2,) [m].

    Raises:
        InvalidTask: The arm has not three revolute joints alone.
    """
    joints = worth(task, lengths, base).joints
    return Poses(np.array(task.stations), lengths, np.tile(base, (len(joints), 1)), joints)


def single_poses(task: DesignTask, traits: Floats) -> Poses:
    """Return the arm that traits of ``single_design`` describe; what ``single-ga`` ends with.

    Args:
        task: The task.
        traits: Traits of the best individual, of shape (5 + 3 t,).
    """
    t = len(task.stations)
    return Poses(
        np.array(task.stations),
        traits[:3].copy(),
        np.tile(traits[3:5], (t, 1)),
        traits[5:].reshape(t, 3).copy(),
    )


def describe_design(design: DesignedArm) -> dict[str, object]:
    """Return a design as plain values; keys carry their units, None is what a method does not know."""
    task, found, motion = design.task, design.found, design.motion
    peaks = motion.null_peaks if motion is not None else np.empty(0)
    between = motion_values(task, design.poses, motion) if motion is not None else []
    return {
        "arm": "planar",
        "link_lengths_m": design.poses.lengths.tolist(),
        "designed_lengths_m": found.lengths.tolist() if found is not None else None,
        "base_m": design.poses.bases[0].tolist(),
        "dexterity_mean": float(design.terms[design.at_task_points, DM].mean()),
        "link_spread_m": found.spread if found is not None else None,
        "elbow_agreement": found.elbow_agreement if found is not None else None,
        "returns": design.returns,
        "null_motion_peak_over_mean": float(peaks.max()) if len(peaks) else None,
        "lower_rad": list(task.lower),
        "upper_rad": list(task.upper),
        "prismatic_links": [stroke.link + 1 for stroke in task.strokes],
        "boxes_m": [list(box) for box in task.boxes],
        "path": _describe_path(task),
        "points": [
            _describe_point(design, i, between[i] if i < len(between) else None)
            for i in range(len(design.terms))
        ],
        "violations": describe_violations(design.violations),
    }


def describe_violations(violations: tuple[Violation, ...]) -> list[dict[str, object]]:
    """Return violations as plain values."""
    return [
        {
            "constraint": violation.constraint,
            "stations": list(violation.stations),
            "found": violation.found,
            "limit": violation.limit,
        }
        for violation in violations
    ]


def describe_terms(
    row: Floats, station: float, violations: tuple[Violation, ...]
) -> Mapping[str, object]:
    """Return the terms of eq (4) at a station, and the constraints that fail there or next to it."""
    terms = dict(zip(TERM_NAMES, row.tolist(), strict=True))
    dexterity = terms.pop("dm")
    fails = sorted({v.constraint for v in violations if station in v.stations})
    return {"dexterity": dexterity, "constraints": terms, "fails": fails}


def planar_arm(task: DesignTask, poses: Poses, name: str) -> PlanarArm:
    """Return the arm of a design; a mobile base rests where it is at the first point."""
    reach = abs(poses.bases - poses.bases[0]).max(axis=0) if task.mobility is not None else (0, 0)
    return PlanarArm(
        name=name,
        lengths=tuple(poses.lengths.tolist()),
        base=(float(poses.bases[0, 0]), float(poses.bases[0, 1])),
        lower=task.lower,
        upper=task.upper,
        strokes=tuple(task.extensions.tolist()),
        reach=(float(reach[0]), float(reach[1])),
    )


def _describe_path(task: DesignTask) -> dict[str, object]:
    path = task.trajectory
    if isinstance(path, Circle):
        return {"kind": "circle", "centre_m": list(path.centre), "radius_m": path.radius}
    vertices = [list(vertex) for vertex in path.vertices]
    return {"kind": "polyline", "vertices_m": vertices, "closed": path.closed}


def _describe_point(
    design: DesignedArm, i: int, following: MotionValues | None
) -> dict[str, object]:
    """Return a station, its pose, the value of each term of eq (4), and the motion to the next one."""
    task, poses, n = design.task, design.poses, design.task.n_links
    station = float(poses.stations[i])
    return {
        "station": station,
        "task_point": bool(design.at_task_points[i]),
        "point_m": task.trajectory.point(station).tolist(),
        "base_m": poses.bases[i].tolist(),
        "pose_rad": [wrap(angle) for angle in poses.joints[i, :n].tolist()],
        "strokes_m": poses.joints[i, n:].tolist(),
        **describe_terms(design.terms[i], station, design.violations),
        "to_next": _describe_motion(following) if following is not None else None,
    }


def _describe_motion(values: MotionValues) -> dict[str, float]:
    return {
        "step_max_rad": values.jump,
        "limit_excess_rad": values.jlc,
        "inside_boxes_m": values.tc,
        "tracking_error_m": values.rc,
        "end_error_rad": values.end,
    }
