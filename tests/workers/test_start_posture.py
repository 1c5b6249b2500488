"""Postures with the tip where a path begins."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_workers.problems.start_posture import find_start
from tramnet_workers.problems.tracking_report import report_points
from tramnet_workers.problems.tracking_task import TrackingTask

PAPER = TrackingTask.of_paper()


@given(st.lists(st.floats(-0.4, 0.4), min_size=8, max_size=8))
def test_any_place_that_a_near_posture_reaches_is_found(turns: list[float]) -> None:
    point = PAPER.chain.points(PAPER.start[None] + np.array(turns))[0, -1]

    found = find_start(PAPER.arm, PAPER.start, point)

    assert found is not None
    np.testing.assert_allclose(PAPER.chain.points(found[None])[0, -1], point, atol=1e-3)


def test_a_tip_that_is_there_stays_there() -> None:
    tip = PAPER.chain.points(PAPER.start[None])[0, -1]

    found = find_start(PAPER.arm, PAPER.start, tip)

    np.testing.assert_array_equal(found, PAPER.start)


def test_out_of_reach_there_is_no_posture() -> None:
    assert find_start(PAPER.arm, PAPER.start, np.array([0.0, 300.0, 0.0])) is None


def test_the_joints_keep_to_their_ranges() -> None:
    limit = np.radians(100.0)
    arm = replace(PAPER.arm, position_lower=np.full(8, -limit), position_upper=np.full(8, limit))

    found = find_start(arm, np.full(8, 3.0), PAPER.path[400])

    assert found is None or np.abs(found).max() <= limit


def test_boxes_are_kept_away_from() -> None:
    point = PAPER.path[600]

    clearance = [
        report_points(
            TrackingTask.for_arm(PAPER.arm, q, [point, point + 0.01], boxes=PAPER.boxes), q[None]
        ).clearance[0]
        for q in (
            find_start(PAPER.arm, PAPER.start, point),
            find_start(PAPER.arm, PAPER.start, point, PAPER.boxes),
        )
        if q is not None
    ]

    assert len(clearance) == 2
    assert clearance[1] > clearance[0]
    assert clearance[1] > 5.0


@pytest.mark.parametrize("near", [0.0, 0.3])
def test_the_search_may_begin_anywhere(near: float) -> None:
    found = find_start(PAPER.arm, np.full(8, near), PAPER.path[0])

    if found is not None:
        tip = PAPER.chain.points(found[None])[0, -1]
        np.testing.assert_allclose(tip, PAPER.path[0], atol=1e-3)
