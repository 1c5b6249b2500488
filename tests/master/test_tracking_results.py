"""What ``result.json`` says of followed paths."""

import msgspec
import numpy as np
import pytest

from tramnet_master.experiments.experiment import Common, Timing
from tramnet_master.results import BestFound, read_result, write_result
from tramnet_master.tracking_files import Scene
from tramnet_master.tracking_results import (
    NetworkCost,
    TrackingResult,
    tracked_scene,
    tracking_result,
)
from tramnet_master.tracking_times import follow
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.tracking_methods import ResolvedRate

COMMON = Common(
    experiment="redundant8", method="resolved-rate", case=1, seed=1, population_size=1,
    generations=300, evaluations=300, best=BestFound(0.03, 1), wall_seconds=0.9, workers=2,
    topology="star", lost_workers=0, condemned=[], reproducible=True,
    final_population_sha256="ab" * 32, paper=None, versions={},
)  # fmt: skip
TIMING = Timing(evaluations_per_second=333.0, network_overhead_fraction=0.4)
NETWORK = NetworkCost(0.5, 12, [0.1, 0.05], "one worker is the faster choice")

PAPER = TrackingTask.of_paper(n_steps=300)
BARE = TrackingTask.for_arm(PAPER.arm, PAPER.start, PAPER.path)
NARROW = TrackingTask.for_arm(
    PAPER.arm, PAPER.start, PAPER.path, boxes=[*PAPER.boxes, [30, 50, 30, 40, 60, 40]], zone=0.06
)
FOLLOWED = follow(PAPER, ResolvedRate(), 1, 301, PAPER.start)


def result_of(*scenes: Scene) -> TrackingResult:
    paths = [FOLLOWED] * len(scenes)
    return tracking_result(COMMON, TIMING, scenes, paths, 0.45, NETWORK)


def test_a_result_has_the_figures_of_its_path():
    result = result_of(Scene("", PAPER))

    assert (result.ms_per_step.compute, result.ms_per_step.total) == (1.5, 3.0)
    assert 0.0 < result.tracking_error_mean_cm < result.tracking_error_max_cm < 0.1
    assert 2.0 < result.clearance_min_cm < result.clearance_min_after_50_cm
    assert result.points_outside_zone == 0
    assert result.max_step_deg == pytest.approx(np.degrees(np.abs(np.diff(FOLLOWED, axis=0)).max()))
    assert result.roughness_deg > 0.0
    assert result.network == NETWORK


def test_a_result_of_several_scenes_has_the_worst_of_each_figure():
    off = FOLLOWED + np.radians(0.2)
    scenes = (Scene("a", PAPER), Scene("b", NARROW), Scene("c", BARE))

    result = tracking_result(COMMON, TIMING, scenes, (FOLLOWED, off, FOLLOWED), 0.45, NETWORK)

    assert [row.name for row in result.scenes] == ["a", "b", "c"]
    assert result.scenes[1] == tracked_scene(Scene("b", NARROW), off)
    assert result.tracking_error_max_cm == result.scenes[1].tracking_error_max_cm
    assert result.tracking_error_mean_cm == result.scenes[1].tracking_error_mean_cm
    assert result.points_outside_zone == result.scenes[1].points_outside_zone > 0
    assert result.clearance_min_cm == min(row.clearance_min_cm for row in result.scenes[:2])
    assert result.ms_per_step.total == pytest.approx(1.0)


def test_without_boxes_there_is_no_clearance():
    result = result_of(Scene("", BARE))

    assert result.clearance_min_cm is result.clearance_min_after_50_cm is None
    assert result.scenes[0].clearance_min_cm is None


def test_on_a_short_path_there_is_no_clearance_after_fifty_points():
    short = TrackingTask.of_paper(n_steps=40)

    result = tracked_scene(Scene("", short), follow(short, ResolvedRate(), 1, 41, short.start))

    assert result.clearance_min_cm is not None
    assert result.clearance_min_after_50_cm is None


def test_a_result_file_has_null_where_there_is_no_clearance(tmp_path):
    result = result_of(Scene("", BARE))

    write_result(tmp_path / "result.json", result)

    found = read_result(tmp_path / "result.json")
    assert found["clearance_min_cm"] is None
    assert found["ms_per_step"] == {"compute": 1.5, "total": 3.0}
    assert found["network"] == msgspec.to_builtins(NETWORK)
    assert msgspec.convert(found, TrackingResult) == result
