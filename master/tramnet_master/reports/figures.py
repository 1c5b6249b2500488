"""All figures of a run folder, drawn from its files and written beside them."""

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from tramnet_master.reports.comparison import draw_comparison
from tramnet_master.reports.convergence import draw_objective
from tramnet_master.reports.design_figures import write_design_figures
from tramnet_master.reports.findings import Findings
from tramnet_master.reports.following import draw_following
from tramnet_master.reports.joint_angles import draw_joint_angles
from tramnet_master.reports.joints import (
    draw_acceleration,
    draw_position,
    draw_torque,
    draw_velocity,
)
from tramnet_master.reports.postures import draw_postures
from tramnet_master.reports.record import RunRecord
from tramnet_master.reports.scene_overview import draw_scenes
from tramnet_master.reports.servo import draw_servo
from tramnet_master.reports.style import one_look, save
from tramnet_master.reports.tracking_record import EXPERIMENT, FollowedScene, TrackingRecord
from tramnet_master.run_folder import DESIGN
from tramnet_master.trajectories import Trajectory

_OF_A_PLAN: dict[str, Callable[[RunRecord, Trajectory], Figure]] = {
    "position": draw_position,
    "torque": draw_torque,
    "acceleration": draw_acceleration,
    "velocity": draw_velocity,
    "comparison": draw_comparison,
}

_OF_A_SCENE: dict[str, Callable[[FollowedScene], Figure]] = {
    "joint_angles": draw_joint_angles,
    "tracking": draw_following,
    "postures": draw_postures,
}


def write_figures(folder: Path) -> list[Path]:
    """Draw every figure that the files of a run folder allow, as PNG and SVG.

    Args:
        folder: Folder of a finished run.

    Returns:
        The files written.

    Raises:
        NotARunFolder: There is no finished run in it.
        DamagedFile: A file of it is torn.
        CannotWrite: The disk refuses.
    """
    if (folder / DESIGN).is_file():
        return write_design_figures(folder)
    with one_look():
        if Findings.read(folder).text("experiment") == EXPERIMENT:
            return _write_tracking(folder)
        return _write_motion(folder)


def _write_motion(folder: Path) -> list[Path]:
    record = RunRecord.read(folder)
    written = save(draw_objective(record), folder, "objective")
    if record.plan is not None:
        for name, draw in _OF_A_PLAN.items():
            written += save(draw(record, record.plan), folder, name)
    for period, path in record.servos.items():
        written += save(draw_servo(record, period, path), folder, path.stem)
    return written


def _write_tracking(folder: Path) -> list[Path]:
    record, written = TrackingRecord.read(folder), []
    if len(record.scenes) > 1:
        zones = {scene.name: scene.task.zone for scene in record.scenes}
        written += save(draw_scenes(record.found, zones), folder, "scenes")
    for scene in record.drawn:
        for name, draw_scene in _OF_A_SCENE.items():
            written += save(draw_scene(scene), folder, f"{name}{scene.suffix}")
    return written
