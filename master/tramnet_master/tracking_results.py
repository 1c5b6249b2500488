"""What following paths leaves in ``result.json``: how well each scene was followed, and at what cost."""

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from tramnet_master.experiments.experiment import Common, Timing
from tramnet_master.results import Result
from tramnet_master.tracking_files import Scene
from tramnet_workers.problems.tracking_report import report_points, summarise


class StepTime(Struct, frozen=True):
    """What a step of one scene took, on average over all steps of all scenes.

    Attributes:
        compute: Compute time of the workers, of all sub-populations together [ms].
        total: Time of the run; less than ``compute`` where workers share the scenes [ms].
    """

    compute: float
    total: float


class NetworkCost(Struct, frozen=True):
    """What it cost to compute on a network instead of in one process.

    Attributes:
        ms_per_step: Time of the run in a step in which no worker computed [ms].
        exchanges: Messages sent to workers and answered.
        worker_busy_seconds: How long each worker computed, by seat [s].
        advice: Which workers were idle and why, and whether one would be faster, in a sentence.
    """

    ms_per_step: float
    exchanges: int
    worker_busy_seconds: list[float]
    advice: str


class TrackedScene(Struct, frozen=True):
    """How well one scene was followed; see ``TrackingResult``.

    Attributes:
        name: Name of the scene, empty for the only one of a run.
        tracking_error_mean_cm: Mean distance of the tip from its points [cm].
        tracking_error_max_cm: Largest one [cm].
        clearance_min_cm: Smallest distance of arm and boxes after the start, None without boxes [cm].
        clearance_min_after_50_cm: The same after the first 50 points, None where there are no more [cm].
        points_outside_zone: Points at which the error is above the zone's radius.
        max_step_deg: Largest change of a joint's angle in a step [deg].
        roughness_deg: Mean absolute difference of a joint's successive steps [deg].
    """

    name: str
    tracking_error_mean_cm: float
    tracking_error_max_cm: float
    clearance_min_cm: float | None
    clearance_min_after_50_cm: float | None
    points_outside_zone: int
    max_step_deg: float
    roughness_deg: float


class TrackingResult(Result, frozen=True, kw_only=True):
    """What a run of ``redundant8`` writes beside; of several scenes, the worst of each quantity.

    Attributes:
        ms_per_step: What a step took.
        tracking_error_mean_cm: Mean distance of the tip from its points [cm].
        tracking_error_max_cm: Largest one [cm].
        clearance_min_cm: Smallest distance of arm and boxes after the start, None without boxes [cm].
        clearance_min_after_50_cm: The same after the first 50 points, None where there are no more [cm].
        points_outside_zone: Points at which the error is above the zone's radius.
        max_step_deg: Largest change of a joint's angle in a step [deg].
        roughness_deg: Mean absolute difference of a joint's successive steps [deg].
        scenes: The same for each scene.
        evaluations_per_second: Rate over the whole run [1/s].
        network_overhead_fraction: Share of the run in which no worker computed.
        network: What the network cost.
    """

    ms_per_step: StepTime
    tracking_error_mean_cm: float
    tracking_error_max_cm: float
    clearance_min_cm: float | None
    clearance_min_after_50_cm: float | None
    points_outside_zone: int
    max_step_deg: float
    roughness_deg: float
    scenes: list[TrackedScene]
    evaluations_per_second: float
    network_overhead_fraction: float | None
    network: NetworkCost


def tracking_result(
    common: Common,
    timing: Timing,
    scenes: Sequence[Scene],
    paths: Sequence[NDArray[np.float64]],
    compute_seconds: float,
    network: NetworkCost,
) -> TrackingResult:
    """Measure the paths that were followed and put together what ``result.json`` says of them.

    Args:
        common: What every experiment says.
        timing: How fast the run was.
        scenes: The scenes.
        paths: Joint angles along each, of shape (n_steps + 1, n_joints) [rad].
        compute_seconds: Compute time of all points, sub-populations and scenes together [s].
        network: What the network cost.
    """
    rows = [tracked_scene(scene, path) for scene, path in zip(scenes, paths, strict=True)]
    steps = sum(scene.task.n_steps for scene in scenes)
    return TrackingResult(
        **common,
        **timing,
        ms_per_step=StepTime(1e3 * compute_seconds / steps, 1e3 * common["wall_seconds"] / steps),
        tracking_error_mean_cm=max(row.tracking_error_mean_cm for row in rows),
        tracking_error_max_cm=max(row.tracking_error_max_cm for row in rows),
        clearance_min_cm=_least([row.clearance_min_cm for row in rows]),
        clearance_min_after_50_cm=_least([row.clearance_min_after_50_cm for row in rows]),
        points_outside_zone=max(row.points_outside_zone for row in rows),
        max_step_deg=max(row.max_step_deg for row in rows),
        roughness_deg=max(row.roughness_deg for row in rows),
        scenes=rows,
        network=network,
    )


def tracked_scene(scene: Scene, path: NDArray[np.float64]) -> TrackedScene:
    """Measure how well a scene was followed.

    Args:
        scene: The scene.
        path: Joint angles along it, of shape (n_steps + 1, n_joints) [rad].
    """
    found = summarise(scene.task, path, report_points(scene.task, path))
    return TrackedScene(
        name=scene.name,
        tracking_error_mean_cm=found.error_mean,
        tracking_error_max_cm=found.error_max,
        clearance_min_cm=_finite(found.clearance_min),
        clearance_min_after_50_cm=_finite(found.clearance_min_settled),
        points_outside_zone=found.points_outside_zone,
        max_step_deg=math.degrees(found.step_max),
        roughness_deg=math.degrees(found.roughness),
    )


def _finite(distance: float) -> float | None:
    return distance if math.isfinite(distance) else None


def _least(distances: Sequence[float | None]) -> float | None:
    return min((distance for distance in distances if distance is not None), default=None)
