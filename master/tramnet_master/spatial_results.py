"""What the design of a spatial arm leaves in its run folder, under the same names as a planar one."""

from collections.abc import Sequence
from pathlib import Path

from tramnet_master.design_results import (
    DesignResult,
    count_violations,
    write_arm_table,
    write_json,
    write_violations,
)
from tramnet_master.experiments.experiment import Common, Timing
from tramnet_master.files import write_atomically
from tramnet_master.populations import SearchHistory, write_populations
from tramnet_master.run_folder import ARM_TABLE, ARM_URDF, DESIGN, POPULATIONS, VIOLATIONS
from tramnet_workers.kernels.design import DM, JLC, RC
from tramnet_workers.problems.spatial_report import SpatialArm


def write_spatial(folder: Path, arm: SpatialArm, histories: Sequence[SearchHistory]) -> None:
    """Write ``design.json``, ``arm.urdf``, ``arm_dh.csv``, ``violations.csv`` and ``populations.csv``.

    Args:
        folder: The run folder.
        arm: What the method ended with.
        histories: How its populations evolved, in the one search there is.

    Raises:
        CannotWrite: The disk refuses.
    """
    write_json(folder / DESIGN, arm.describe())
    write_atomically(folder / ARM_URDF, arm.urdf("crank").encode())
    rows = [
        [f"joint{i}", row.d, row.a, row.alpha, 0.0, row.lower, row.upper]
        for i, row in enumerate(arm.rows, start=1)
    ]
    write_arm_table(folder / ARM_TABLE, rows)
    write_violations(folder / VIOLATIONS, arm.violations)
    if histories:
        write_populations(folder / POPULATIONS, histories)


def spatial_result(
    common: Common,
    timing: Timing,
    arm: SpatialArm,
    settings: str,
    variant: str = "spatial",
) -> DesignResult:
    """Put together what ``result.json`` says of a spatial arm.

    Args:
        common: What every experiment says.
        timing: How fast the run was.
        arm: What the method ended with.
        settings: Name of the settings.
        variant: Variant of the task.
    """
    found = arm.found
    return DesignResult(
        **common,
        **timing,
        variant=variant,
        settings=settings,
        arm="spatial",
        link_lengths_m=found.lengths.tolist(),
        designed_lengths_m=found.lengths.tolist(),
        base_m=found.base.tolist(),
        task_points=len(found.terms),
        stations=len(found.terms),
        dexterity_mean=float(found.terms[:, DM].mean()),
        quality=None,
        link_spread_m=found.spread,
        elbow_agreement=None,
        returns=None,
        reach_error_max_m=float(found.terms[:, RC].max()),
        limit_excess_max_rad=float(found.terms[:, JLC].max()),
        end_error_max_rad=None,
        tracking_error_max_m=None,
        null_motion_peak_over_mean=None,
        verified=not arm.violations,
        violations=count_violations(arm.violations),
    )
