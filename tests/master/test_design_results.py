import csv
import json
from pathlib import Path

import msgspec
import numpy as np
import pytest
from tests.master.designs import (
    TIMING,
    by_bilevel,
    by_single_ga,
    common,
    designed,
    fill,
    fill_spatial,
    spatial,
)

from tramnet_master.csv_tables import read_table
from tramnet_master.design_results import design_result, write_design
from tramnet_master.populations import read_populations
from tramnet_master.run_folder import OpenRunFolder
from tramnet_workers.kernels.design import DM
from tramnet_workers.problems.checks import LIMITS
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.stock import Stock
from tramnet_workers.problems.variants import mobile_base, prismatic
from tramnet_workers.robots.pinocchio_bridge import arm_from_urdf, tool_position

FILES = {"arm.urdf", "arm_dh.csv", "design.json", "motion.csv", "populations.csv", "violations.csv"}


@pytest.fixture(scope="module")
def crank():
    return designed(DesignTask())


@pytest.fixture(scope="module")
def folder(crank, tmp_path_factory) -> Path:
    return fill(tmp_path_factory.mktemp("crank") / "run", *crank, "mpga")


@pytest.fixture(scope="module")
def short():
    """An arm that cannot reach what it should."""
    return designed(DesignTask(stock=Stock.of_lengths([0.2]), most_returns=0))


def design_of(folder: Path):
    return json.loads((folder / "design.json").read_text())


def rows_of(path: Path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_a_design_leaves_all_its_files(folder):
    assert {path.name for path in folder.iterdir()} >= FILES


def test_the_exported_arm_reaches_every_station_in_pinocchio(folder):
    design, arm = design_of(folder), arm_from_urdf(folder / "arm.urdf")

    assert len(design["points"]) >= 20
    for point in design["points"]:
        reached = tool_position(arm, np.array(point["pose_rad"]))
        assert reached[:2] == pytest.approx(point["point_m"], abs=1e-3)
        assert reached[2] == pytest.approx(0.0, abs=1e-12)


def test_a_spatial_arm_reaches_every_task_point_in_pinocchio(tmp_path):
    folder = fill_spatial(tmp_path, *spatial())
    design, arm = design_of(folder), arm_from_urdf(folder / "arm.urdf")

    assert arm.n_joints == 6
    for point in design["points"]:
        reached = tool_position(arm, np.array(point["pose_rad"]))
        assert reached == pytest.approx(point["point_m"], abs=1e-3)
    table = rows_of(folder / "arm_dh.csv")
    assert [float(row["a_m"]) for row in table][1] == design["link_lengths_m"][0]
    assert [float(row["d_m"]) for row in table][3] == design["link_lengths_m"][1]


def test_the_table_of_the_arm_has_its_links_and_limits(folder):
    table = rows_of(folder / "arm_dh.csv")

    assert [row["joint"] for row in table] == ["joint1", "joint2", "joint3"]
    assert [float(row["a_m"]) for row in table] == design_of(folder)["link_lengths_m"]
    assert [float(row["lower_rad"]) for row in table] == list(DesignTask().lower)


def test_every_point_says_its_pose_its_dexterity_and_each_constraint(crank, folder):
    design, terms = design_of(folder), crank[0].terms

    for point, row in zip(design["points"], terms, strict=True):
        assert set(point["constraints"]) == {"tc", "rc", "hc", "jlc", "lc", "bpc", "jac"}
        assert point["dexterity"] == row[DM]
        assert len(point["pose_rad"]) == 3
        assert point["to_next"]["end_error_rad"] <= LIMITS["end"]
    at_points = [point["dexterity"] for point in design["points"] if point["task_point"]]
    assert design["dexterity_mean"] == pytest.approx(np.mean(at_points))


def test_the_motion_goes_along_the_path_and_through_every_pose(crank, folder):
    motion, poses = read_table(folder / "motion.csv"), crank[0].poses
    starts = np.flatnonzero(np.diff(motion["interval"], prepend=0))

    assert motion["error_m"].max() <= LIMITS["rc"]
    np.testing.assert_allclose(motion["station"][starts], poses.stations)
    for k in range(3):
        np.testing.assert_allclose(motion[f"q{k + 1}_rad"][starts], poses.joints[:, k])
    centre, radius = np.array([0.8, 0.4]), 0.25
    distance = np.hypot(motion["x_m"] - centre[0], motion["y_m"] - centre[1])
    np.testing.assert_allclose(distance, radius, atol=1e-3)
    assert motion["station"][-1] == pytest.approx(1.0)


def test_the_history_of_every_search_is_kept(crank, folder):
    searches = read_populations(folder / "populations.csv")

    assert [search.stage for search in searches] == [1, 2, 3]
    np.testing.assert_array_equal(searches[0].best, crank[1][0].best)


def test_a_result_measures_the_arm_against_the_best_one(crank):
    result = design_result(common("mpga"), TIMING, crank[0], "recommended")

    assert result.verified
    assert result.violations == {}
    assert result.quality.dexterity_optimum == pytest.approx(0.27455, abs=2e-5)
    assert result.quality.optimal_lengths_m == pytest.approx([0.4626] * 3, abs=1e-3)
    assert 0.97 < result.quality.designed <= 1.0
    assert 0.9 < result.quality.built <= 1.0
    assert result.link_spread_m < 3e-3
    assert (result.task_points, result.stations) == (4, 20)
    assert msgspec.json.decode(msgspec.json.encode(result))["paper"] is None


def test_what_fails_stands_in_the_table_of_violations(short, tmp_path):
    folder = fill(tmp_path, *short, "mpga")
    result, rows = (
        json.loads((folder / "result.json").read_text()),
        rows_of(folder / "violations.csv"),
    )

    assert not result["verified"]
    assert sum(result["violations"].values()) == len(rows)
    reach = [row for row in rows if row["constraint"] == "rc"]
    assert {row["unit"] for row in reach} == {"m"}
    # 1.12 m to the first point, for an arm of 0.6 m.
    assert max(float(row["found"]) for row in reach) > 0.5
    first = design_of(folder)["points"][0]
    assert "rc" in first["fails"]


def test_a_method_without_planning_leaves_out_what_it_does_not_know(tmp_path):
    folder = fill(tmp_path, by_bilevel(DesignTask()), [], "bilevel-cma")
    result, design = json.loads((folder / "result.json").read_text()), design_of(folder)

    assert not (folder / "motion.csv").exists()
    assert not (folder / "populations.csv").exists()
    for key in ("returns", "link_spread_m", "elbow_agreement", "end_error_max_rad"):
        assert result[key] is None
    assert result["designed_lengths_m"] is None
    assert result["quality"]["built"] == pytest.approx(1.0, abs=1e-4)
    assert design["dexterity_mean"] == pytest.approx(0.27455, abs=2e-5)
    arm = arm_from_urdf(folder / "arm.urdf")
    for point in design["points"]:
        reached = tool_position(arm, np.array(point["pose_rad"]))
        assert reached[:2] == pytest.approx(point["point_m"], abs=1e-9)
        assert point["to_next"] is None


def test_one_population_with_all_variables_leaves_a_design_too(tmp_path):
    design, histories = by_single_ga(DesignTask())
    folder = fill(tmp_path, design, histories, "single-ga")

    (search,) = read_populations(folder / "populations.csv")
    assert search.best.shape[1] == 1
    arm = arm_from_urdf(folder / "arm.urdf")
    for point in design_of(folder)["points"]:
        reached = tool_position(arm, np.array(point["pose_rad"]))
        assert reached[:2] == pytest.approx(point["point_m"], abs=1e-6)


@pytest.mark.parametrize("variant", [prismatic, mobile_base])
def test_of_an_arm_that_is_not_fixed_no_optimum_is_known(variant, tmp_path):
    design, histories = designed(variant(DesignTask()))

    assert design_result(common("mpga"), TIMING, design, "recommended").quality is None
    write_design(tmp_path, design, histories)
    assert {path.name for path in tmp_path.iterdir()} >= FILES


def test_a_single_point_has_a_pose_and_no_motion(tmp_path):
    design, histories = designed(DesignTask(stations=(0.0,)))

    write_design(tmp_path, design, histories)

    assert not (tmp_path / "motion.csv").exists()
    assert len(design_of(tmp_path)["points"]) == 1


def test_a_new_run_takes_away_what_an_old_design_left(crank, tmp_path):
    fill(tmp_path, *crank, "mpga")
    (tmp_path / "fitness.png").write_bytes(b"old")
    (tmp_path / "mine.csv").write_text("x\n1\n")

    OpenRunFolder.create(tmp_path, {"experiment": "crank"}, overwrite=True).close()

    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"mine.csv", "run.toml", "log.jsonl"}
