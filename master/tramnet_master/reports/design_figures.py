"""All figures of a design, drawn from the files of its run folder and written beside them."""

from pathlib import Path

from tramnet_master.reports.arm_poses import (
    draw_dexterity,
    draw_planned_poses,
    draw_task_poses,
)
from tramnet_master.reports.configurations import draw_configurations, draw_null_motion
from tramnet_master.reports.constraint_chart import draw_constraints
from tramnet_master.reports.design_record import DesignRecord
from tramnet_master.reports.evolution import draw_fitness, draw_total_length
from tramnet_master.reports.style import one_look, save

MANY_POINTS = 60
"""Task points from which a map says more than the arms."""


def write_design_figures(folder: Path) -> list[Path]:
    """Draw every figure that the files of a design allow, as PNG and SVG.

    Args:
        folder: Folder of a finished run.

    Returns:
        The files written.

    Raises:
        NotARunFolder: There is no finished run in it.
        DamagedFile: A file of it is torn.
        CannotWrite: The disk refuses.
    """
    record = DesignRecord.read(folder)
    design, written = record.design, []
    with one_look():
        if record.searches:
            written += save(draw_fitness(record), folder, "fitness")
            written += save(draw_total_length(record), folder, "total_length")
        written += save(draw_task_poses(record), folder, "task_poses")
        if len(design.points) > len(design.task_points):
            written += save(draw_planned_poses(record), folder, "planned_poses")
        if len(design.task_points) > MANY_POINTS and not design.spatial:
            written += save(draw_dexterity(record), folder, "dexterity")
        if record.motion is not None:
            written += save(draw_configurations(record, record.motion), folder, "configurations")
            written += save(draw_null_motion(record, record.motion), folder, "null_motion")
        written += save(draw_constraints(record), folder, "constraints")
    return written
