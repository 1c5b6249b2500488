"""What a design leaves in its run folder: its files, and its part of ``result.json``.

``DesignResult`` and the names of the files are the same for planar and spatial arms; ``spatial_results``
writes those of the latter.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from tramnet_master.csv_tables import Column, write_rows, write_table
from tramnet_master.experiments.experiment import Common, Timing
from tramnet_master.files import write_atomically
from tramnet_master.plain_values import plain_leaf
from tramnet_master.populations import SearchHistory, write_populations
from tramnet_master.results import Result
from tramnet_master.run_folder import ARM_TABLE, ARM_URDF, DESIGN, MOTION, POPULATIONS, VIOLATIONS
from tramnet_workers.kernels.design import DM, JLC, RC
from tramnet_workers.problems.checks import Motion, Violation, tip_of
from tramnet_workers.problems.design_report import DesignedArm, describe_design, planar_arm
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.design_yardsticks import design_quality
from tramnet_workers.problems.stages import Poses
from tramnet_workers.problems.trajectory import intervals

Floats = NDArray[np.float64]

_UNITS = {"rc": "m", "tc": "m", "jlc": "rad", "dm": "", "jump": "rad", "end": "rad"}


class DesignQuality(Struct, frozen=True):
    """The arm against the best one there is, both with exact poses.

    Attributes:
        dexterity_optimum: Mean dexterity of the best arm, found by CMA-ES.
        optimal_lengths_m: Its links [m].
        designed: Mean dexterity of the designed links over the optimum.
        built: The same of the links from the stock.
        knows_obstacles: Whether the best arm heeds all task constraints; it does if there are none.
    """

    dexterity_optimum: float
    optimal_lengths_m: list[float]
    designed: float
    built: float
    knows_obstacles: bool


class DesignResult(Result, frozen=True, kw_only=True):
    """What a run of ``crank`` writes beside; None is what a method does not know.

    Attributes:
        variant: Variant of the task, None for the plain one.
        settings: Name of the settings.
        arm: ``planar`` or ``spatial``.
        link_lengths_m: Links of the arm that is built [m].
        designed_lengths_m: Links as designed, before modules were chosen [m].
        base_m: Where it stands; a mobile base, at the first point [m].
        task_points: Number of task points at the end.
        stations: Number of points with a pose.
        dexterity_mean: Mean dexterity of its poses at the task points.
        quality: Its links against the best ones, None where these are not known.
        link_spread_m: Largest difference between populations in one link [m].
        elbow_agreement: Share of the task points with the most frequent pattern of elbows.
        returns: How often Progressive Design went back to step 1.
        reach_error_max_m: Largest distance of the tip from its point [m].
        limit_excess_max_rad: Largest excess over joint limits, summed over the joints [rad].
        end_error_max_rad: Largest joint error at the end of an interval of the motion [rad].
        tracking_error_max_m: Largest distance of the moving tip from the path [m].
        null_motion_peak_over_mean: Of the interval where it is largest; 1 is constant.
        verified: Whether no limit is violated.
        violations: Number of violations of each constraint that is violated.
        evaluations_per_second: Rate over the whole run [1/s].
        network_overhead_fraction: Share of the run in which no worker computed.
    """

    variant: str | None
    settings: str
    arm: str
    link_lengths_m: list[float]
    designed_lengths_m: list[float] | None
    base_m: list[float]
    task_points: int
    stations: int
    dexterity_mean: float
    quality: DesignQuality | None
    link_spread_m: float | None
    elbow_agreement: float | None
    returns: int | None
    reach_error_max_m: float
    limit_excess_max_rad: float
    end_error_max_rad: float | None
    tracking_error_max_m: float | None
    null_motion_peak_over_mean: float | None
    verified: bool
    violations: dict[str, int]
    evaluations_per_second: float
    network_overhead_fraction: float | None


def write_design(folder: Path, design: DesignedArm, histories: Sequence[SearchHistory]) -> None:
    """Write all files of a design; those that its method has nothing for are left out.

    Args:
        folder: The run folder.
        design: What the method ended with.
        histories: How its populations evolved, search by search; empty if it has none.

    Raises:
        CannotWrite: The disk refuses.
    """
    task = design.task
    arm = planar_arm(task, design.poses, "crank")
    write_json(folder / DESIGN, describe_design(design))
    write_atomically(folder / ARM_URDF, arm.urdf().encode())
    rows = [
        [row.joint, row.d, row.a, row.alpha, row.stroke, lower, upper]
        for row, lower, upper in zip(arm.dh_rows(), task.lower, task.upper, strict=True)
    ]
    write_arm_table(folder / ARM_TABLE, rows)
    write_violations(folder / VIOLATIONS, design.violations)
    if design.motion is not None and len(design.motion.joints):
        write_table(folder / MOTION, motion_columns(task, design.poses, design.motion))
    if histories:
        write_populations(folder / POPULATIONS, histories)


def design_result(
    common: Common,
    timing: Timing,
    design: DesignedArm,
    settings: str,
    variant: str | None = None,
) -> DesignResult:
    """Put together what ``result.json`` says of a design.

    Args:
        common: What every experiment says.
        timing: How fast the run was.
        design: What the method ended with.
        settings: Name of the settings.
        variant: Variant of the task, None for the plain one.
    """
    motion, found, lengths = design.motion, design.found, design.poses.lengths
    peaks = motion.null_peaks if motion is not None else np.empty(0)
    return DesignResult(
        **common,
        **timing,
        variant=variant,
        settings=settings,
        arm="planar",
        link_lengths_m=lengths.tolist(),
        designed_lengths_m=found.lengths.tolist() if found is not None else None,
        base_m=design.poses.bases[0].tolist(),
        task_points=int(design.at_task_points.sum()),
        stations=len(design.terms),
        dexterity_mean=float(design.terms[design.at_task_points, DM].mean()),
        quality=_quality(design),
        link_spread_m=found.spread if found is not None else None,
        elbow_agreement=found.elbow_agreement if found is not None else None,
        returns=design.returns,
        reach_error_max_m=float(design.terms[:, RC].max()),
        limit_excess_max_rad=float(design.terms[:, JLC].max()),
        end_error_max_rad=_largest(motion.end_errors) if motion is not None else None,
        tracking_error_max_m=_largest(motion.tracking_errors) if motion is not None else None,
        null_motion_peak_over_mean=_largest(peaks) if len(peaks) else None,
        verified=not design.violations,
        violations=count_violations(design.violations),
    )


def motion_columns(task: DesignTask, poses: Poses, motion: Motion) -> dict[str, Column]:
    """The motion along the path as columns, n1 + 1 rows an interval.

    ``station`` grows beyond the path's length in the interval that closes it; ``error_m`` is the distance
    of the tip from the path, ``null_rad`` the length of the step in the null space that led here.
    """
    n_intervals, rows = motion.joints.shape[:2]
    shares = np.linspace(0.0, 1.0, rows)[:, None]
    prismatic = np.array([stroke.link for stroke in task.strokes], np.int64)
    joints, tips, bases, stations, errors = [], [], [], [], []
    for i, (start, end) in enumerate(intervals(task.trajectory, poses.stations)):
        following = (i + 1) % len(poses.stations)
        base = poses.bases[i] + shares * (poses.bases[following] - poses.bases[i])
        at = start + shares[:, 0] * (end - start)
        tip = base + tip_of(poses.lengths, prismatic, motion.joints[i])
        wanted = np.array([task.trajectory.point(float(s)) for s in at])
        stations.append(at)
        bases.append(base)
        tips.append(tip)
        joints.append(motion.joints[i])
        errors.append(np.sqrt(((tip - wanted) ** 2).sum(axis=1)))
    null = np.concatenate([np.zeros((n_intervals, 1)), motion.null_motion], axis=1)
    angles, base, tip = np.concatenate(joints), np.concatenate(bases), np.concatenate(tips)
    n = task.n_links
    columns: dict[str, Column] = {
        "interval": np.repeat(np.arange(1, n_intervals + 1), rows),
        "station": np.concatenate(stations),
    }
    columns |= {f"q{k + 1}_rad": angles[:, k] for k in range(n)}
    columns |= {f"stroke{s.link + 1}_m": angles[:, n + i] for i, s in enumerate(task.strokes)}
    return columns | {
        "base_x_m": base[:, 0],
        "base_y_m": base[:, 1],
        "x_m": tip[:, 0],
        "y_m": tip[:, 1],
        "error_m": np.concatenate(errors),
        "null_rad": null.ravel(),
    }


def write_json(path: Path, content: Mapping[str, object]) -> None:
    """Write plain values, whole or not at all; what is not finite becomes null.

    Raises:
        CannotWrite: The disk refuses.
    """
    text = msgspec.json.encode(content, enc_hook=plain_leaf)
    write_atomically(path, msgspec.json.format(text, indent=2) + b"\n")


def write_arm_table(path: Path, rows: Iterable[Sequence[object]]) -> None:
    """Write a table of standard Denavit-Hartenberg rows; theta is the joint variable.

    Raises:
        CannotWrite: The disk refuses.
    """
    names = ("joint", "d_m", "a_m", "alpha_rad", "stroke_m", "lower_rad", "upper_rad")
    write_rows(path, names, rows)


def write_violations(path: Path, violations: Iterable[Violation]) -> None:
    """Write which constraint fails where, and by how much; no rows if none does.

    Raises:
        CannotWrite: The disk refuses.
    """
    names = ("constraint", "from_station", "to_station", "found", "limit", "unit")
    rows = ((v.constraint, v.stations[0], v.stations[-1], v.found, v.limit, _UNITS[v.constraint])
            for v in violations)  # fmt: skip
    write_rows(path, names, rows)


def count_violations(violations: Iterable[Violation]) -> dict[str, int]:
    """How often each constraint is violated."""
    return dict(sorted(Counter(violation.constraint for violation in violations).items()))


def _quality(design: DesignedArm) -> DesignQuality | None:
    built, task = design.poses.lengths, design.task
    designed = design.found.lengths if design.found is not None else built
    found = design_quality(task, designed, built, design.poses.bases[0])
    if found is None:
        return None
    return DesignQuality(
        found.optimum,
        list(found.optimal_lengths),
        found.designed,
        found.built,
        knows_obstacles=not (task.boxes or task.terms),
    )


def _largest(values: Floats) -> float:
    return float(values.max()) if len(values) else 0.0
