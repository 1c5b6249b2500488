"""Resolved-rate control with ascent of the clearance, against difference quotients and pseudo-inverses."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tramnet_workers.problems.line_tracking import track
from tramnet_workers.problems.tracking_report import Summary, report_points, summarise
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.tracking_methods import ResolvedRate

Array = NDArray[np.float64]

PAPER = TrackingTask.of_paper()
PLAIN = ResolvedRate(ascent=0.0, corrections=0)


def follow(task: TrackingTask, method: ResolvedRate) -> Summary:
    run = track(task, method, 1, task.n_steps + 1, task.start)
    path = np.vstack([task.start, run.path])
    return summarise(task, path, report_points(task, path))


def jacobian(task: TrackingTask, q: Array) -> Array:
    """Return the derivative of the tip by difference quotients, of shape (3, 8) [cm/rad]."""
    step = 1e-6 * np.eye(8)
    tips = task.chain.points(np.vstack([q + step, q - step]))[:, -1]
    return ((tips[:8] - tips[8:]) / 2e-6).T


def test_a_step_without_ascent_is_the_pseudo_inverse_s() -> None:
    step = track(PAPER, PLAIN, 1, 2, PAPER.start).path[0] - PAPER.start

    missing = PAPER.path[1] - PAPER.chain.points(PAPER.start[None])[0, -1]
    expected = np.linalg.pinv(jacobian(PAPER, PAPER.start)) @ missing
    np.testing.assert_allclose(step, expected, atol=1e-9)


def test_the_ascent_moves_the_arm_away_and_not_the_tip() -> None:
    J = jacobian(PAPER, PAPER.start)
    gentle = replace(PLAIN, ascent=0.01)

    change = (
        track(PAPER, gentle, 1, 2, PAPER.start).path[0]
        - track(PAPER, PLAIN, 1, 2, PAPER.start).path[0]
    )

    reports = report_points(PAPER, np.stack([PAPER.start, PAPER.start + change]))
    assert np.linalg.norm(J @ change) < 1e-6 * np.linalg.norm(J) * np.linalg.norm(change)
    assert reports.clearance[1] > reports.clearance[0]


def test_the_ascent_follows_the_gradient_of_the_clearance() -> None:
    step = 1e-6 * np.eye(8)
    around = report_points(PAPER, np.vstack([PAPER.start + step, PAPER.start - step]))
    gradient = (around.clearance[:8] - around.clearance[8:]) / 2e-6
    J = jacobian(PAPER, PAPER.start)
    expected = gradient - np.linalg.pinv(J) @ (J @ gradient)
    sharp = replace(PLAIN, ascent=0.01, sharpness=100)

    change = (
        track(PAPER, sharp, 1, 2, PAPER.start).path[0]
        - track(PAPER, PLAIN, 1, 2, PAPER.start).path[0]
    )

    cosine = change @ expected / np.linalg.norm(change) / np.linalg.norm(expected)
    assert cosine > 0.9999


def test_without_a_second_task_the_arm_collides() -> None:
    summary = follow(PAPER, PLAIN)

    assert summary.clearance_min == 0.0
    assert summary.error_max < 1e-4
    assert np.degrees(summary.step_max) == pytest.approx(0.101, abs=0.001)


@pytest.mark.parametrize(("height", "clearance"), [(0.0, 9.8), (5.0, 5.0)])
def test_with_ascent_the_arm_keeps_its_distance(height: float, clearance: float) -> None:
    task = TrackingTask.of_paper(height)

    summary = follow(task, ResolvedRate())

    assert summary.clearance_min_settled >= clearance
    assert summary.error_mean < 1e-3
    assert summary.points_outside_zone == 0
    assert summary.step_max <= task.step.max()


def test_the_arm_does_not_tremble() -> None:
    # A constant gain along the gradient of the nearest link alone is 0.26 degrees rough.
    assert np.degrees(follow(PAPER, ResolvedRate()).roughness) < 0.005


def test_without_boxes_there_is_nothing_to_move_away_from() -> None:
    task = TrackingTask.for_arm(PAPER.arm, PAPER.start, PAPER.path)

    np.testing.assert_array_equal(
        track(task, ResolvedRate(corrections=0), 1, 101, task.start).path,
        track(task, PLAIN, 1, 101, task.start).path,
    )


def test_a_path_may_be_cut_into_runs_anywhere() -> None:
    whole = track(PAPER, ResolvedRate(), 1, 101, PAPER.start)

    head = track(PAPER, ResolvedRate(), 1, 38, PAPER.start)
    tail = track(PAPER, ResolvedRate(), 38, 101, head.path[-1])

    np.testing.assert_array_equal(np.vstack([head.path, tail.path]), whole.path)
