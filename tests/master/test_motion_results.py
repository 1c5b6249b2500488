from pathlib import Path

import msgspec
import numpy as np
import pytest

from tramnet_master.csv_tables import read_table
from tramnet_master.experiments.experiment import Common, Timing
from tramnet_master.motion_results import motion_result, write_motion
from tramnet_master.results import BestFound, MotionResult
from tramnet_master.trajectories import Trajectory
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.plan import Plan
from tramnet_workers.problems.straight_line import straight_line
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.puma560 import CORKE_VELOCITY_LIMITS, akb, p560

COMMON = Common(
    experiment="puma560", method="smooth", case=1, seed=1, population_size=100, generations=300,
    evaluations=30_000, best=BestFound(0.3667, 290), wall_seconds=0.41, workers=2,
    topology="star", lost_workers=0, condemned=[], reproducible=True,
    final_population_sha256="ab" * 32, paper=0.431, versions={},
)  # fmt: skip
TIMING = Timing(evaluations_per_second=73_000.0, network_overhead_fraction=0.3)


@pytest.fixture(scope="module")
def task() -> MotionTask:
    return MotionTask.for_arm(akb(), PAPER_START, PAPER_GOAL)


@pytest.fixture(scope="module")
def line(task) -> Plan:
    found = straight_line(task)
    assert found is not None
    return found


def result_of(task: MotionTask, plan: Plan, line: Plan | None) -> MotionResult:
    return motion_result(COMMON, TIMING, task, plan, line)


def test_a_good_plan_passes_and_its_gaps_are_told(task, line):
    result = result_of(task, line.stretched(1.1), line)

    assert result.verified
    assert result.failures == []
    assert all(check.passed for check in result.verification)
    assert result.robot == "akb"
    assert result.straight_line_time_s == pytest.approx(0.3806, abs=2e-4)
    assert result.motion_time_s == pytest.approx(1.1 * 0.3806, abs=2e-4)
    assert result.gap_to_straight_line == pytest.approx(0.1)
    assert result.limit_time_s == 0.3656
    assert result.gap_to_limit == pytest.approx(1.1 * 0.3806 / 0.3656 - 1, abs=1e-3)
    assert result.end_velocity_rad_s < 1e-6


def test_a_plan_that_is_too_fast_fails_with_its_reasons(task, line):
    result = result_of(task, line.stretched(0.9), line)

    assert not result.verified
    assert result.failures[0].startswith("joint 1 needs ")
    assert [check.name for check in result.verification if not check.passed] == [
        "torque to its limit"
    ]
    assert result.torque_ratio_max > 1.1


def test_each_limit_there_is_has_its_check():
    fast = MotionTask.for_arm(
        p560(), PAPER_START, PAPER_GOAL, velocity_limits=CORKE_VELOCITY_LIMITS
    )
    line = straight_line(fast)
    assert line is not None

    result = result_of(fast, line, line)

    names = [check.name for check in result.verification]
    assert names[-2:] == ["margin to angle limits", "margin to speed limits"]
    assert result.robot == "p560"
    assert result.verified
    assert result.limit_time_s is None
    assert result.gap_to_limit is None


def test_what_fails_as_a_whole_fails_in_a_check_too(task, line):
    for stretch in (0.95, 0.9999, 1.0, 1.2):
        result = result_of(task, line.stretched(stretch), line)

        assert result.verified == all(check.passed for check in result.verification)
        assert result.verified == (not result.failures)


def test_without_a_straight_line_there_is_no_gap_to_it(task, line):
    result = result_of(task, line, None)

    assert result.straight_line_time_s is None
    assert result.gap_to_straight_line is None


def test_a_result_says_the_limits_that_were_kept_and_null_for_none(task, line):
    limits = msgspec.json.decode(msgspec.json.encode(result_of(task, line, line)))["limits"]

    assert limits["torque_nm"] == [97.6, 186.4, 89.4, 24.2, 20.1, 21.3]
    assert limits["velocity_rad_s"] == [None] * 6


def test_the_files_of_a_motion_are_written(tmp_path: Path, task, line):
    write_motion(tmp_path, task, line.stretched(1.1), line)

    plan = Trajectory.read(tmp_path / "trajectory.csv")
    assert np.diff(plan.t).max() <= 0.0005 * (1 + 1e-9)
    np.testing.assert_allclose(plan.q[[0, -1]], [PAPER_START, PAPER_GOAL], atol=1e-9)
    assert plan.ratio.max() < 1.0
    nodes = read_table(tmp_path / "nodes.csv")
    assert nodes["t_s"][-1] == plan.t[-1]
    assert Trajectory.read(tmp_path / "straight_line.csv").t[-1] == line.duration


def test_where_there_is_no_straight_line_none_is_written(tmp_path: Path, task, line):
    write_motion(tmp_path, task, line, None)

    assert sorted(path.name for path in tmp_path.iterdir()) == ["nodes.csv", "trajectory.csv"]
