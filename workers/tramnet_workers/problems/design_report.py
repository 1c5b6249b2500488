"""What a design ends with, as plain values and as an arm: the content of ``design.json`` and the URDF."""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels.design import DM
from tramnet_workers.kernels.order import wrap
from tramnet_workers.problems.checks import Violation
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.progressive import Outcome
from tramnet_workers.problems.stages import Poses
from tramnet_workers.problems.steps import TERM_NAMES
from tramnet_workers.robots.planar import PlanarArm

Floats = NDArray[np.float64]


def describe_design(task: DesignTask, outcome: Outcome) -> dict[str, object]:
    """Return a design as plain values; keys carry their units.

    Args:
        task: The task as it was at the end, with all points that were added.
        outcome: What Progressive Design ended with.
    """
    at = outcome.at_task_points
    return {
        "link_lengths_m": outcome.poses.lengths.tolist(),
        "designed_lengths_m": outcome.found.lengths.tolist(),
        "base_m": outcome.poses.bases[0].tolist(),
        "dexterity_mean": float(outcome.terms[at, DM].mean()),
        "link_spread_m": outcome.found.spread,
        "elbow_agreement": outcome.found.elbow_agreement,
        "returns": outcome.returns,
        "points": [_describe_point(task, outcome, i) for i in range(len(at))],
        "violations": [_describe_violation(violation) for violation in outcome.violations],
    }


def planar_arm(task: DesignTask, poses: Poses, name: str) -> PlanarArm:
    """Return the arm of a design; a mobile base stands where it is at the first point."""
    extents = [0.0] * task.n_links
    for stroke in task.strokes:
        extents[stroke.link] += stroke.length
    return PlanarArm(
        name=name,
        lengths=tuple(poses.lengths.tolist()),
        base=(float(poses.bases[0, 0]), float(poses.bases[0, 1])),
        lower=task.lower,
        upper=task.upper,
        strokes=tuple(extents),
    )


def _describe_point(task: DesignTask, outcome: Outcome, i: int) -> dict[str, object]:
    """Return a station, its pose and the value of each term of eq (4)."""
    station, n = float(outcome.poses.stations[i]), task.n_links
    terms = dict(zip(TERM_NAMES, outcome.terms[i].tolist(), strict=True))
    dexterity = terms.pop("dm")
    return {
        "station": station,
        "task_point": bool(outcome.at_task_points[i]),
        "point_m": task.trajectory.point(station).tolist(),
        "base_m": outcome.poses.bases[i].tolist(),
        "pose_rad": [wrap(angle) for angle in outcome.poses.joints[i, :n].tolist()],
        "strokes_m": outcome.poses.joints[i, n:].tolist(),
        "dexterity": dexterity,
        "constraints": terms,
        "fails": sorted({v.constraint for v in outcome.violations if station in v.stations}),
    }


def _describe_violation(violation: Violation) -> dict[str, object]:
    return {
        "constraint": violation.constraint,
        "stations": list(violation.stations),
        "found": violation.found,
        "limit": violation.limit,
    }
