"""The paper's experiment on a plan that was found: replays through a servo, and what they show.

Wang & Zalzala (1995), section 6: set-points every 28 ms shake the arm, set-points every 1.75 ms do not. Jerks are
compared without saturation, which would hide them; errors at the end of the motion with it.
"""

from pathlib import Path

from msgspec.structs import replace

from tramnet_master.csv_tables import Column, write_table
from tramnet_master.results import ServoResult, Tracking
from tramnet_master.run_folder import SERVO
from tramnet_master.trajectories import numbered
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.plan import Plan
from tramnet_workers.problems.servo import MARGINS, Replay, ServoSettings, replay, slow_down

SMOOTH_PERIOD = 0.00175  # of set-points with the transputers [s]


def servo_result(
    folder: Path, task: MotionTask, plan: Plan, settings: ServoSettings
) -> ServoResult:
    """Replay a plan, write what the arm did as ``servo-<period>ms.csv``, and sum it up.

    Args:
        folder: The run folder.
        task: The task.
        plan: The plan that was found.
        settings: How to replay it.

    Raises:
        CannotWrite: The disk refuses.
    """
    period = round(1000 * settings.period, 6)
    write_replay(folder / SERVO.format(period=f"{period:g}"), replay(task, plan, settings))
    free = replace(settings, saturates=False)
    shaken = replay(task, plan, free)
    smooth = replay(task, plan, replace(free, period=SMOOTH_PERIOD))
    return ServoResult(
        period_ms=period,
        bandwidth_rad_s=settings.bandwidth,
        feed_forward=settings.feed_forward,
        rms_jerk_rad_s3=shaken.rms_jerk.tolist(),
        rms_jerk_ratio=(shaken.rms_jerk / smooth.rms_jerk).tolist(),
        peak_command_ratio=shaken.peak_command.tolist(),
        tracking=[row for margin in MARGINS if (row := _tracking(task, plan, settings, margin))],
    )


def write_replay(path: Path, motion: Replay) -> None:
    """Write a replay: what the servo aimed at, and what the arm did, at each tick.

    Raises:
        CannotWrite: The disk refuses.
    """
    columns: dict[str, Column] = {"t_s": motion.t}
    columns |= numbered("reference{}_rad", motion.reference)
    columns |= numbered("q{}_rad", motion.q) | numbered("qd{}_rad_s", motion.qd)
    write_table(path, columns | numbered("tau{}_nm", motion.tau))


def _tracking(
    task: MotionTask, plan: Plan, settings: ServoSettings, margin: float
) -> Tracking | None:
    slower = slow_down(task, plan, margin)
    if slower is None:
        return None
    saturated = replace(settings, saturates=True)
    errors = [
        float(replay(task, slower, replace(saturated, feed_forward=ahead)).tracking_error.max())
        for ahead in (False, True)
    ]
    return Tracking(margin, slower.duration, *errors)
