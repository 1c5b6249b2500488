"""Evolution with local search: what it adds to evolution, and what it reaches."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.kernels.differential import correct_step, new_tangent
from tramnet_workers.kernels.tracking import evaluate_steps, new_stage, set_stage
from tramnet_workers.problems.line_tracking import track
from tramnet_workers.problems.tracking_report import Summary, report_points, summarise
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.tracking_evolution import Memetic

Array = NDArray[np.float64]

PAPER = TrackingTask.of_paper()


def follow(task: TrackingTask, method: Memetic) -> Summary:
    run = track(task, method, 1, task.n_steps + 1, task.start)
    path = np.vstack([task.start, run.path])
    return summarise(task, path, report_points(task, path))


def corrected(dq: Array, n_corrections: int) -> tuple[Array, float]:
    """Return a step after corrections, and its cost."""
    scene, q = PAPER.scene(1.0), PAPER.start.copy()
    stage, result = new_stage(scene), dq.copy()
    set_stage(scene, 1, q, stage)
    cost = correct_step(scene, stage, q, n_corrections, new_tangent(8), result)
    return result, cost


def error(dq: Array) -> float:
    tip = PAPER.chain.points((PAPER.start + dq)[None])[0, -1]
    return float(np.linalg.norm(tip - PAPER.path[1]))


steps = st.lists(st.floats(-0.008, 0.008), min_size=8, max_size=8).map(np.array)


@given(steps)
def test_a_corrected_step_keeps_the_limits_and_misses_by_less(dq: Array) -> None:
    result, _ = corrected(dq, 2)

    assert (np.abs(result) <= PAPER.step).all()
    assert error(result) <= error(dq) + 1e-9


@given(steps)
def test_corrections_far_from_the_limits_converge_quadratically(dq: Array) -> None:
    errors = [error(corrected(dq / 10.0, n)[0]) for n in (0, 1, 2)]

    assert errors[1] <= 0.01 * errors[0] + 1e-12
    assert errors[2] <= 0.01 * errors[1] + 1e-12


@given(steps)
def test_the_cost_told_is_that_of_the_corrected_step(dq: Array) -> None:
    result, cost = corrected(dq, 2)

    again = evaluate_steps(PAPER.scene(1.0), 1, PAPER.start.copy(), result[None].copy())[0]
    np.testing.assert_allclose(cost, again, rtol=1e-9)


def test_a_joint_at_its_limit_leaves_the_work_to_the_others() -> None:
    arm = replace(PAPER.arm, position_lower=PAPER.start - 1e-9, position_upper=np.full(8, np.inf))
    task = TrackingTask.for_arm(arm, PAPER.start, PAPER.path, boxes=PAPER.boxes)

    run = track(task, Memetic(seed=1), 1, 31, task.start)

    assert (run.path >= arm.position_lower).all()
    tips = task.chain.points(run.path)[:, -1]
    assert np.linalg.norm(tips - task.path[1:31], axis=1).max() < 0.1


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5, 6, 7, 8])
def test_the_paper_s_line_is_followed_exactly_and_far_from_the_obstacle(seed: int) -> None:
    summary = follow(PAPER, Memetic(seed=seed))

    assert summary.error_max <= 1e-4
    assert summary.clearance_min_settled >= 8.0
    assert summary.points_outside_zone == 0
    assert summary.step_max <= PAPER.step.max()


def test_a_thicker_obstacle_is_passed_as_well() -> None:
    summary = follow(TrackingTask.of_paper(height=5.0), Memetic(seed=1))

    assert summary.error_max <= 1e-4
    assert summary.clearance_min_settled >= 5.0


@given(st.sets(st.integers(2, 30), max_size=4))
def test_a_path_may_be_cut_into_runs_anywhere(cuts: set[int]) -> None:
    method = Memetic(seed=2)
    whole = track(PAPER, method, 1, 31, PAPER.start)

    posture, pieces = PAPER.start, []
    ends = [1, *sorted(cuts), 31]
    for first, last in pairwise(ends):
        pieces.append(track(PAPER, method, first, last, posture).path)
        posture = pieces[-1][-1]

    np.testing.assert_array_equal(np.vstack(pieces), whole.path)
