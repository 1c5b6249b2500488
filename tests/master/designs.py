"""Designs for tests: what the methods of ``crank`` end with, made in this process, and their folders."""

from pathlib import Path

import numpy as np

from tramnet_master.design_results import design_result, write_design
from tramnet_master.experiments.experiment import Common, Timing
from tramnet_master.populations import SearchHistory
from tramnet_master.results import BestFound
from tramnet_master.run_folder import OpenRunFolder
from tramnet_master.spatial_results import spatial_result, write_spatial
from tramnet_workers.evolution.mpga import run_mpga
from tramnet_workers.mpga_settings import SETTINGS, MpgaSettings
from tramnet_workers.problems.bilevel import run_bilevel
from tramnet_workers.problems.design_report import DesignedArm, exact_poses, single_poses
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.progressive import advance, begin
from tramnet_workers.problems.single_design import single_design, single_genetic
from tramnet_workers.problems.spatial_report import SpatialArm
from tramnet_workers.problems.spatial_task import SpatialTask, find_spatial, spatial_stage
from tramnet_workers.problems.steps import Step

RECOMMENDED = SETTINGS["recommended"]
TIMING = Timing(evaluations_per_second=1e6, network_overhead_fraction=0.2)


def common(method: str) -> Common:
    return Common(
        experiment="crank", method=method, case=None, seed=1, population_size=100,
        generations=1000, evaluations=400_000, best=BestFound(0.26, 900), wall_seconds=1.2,
        workers=4, topology="star", lost_workers=0, condemned=[], reproducible=True,
        final_population_sha256="ab" * 32, paper=None, versions={},
    )  # fmt: skip


def designed(
    task: DesignTask, settings: MpgaSettings = RECOMMENDED, seed: int = 1
) -> tuple[DesignedArm, list[SearchHistory]]:
    """Progressive Design and its history."""
    state, histories = begin(task, settings), []
    while state.stage is not None:
        found = run_mpga(state.stage.problem, state.stage.genetic, seed, stream=state.stream)
        lengths = found.traits[:, :, : task.n_links]
        histories.append(
            SearchHistory(state.stage.step, state.returns, found.best, found.mean, lengths)
        )
        state = advance(state, found.final_traits)
    return DesignedArm.after(state.task, state.outcome), histories


def by_bilevel(task: DesignTask) -> DesignedArm:
    """What CMA-ES ends with."""
    found = run_bilevel(task, 50_000 * len(task.stations), seed=1)
    poses = exact_poses(task, np.array(found.lengths), np.array(found.base))
    return DesignedArm.at_points(task, RECOMMENDED, poses)


def by_single_ga(task: DesignTask) -> tuple[DesignedArm, list[SearchHistory]]:
    """What one population with all variables ends with."""
    genetic = single_genetic(task, RECOMMENDED, 50_000 * len(task.stations))
    found = run_mpga(single_design(task, RECOMMENDED), genetic, seed=1)
    poses = single_poses(task, found.final_traits[0])
    history = SearchHistory(Step.DESIGN, 0, found.best, found.mean, found.traits[:, :, :3])
    return DesignedArm.at_points(task, RECOMMENDED, poses), [history]


def spatial() -> tuple[SpatialArm, list[SearchHistory]]:
    """A spatial arm for the upright circle."""
    task = SpatialTask()
    stage = spatial_stage(task, RECOMMENDED)
    found = run_mpga(stage.problem, stage.genetic, seed=1)
    history = SearchHistory(stage.step, 0, found.best, found.mean, found.traits[:, :, :2])
    return SpatialArm(task, find_spatial(task, RECOMMENDED, found.final_traits)), [history]


def fill(folder: Path, design: DesignedArm, histories: list[SearchHistory], method: str) -> Path:
    """Write a finished run of a planar design."""
    with OpenRunFolder.create(folder, {"experiment": "crank"}) as run:
        write_design(folder, design, histories)
        run.write_result(design_result(common(method), TIMING, design, "recommended"))
    return folder


def fill_spatial(folder: Path, arm: SpatialArm, histories: list[SearchHistory]) -> Path:
    """Write a finished run of a spatial design."""
    with OpenRunFolder.create(folder, {"experiment": "crank"}) as run:
        write_spatial(folder, arm, histories)
        run.write_result(spatial_result(common("mpga"), TIMING, arm, "recommended"))
    return folder
