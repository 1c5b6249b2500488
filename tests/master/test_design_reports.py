import io
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Rectangle
from rich.console import Console
from tests.master.designs import by_bilevel, designed, fill, fill_spatial, spatial

from tramnet_master.errors import DamagedFile
from tramnet_master.reports.arm_poses import (
    draw_dexterity,
    draw_planned_poses,
    draw_task_poses,
)
from tramnet_master.reports.arm_shapes import arm_shape
from tramnet_master.reports.configurations import draw_configurations, draw_null_motion
from tramnet_master.reports.constraint_chart import CONSTRAINTS, draw_constraints
from tramnet_master.reports.design_record import DesignRecord
from tramnet_master.reports.evolution import draw_fitness, draw_total_length
from tramnet_master.reports.figures import write_figures
from tramnet_master.reports.method_table import MethodOutcome, claims, method_table
from tramnet_master.reports.style import one_look, save
from tramnet_master.reports.summary import print_summary
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.stock import Stock
from tramnet_workers.problems.variants import prismatic, workspace

OF_A_CRANK = {"fitness", "total_length", "task_poses", "planned_poses", "configurations",
              "null_motion", "constraints"}  # fmt: skip
BOX = (-0.3, 0.5, -0.1, 0.6)


@pytest.fixture(scope="module", autouse=True)
def look():
    with one_look():
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return fill(tmp_path_factory.mktemp("crank") / "run", *designed(DesignTask()), "mpga")


@pytest.fixture(scope="module")
def record(folder) -> DesignRecord:
    return DesignRecord.read(folder)


@pytest.fixture(scope="module")
def failing(tmp_path_factory) -> Path:
    """An arm of 0.6 m for points up to 1.12 m away."""
    task = DesignTask(stock=Stock.of_lengths([0.2]), boxes=(BOX,), most_returns=0)
    return fill(tmp_path_factory.mktemp("failing") / "run", *designed(task), "mpga")


@pytest.fixture(scope="module")
def spatial_record(tmp_path_factory) -> DesignRecord:
    return DesignRecord.read(fill_spatial(tmp_path_factory.mktemp("spatial") / "run", *spatial()))


def named(axes, name):
    return [line for line in axes.get_lines() if line.get_label() == name]


def printed(folder: Path) -> str:
    text = io.StringIO()
    print_summary(folder, Console(file=text, width=100))
    return text.getvalue()


def test_figures_are_drawn_from_the_files_of_the_folder_alone_and_the_same_again(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "copy")

    written = write_figures(copy)

    assert {path.name for path in written} == {
        f"{name}.{kind}" for name in OF_A_CRANK for kind in ("png", "svg")
    }
    first = (copy / "task_poses.svg").read_bytes()
    save(draw_task_poses(DesignRecord.read(copy)), copy, "task_poses")
    assert (copy / "task_poses.svg").read_bytes() == first


def test_a_method_without_populations_has_the_figures_that_are_left(tmp_path):
    written = write_figures(fill(tmp_path, by_bilevel(DesignTask()), [], "bilevel-cma"))

    assert {path.stem for path in written} == {"task_poses", "constraints"}


def test_fitness_has_a_panel_a_step_and_a_curve_a_population(record):
    panels = draw_fitness(record).axes

    assert [panel.get_title(loc="left").partition(",")[0] for panel in panels] == [
        "design", "prototype", "planning",
    ]  # fmt: skip
    curves = [line for line in panels[0].get_lines() if line.get_label().startswith("point")]
    for i, line in enumerate(curves):
        np.testing.assert_array_equal(line.get_ydata(), record.searches[0].best[:, i])
    assert len(curves) == 4


def test_total_length_says_how_far_the_populations_are_apart(record):
    (axes,) = draw_total_length(record).axes

    apart = np.ptp(record.searches[0].total_length[-1])
    assert axes.get_title(loc="right") == f"at the end {1e3 * apart:.3g} mm apart"


@pytest.mark.parametrize("task", [DesignTask(), prismatic(DesignTask())], ids=["crank", "stroke"])
def test_the_arm_that_is_drawn_ends_at_its_points(task, tmp_path):
    design = DesignRecord.read(fill(tmp_path, *designed(task), "mpga")).design

    for point in design.points:
        assert arm_shape(design, point)[-1] == pytest.approx(point.point_m, abs=1e-9)


def test_a_spatial_arm_is_drawn_in_perspective_and_ends_at_its_points(spatial_record):
    design = spatial_record.design
    (axes,) = draw_task_poses(spatial_record).axes

    assert axes.name == "3d"
    for point in design.points:
        assert arm_shape(design, point)[-1] == pytest.approx(point.point_m, abs=1e-9)


def test_poses_stand_on_the_path_with_task_points_told_apart(record):
    (axes,) = draw_planned_poses(record).axes

    task, between = named(axes, "task point")[0], named(axes, "sub-task point")[0]
    assert (len(task.get_xdata()), len(between.get_xdata())) == (4, 16)
    assert len(named(axes, "path")[0].get_xdata()) > 100
    assert len(named(axes, "arm")) == 4
    assert axes.get_aspect() == 1.0


def test_obstacles_are_drawn_and_arms_that_violate_limits_stand_out(failing):
    (axes,) = draw_task_poses(DesignRecord.read(failing)).axes

    (box,) = (patch for patch in axes.patches if isinstance(patch, Rectangle))
    assert (*box.get_xy(), box.get_width(), box.get_height()) == pytest.approx(
        (-0.3, 0.5, 0.2, 0.1)
    )
    assert len(named(axes, "arm, a limit violated")) >= 2


def test_configurations_show_the_motion_through_every_pose(record):
    assert record.motion is not None
    panels = draw_configurations(record, record.motion).axes

    assert len(panels) == 5  # three joints, and two pairs of neighbours
    for k, panel in enumerate(panels[:3]):
        (control,), (planning,) = named(panel, "control"), named(panel, "planning")
        for x, y in zip(planning.get_xdata(), planning.get_ydata(), strict=True):
            on_curve = np.interp(x, control.get_xdata(), control.get_ydata())
            assert y == pytest.approx(on_curve, abs=2e-3), k


def test_null_motion_is_drawn_interval_by_interval(record):
    assert record.motion is not None
    (axes,) = draw_null_motion(record, record.motion).axes

    assert len(named(axes, "null-space step")) == 20


def test_the_chart_marks_exactly_what_fails(failing):
    record = DesignRecord.read(failing)
    figure = draw_constraints(record)

    (image,) = figure.axes[0].get_images()
    failed = np.asarray(image.get_array(), dtype=bool)
    for row, name in enumerate(CONSTRAINTS):
        fails = [name in point.fails for point in record.design.points]
        assert failed[row].tolist() == fails
    assert failed.any()


def test_a_workspace_is_a_map_of_dexterity(tmp_path):
    task = replace(workspace(DesignTask()), stations=tuple(range(0, 81, 4)))
    record = DesignRecord.read(fill(tmp_path, *designed(task), "mpga"))

    reached, missed = draw_dexterity(record).axes[0].collections[:2]

    count = sum("rc" in point.fails for point in record.design.points)
    assert len(missed.get_offsets()) == count > 0
    assert len(reached.get_offsets()) == len(record.design.points) - count


def test_a_design_that_is_torn_is_damaged(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "copy")
    text = (copy / "design.json").read_text()
    (copy / "design.json").write_text(text.replace('"pose_rad"', '"pose_deg"', 1))

    with pytest.raises(DamagedFile, match=r"design\.json.*pose_rad"):
        write_figures(copy)


def test_a_summary_tells_the_arm_and_what_it_is_worth(folder):
    text = printed(folder)

    for name in (
        "links",
        "of the optimum",
        "link lengths",
        "100% of the elbows agree",
        "to step 1",
    ):
        assert name in text
    assert "0.4622, 0.4622, 0.4622 m, 0.2746" in text
    assert "The arm keeps every limit at all its points." in text
    for word in ("place [m]", "RC [mm]", "JAC [rad]"):
        assert word in text
    assert text.count("0.8, 0.65") == 1


def test_a_summary_tells_what_fails(failing):
    text = printed(failing)

    assert "The arm violates limits: " in text
    assert "rc " in text.partition("violates limits")[2]
    assert "which knows no obstacles" in text


def outcomes() -> list[MethodOutcome]:
    return [
        MethodOutcome("mpga", 4, (0.98, 0.99), (0.4, 0.4)),
        MethodOutcome("bilevel-cma", 4, (1.0, 1.0), (0.1, 0.1)),
        MethodOutcome("mpga", 128, (0.985,), (16.0,)),
        MethodOutcome("single-ga", 128, (0.93,), (10.0,)),
        MethodOutcome("bilevel-cma", 128, (0.98,), (2.0,)),
    ]


def test_methods_stand_side_by_side_with_the_cost_of_a_population():
    text = io.StringIO()
    Console(file=text, width=80).print(method_table(outcomes(), 100_000))
    lines = [line.split() for line in text.getvalue().splitlines()]

    row = ["4", "0.9850", "(0.9800)", "1.0000", "(1.0000)", "0.4,", "-,", "0.1", "100.0"]
    assert row in lines
    assert "100,000 for each task point" in text.getvalue()


def test_claims_are_counted_from_the_rows():
    assert claims(outcomes()) == (
        "Dearest population over cheapest: 1.25; the paper says constant.\n"
        "CMA-ES on the links alone is ahead of mpga in 1 of 2 rows."
    )
