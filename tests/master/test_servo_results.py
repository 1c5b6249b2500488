from pathlib import Path

import numpy as np
import pytest

from tramnet_master.csv_tables import read_table
from tramnet_master.results import ServoResult
from tramnet_master.servo_results import servo_result
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.servo import TICK, ServoSettings
from tramnet_workers.problems.straight_line import straight_line
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.puma560 import akb


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("run")


@pytest.fixture(scope="module")
def found(folder: Path) -> ServoResult:
    task = MotionTask.for_arm(akb(), PAPER_START, PAPER_GOAL)
    line = straight_line(task)
    assert line is not None
    return servo_result(folder, task, line, ServoSettings(period=0.028))


def test_set_points_every_28_ms_shake_the_arm_four_times_as_much_as_every_1_75_ms(found):
    """Wang & Zalzala (1995), section 6: "large jerks were experienced"."""
    assert found.period_ms == 28.0
    assert min(found.rms_jerk_ratio) > 4.0


def test_a_plan_with_torque_to_spare_ends_nearer_to_the_goal(found):
    errors = [row.error_rad for row in found.tracking]

    assert [row.margin for row in found.tracking] == [1.0, 0.9, 0.8]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] > 5 * errors[1]
    times = [row.motion_time_s for row in found.tracking]
    assert times == sorted(times)


def test_feed_forward_brings_the_arm_nearer_to_the_goal(found):
    for row in found.tracking:
        assert row.error_feed_forward_rad < row.error_rad


def test_a_replay_is_written_tick_by_tick(found, folder):
    table = read_table(folder / "servo-28ms.csv")

    assert list(table)[:2] == ["t_s", "reference1_rad"]
    assert {"q6_rad", "qd6_rad_s", "tau6_nm"} <= set(table)
    np.testing.assert_allclose(np.diff(table["t_s"])[:-1], TICK, atol=1e-12)
    end = [table[f"q{i + 1}_rad"][-1] for i in range(6)]
    assert np.abs(np.array(end) - PAPER_GOAL).max() == pytest.approx(found.tracking[0].error_rad)
