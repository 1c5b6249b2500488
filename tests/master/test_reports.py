import io
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import msgspec
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from rich.console import Console

from tramnet_master.csv_tables import write_table
from tramnet_master.engines.engine import GenerationRow
from tramnet_master.errors import DamagedFile, NotARunFolder
from tramnet_master.history import History
from tramnet_master.reports.comparison import draw_comparison
from tramnet_master.reports.convergence import draw_objective
from tramnet_master.reports.figures import write_figures
from tramnet_master.reports.joints import (
    draw_acceleration,
    draw_position,
    draw_torque,
    draw_velocity,
)
from tramnet_master.reports.paper_table import CaseOutcome, paper_table
from tramnet_master.reports.record import RunRecord
from tramnet_master.reports.servo import draw_servo
from tramnet_master.reports.style import columns_for, one_look, rows_for
from tramnet_master.reports.summary import print_summary
from tramnet_master.results import BestFound, Check, Limits, MotionResult
from tramnet_master.run_folder import OpenRunFolder
from tramnet_master.trajectories import Trajectory, write_nodes

MOTION_FIGURES = [draw_position, draw_torque, draw_velocity, draw_acceleration, draw_comparison]
NAMES = ["objective", "position", "torque", "acceleration", "velocity", "comparison"]


def motion(n_joints: int, duration: float) -> Trajectory:
    """Every joint speeds up and slows down at its torque limit of 50 (joint + 1) N m."""
    t = np.linspace(0.0, duration, 41)
    turn = np.where(t < duration / 2, 1.0, -1.0)
    s = np.where(turn > 0, 2 * (t / duration) ** 2, 1 - 2 * (1 - t / duration) ** 2)
    sign = (-1.0) ** np.arange(n_joints)
    limits = 50.0 * np.arange(1, n_joints + 1)
    q, qd = np.outer(s, sign), np.outer(turn * t, sign)
    tau = np.outer(turn, sign) * limits
    return Trajectory(t, q, qd, np.outer(turn, sign), tau, np.abs(tau) / limits)


def result(n_joints: int) -> MotionResult:
    return MotionResult(
        experiment="puma560", method="wang-zalzala", case=1, seed=1, population_size=100,
        generations=20, evaluations=2000, best=BestFound(0.4269, 17), wall_seconds=0.41,
        workers=2, topology="star", lost_workers=1, condemned=[], reproducible=True,
        final_population_sha256="ab" * 32, paper=0.431, versions={}, robot="akb",
        start_rad=[0.0] * n_joints, goal_rad=[1.0] * n_joints,
        limits=Limits(
            [50.0 * (i + 1) for i in range(n_joints)], [1.5] + [math.inf] * (n_joints - 1),
            [-1.5] * n_joints, [100.0] * n_joints,
        ),
        motion_time_s=0.4269, objective=0.4269, end_velocity_rad_s=1e-15, torque_ratio_max=1.04,
        straight_line_time_s=0.3806, limit_time_s=0.3656, gap_to_limit=0.1677,
        gap_to_straight_line=0.1216, evaluations_per_second=73_000.0,
        network_overhead_fraction=0.3, verified=False,
        verification=[
            Check("torque over its limit", 1.04, 1.001, "", False),
            Check("open-loop error at the end", 1.2e-9, 1e-6, "rad", True),
            Check("margin to the limits", 0.5, 0.0, "rad", True, at_least=True),
            Check("rms jerk", 652.0, None, "rad/s³", True),
        ],
        failures=["joint 1 needs 104.02 % of its torque limit of 97.6 N m"],
    )  # fmt: skip


def fill(folder: Path, n_joints: int, generations: int = 20) -> Path:
    with OpenRunFolder.create(folder, {"experiment": "puma560"}) as run:
        with History(folder / "history.csv") as history:
            for g in range(1, generations + 1):
                best = 0.4269 + 1 / g
                row = GenerationRow(g, 100 * g, best, 2 * best, math.inf, best)
                history.append([row], 0.01 * g)
        plan = motion(n_joints, 0.4269)
        plan.write(folder / "trajectory.csv")
        motion(n_joints, 0.3806).write(folder / "straight_line.csv")
        write_nodes(folder / "nodes.csv", plan.t[::5], plan.q[::5], plan.qd[::5])
        run.write_result(result(n_joints))
    return folder


def change_result(folder: Path, **keys: object) -> None:
    path = folder / "result.json"
    path.write_bytes(msgspec.json.encode(msgspec.json.decode(path.read_bytes()) | keys))


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], RunRecord]:
    def read(n_joints: int) -> RunRecord:
        folder = tmp_path_factory.mktemp("runs") / "run"
        return RunRecord.read(fill(folder, n_joints))

    return read


def drawn(figure: Figure) -> Figure:
    figure.canvas.draw()
    return figure


def test_every_figure_is_written_as_png_and_svg(tmp_path):
    folder = fill(tmp_path / "run", 6)

    written = write_figures(folder)

    assert [path.name for path in written] == [
        f"{name}.{kind}" for name in NAMES for kind in ("png", "svg")
    ]
    for path in written:
        if path.suffix == ".png":
            with Image.open(path) as picture:
                assert picture.size[0] == 1080
        else:
            assert path.read_text().lstrip().startswith("<?xml")


def test_figures_are_rebuilt_alike_from_the_files_of_the_folder(tmp_path):
    folder = fill(tmp_path / "run", 2)
    first = {path: path.read_bytes() for path in write_figures(folder)}
    for path in first:
        path.unlink()

    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30, "axes.facecolor": "red"}):
        second = {path: path.read_bytes() for path in write_figures(folder)}

    assert first == second


def test_figures_leave_the_settings_of_matplotlib_as_they_were(tmp_path):
    before = dict(mpl.rcParams)

    write_figures(fill(tmp_path / "run", 1))

    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize("n_joints", [1, 2, 3, 4, 5, 6, 7, 8, 12])
def test_there_is_a_panel_a_joint_with_units_on_the_outer_axes(record, n_joints):
    run = record(n_joints)
    with one_look():
        panels = draw_torque(run, run.plan).axes

    assert [axes.get_title("left") for axes in panels] == [
        f"Joint {i + 1}" for i in range(n_joints)
    ]
    columns = columns_for(n_joints)
    for i, axes in enumerate(panels):
        assert axes.get_ylabel() == ("torque [N m]" if i % columns == 0 else "")
        assert axes.get_xlabel() == ("time [s]" if i + columns >= n_joints else "")


@pytest.mark.parametrize("n_joints", [1, 2, 4, 6, 8])
@pytest.mark.parametrize("draw", MOTION_FIGURES)
def test_nothing_is_cut_off_and_no_legend_covers_data(record, n_joints, draw, assert_in_order):
    run = record(n_joints)
    with one_look():
        figure = drawn(draw(run, run.plan))

    assert_in_order(figure)


def test_the_objective_figure_is_in_order(record, assert_in_order):
    with one_look():
        assert_in_order(drawn(draw_objective(record(6))))


def test_torques_stand_between_their_dashed_limits(record):
    run = record(2)
    with one_look():
        _, axes = draw_torque(run, run.plan).axes

    dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert sorted(line.get_ydata()[0] for line in dashed) == [-100.0, 100.0]
    low, high = axes.get_ylim()
    assert low < -100.0
    assert high > 100.0


def test_only_joints_with_a_velocity_limit_show_one(record):
    run = record(2)
    with one_look():
        first, second = draw_velocity(run, run.plan).axes

    assert first.get_title("right") == "±1.5 rad/s"
    assert second.get_title("right") == ""
    assert [line.get_linestyle() for line in second.lines] == ["-"]


def test_position_limits_far_away_do_not_flatten_the_motion(record):
    run = record(1)
    with one_look():
        (axes,) = draw_position(run, run.plan).axes

    assert axes.get_ylim()[1] < 2.0


def test_a_joint_that_stands_still_has_a_panel_all_the_same(tmp_path):
    folder = fill(tmp_path / "run", 1)
    still = np.zeros((2, 1))
    t = np.array([0.0, 0.4])
    Trajectory(t, still + 0.5, still.copy(), still.copy(), still.copy(), still.copy()).write(
        folder / "trajectory.csv"
    )

    run = RunRecord.read(folder)
    with one_look():
        (axes,) = draw_position(run, run.plan).axes

    low, high = axes.get_ylim()
    assert low < 0.5 < high


def test_the_objective_figure_shows_the_best_and_leaves_infinite_objectives_out(record):
    with one_look():
        figure = drawn(draw_objective(record(1)))

    (axes,) = figure.axes
    curves = {line.get_label(): line.get_ydata() for line in axes.lines}
    assert set(curves) == {
        "mean of a generation",
        "best of a generation",
        "best so far",
        "paper: 0.431",
    }
    np.testing.assert_allclose(curves["best so far"], 0.4269 + 1 / np.arange(1, 21))
    assert np.isfinite(axes.get_ylim()).all()


def test_the_paper_s_motion_time_is_not_shown_as_an_objective_of_torques(tmp_path):
    folder = fill(tmp_path / "run", 1)
    change_result(folder, case=3)

    with one_look():
        (axes,) = draw_objective(RunRecord.read(folder)).axes

    assert not [line for line in axes.lines if str(line.get_label()).startswith("paper")]


def test_a_history_of_many_generations_is_drawn_from_blocks(tmp_path):
    folder = fill(tmp_path / "run", 1, generations=4000)

    with one_look():
        (axes,) = draw_objective(RunRecord.read(folder)).axes

    for line in axes.lines[:3]:
        assert len(line.get_xdata()) <= 1500
    assert axes.lines[2].get_ydata()[-1] == 0.4269 + 1 / 4000
    assert axes.lines[0].get_label() == "mean of 3 generations"


def test_a_history_of_one_generation_is_drawn(tmp_path):
    folder = fill(tmp_path / "run", 1, generations=1)

    with one_look():
        drawn(draw_objective(RunRecord.read(folder)))


def test_the_comparison_has_a_bar_for_each_time_there_is(record):
    run = record(1)
    with one_look():
        bars, _ = draw_comparison(run, run.plan).get_axes()

    assert [label.get_text() for label in bars.get_yticklabels()] == [
        "paper",
        "this plan",
        "straight line",
        "least time T*",
    ]
    assert [text.get_text() for text in bars.texts] == [
        "0.4310 s  (+17.9%)",
        "0.4269 s  (+16.8%)",
        "0.3806 s  (+4.1%)",
        "0.3656 s",
    ]


def test_a_user_s_own_task_is_compared_with_what_is_known(tmp_path):
    folder = fill(tmp_path / "run", 1)
    change_result(folder, case=None, paper=None, limit_time_s=None)
    (folder / "straight_line.csv").unlink()

    run = RunRecord.read(folder)
    with one_look():
        bars, _ = draw_comparison(run, run.plan).get_axes()

    assert [text.get_text() for text in bars.texts] == ["0.4269 s", "0.3806 s"]
    assert "own task" in run.found.caption


def test_a_run_without_a_plan_has_only_its_objective_drawn(tmp_path):
    folder = fill(tmp_path / "run", 1)
    for name in ("trajectory.csv", "straight_line.csv", "nodes.csv"):
        (folder / name).unlink()

    assert [path.name for path in write_figures(folder)] == ["objective.png", "objective.svg"]


def test_an_unfinished_run_has_no_report(tmp_path):
    folder = fill(tmp_path / "run", 1)
    (folder / "result.json").unlink()

    with pytest.raises(NotARunFolder, match=r"result\.json"):
        write_figures(folder)


def test_a_torn_trajectory_is_told_of(tmp_path):
    folder = fill(tmp_path / "run", 1)
    (folder / "trajectory.csv").write_text("t_s,q1_rad\n0.0\n")

    with pytest.raises(DamagedFile, match=r"trajectory\.csv"):
        write_figures(folder)


def write_replay(folder: Path, period: float) -> Path:
    """A joint that lags behind set-points on a slope of 1 rad/s by 2 mrad."""
    t = np.append(np.arange(0.0, 0.4, 0.000875), 0.4)
    path = folder / f"servo-{period:g}ms.csv"
    write_table(path, {"t_s": t, "reference1_rad": t, "q1_rad": t - 0.002})
    return path


def test_a_replay_through_a_servo_has_its_figure(tmp_path):
    folder = fill(tmp_path / "run", 1)
    change_result(folder, goal_rad=[0.4])
    for period in (28, 1.75):
        write_replay(folder, period)

    written = [path.name for path in write_figures(folder)]

    assert written[-4:] == [
        "servo-1.75ms.png", "servo-1.75ms.svg", "servo-28ms.png", "servo-28ms.svg",
    ]  # fmt: skip


@pytest.mark.parametrize(("period", "points"), [(28, 15), (7, 58), (1.75, 0)])
def test_set_points_stand_at_their_period_unless_they_are_too_many(
    tmp_path, period, points, assert_in_order
):
    folder = fill(tmp_path / "run", 1)
    change_result(folder, goal_rad=[0.4])
    path = write_replay(folder, period)

    with one_look():
        figure = drawn(draw_servo(RunRecord.read(folder), period, path))

    (axes,) = figure.axes
    marked = [line for line in axes.lines if line.get_marker() == "o"]
    assert sum(len(line.get_xdata()) for line in marked) == points
    assert axes.get_title("right") == "end error 2 mrad"
    assert_in_order(figure)


@pytest.mark.parametrize("n_joints", range(1, 17))
def test_all_joints_find_a_place(n_joints):
    rows, columns = rows_for(n_joints), columns_for(n_joints)

    assert (rows - 1) * columns < n_joints <= rows * columns


def printed(folder: Path, width: int = 100) -> str:
    console = Console(file=io.StringIO(), width=width, force_terminal=True, color_system="standard")
    with console.capture() as capture:
        print_summary(folder, console)
    return capture.get()


def test_the_summary_says_what_matters(tmp_path):
    text = printed(fill(tmp_path / "run", 2))

    for fact in (
        "puma560", "case 1", "akb", "wang-zalzala", "seed 1",
        "0.4269, first in generation 17",
        "0.3806 s; the plan is 12.2% longer", "0.3656 s; the plan is 16.8% longer",
        "2,000 in 0.41 s, 73,000 a second, network overhead 30%",
        "2 workers in a star, 1 lost, 0 individuals condemned",
        "SHA-256 abababababababab",
    ):  # fmt: skip
        assert fact in text


def test_a_failed_check_is_red_and_a_good_one_green(tmp_path):
    lines = printed(fill(tmp_path / "run", 2)).splitlines()

    red, green = "\x1b[1;31m", "\x1b[32m"
    assert any(red in line and "torque over its limit" in line for line in lines)
    assert any(green in line and "open-loop error" in line for line in lines)
    assert any(red in line and "The plan FAILED: joint 1 needs 104.02 %" in line for line in lines)


def test_a_plan_that_passes_every_check_is_said_to(tmp_path):
    folder = fill(tmp_path / "run", 2)
    good = {"name": "torque", "value": 1.0, "limit": 1.001, "passed": True}
    change_result(folder, verification=[good], failures=[])

    assert "The plan passed every check." in printed(folder)


def test_a_replay_through_a_servo_is_summed_up(tmp_path):
    folder = fill(tmp_path / "run", 2)
    tracking = {
        "margin": 0.9, "motion_time_s": 0.41, "error_rad": 0.0109, "error_feed_forward_rad": 0.0029,
    }  # fmt: skip
    servo = {
        "period_ms": 28.0, "bandwidth_rad_s": 80.0, "feed_forward": False, "rms_jerk_rad_s3": [9.0],
        "rms_jerk_ratio": [5.03, 5.04], "peak_command_ratio": [4.9], "tracking": [tracking],
    }  # fmt: skip
    change_result(folder, servo=servo)

    text = printed(folder)

    assert "set-points every 28 ms" in text
    assert "90%     0.4100 s         10.9 mrad           2.9 mrad" in text
    assert "rms jerk: 5.03 to 5.04 times that of 1.75 ms" in text


def test_a_run_that_cannot_be_repeated_is_said_to_be_so(tmp_path):
    folder = fill(tmp_path / "run", 2)
    change_result(folder, reproducible=False)

    assert "not reproducible" in printed(folder)


def test_a_result_with_gaps_is_summed_up_all_the_same(tmp_path):
    folder = fill(tmp_path / "run", 2)
    change_result(folder, motion_time_s=None, verification=None, best={"generation": 3})

    assert "objective  " in printed(folder)


def test_table_2_stands_beside_the_median_of_ours():
    console = Console(file=io.StringIO(), width=80)
    outcomes = [
        CaseOutcome(1, "", (0.42, 0.965, 0.427), (1e-15, 2e-15, 3e-15), (57, 58, 60)),
        CaseOutcome(7, "literal", (0.605,), (0.4,), (2000,)),
    ]

    with console.capture() as capture:
        console.print(paper_table(outcomes))

    text = capture.get()
    assert "0.431  0.4270  0.420–0.965     -0.9%" in text
    assert "7 literal" in text
    assert "+43.7%" in text
    assert "motion times [s]" in text


def test_the_terminal_s_reports_do_not_wait_for_matplotlib():
    script = """
import sys
from tramnet_master import history, progress, run_folder
from tramnet_master.reports import paper_table, summary
print([name for name in ("matplotlib", "pinocchio", "zenoh") if name in sys.modules])
"""
    ended = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )

    assert ended.stdout == "[]\n"
