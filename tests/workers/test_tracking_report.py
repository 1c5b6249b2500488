"""Reports of followed paths: small ones that can be checked by hand."""

import numpy as np
import pytest

from tramnet_workers.problems.tracking_report import report_points, summarise
from tramnet_workers.problems.tracking_task import TrackingTask

PAPER = TrackingTask.of_paper()
AT_START = PAPER.start[None]


def test_the_start_is_two_centimetres_from_the_obstacle() -> None:
    report = report_points(PAPER, AT_START)

    # Link 5, from P6 to the tip, runs beside the side x = 15.
    assert report.clearance[0] == pytest.approx(2.0, abs=1e-6)
    assert (report.nearest_link[0], report.nearest_box[0]) == (5, 1)
    assert report.error[0] == pytest.approx(0.0557, abs=1e-3)
    assert report.step[0] == 0.0


def test_the_radius_of_the_links_is_taken_off() -> None:
    thick = TrackingTask.for_arm(PAPER.arm, PAPER.start, PAPER.path, boxes=PAPER.boxes, radius=1.5)

    assert report_points(thick, AT_START).clearance[0] == pytest.approx(0.5, abs=1e-6)


def test_links_that_overlap_a_box_have_no_clearance() -> None:
    thick = TrackingTask.for_arm(PAPER.arm, PAPER.start, PAPER.path, boxes=PAPER.boxes, radius=3.0)

    assert report_points(thick, AT_START).clearance[0] == 0.0


def test_the_nearest_of_several_boxes_is_named() -> None:
    near = PAPER.chain.points(AT_START)[0, 4] + np.array([0.5, 0.5, 0.5])
    task = TrackingTask.for_arm(
        PAPER.arm, PAPER.start, PAPER.path, boxes=[PAPER.boxes[0], [*near, *(near + 1.0)]]
    )

    report = report_points(task, AT_START)

    assert report.nearest_box[0] == 2
    assert report.clearance[0] < 1.0


def test_without_boxes_nothing_is_near() -> None:
    task = TrackingTask.for_arm(PAPER.arm, PAPER.start, PAPER.path)

    report = report_points(task, AT_START)

    assert report.clearance[0] == np.inf
    assert (report.nearest_link[0], report.nearest_box[0]) == (0, 0)


def test_a_summary_sums_up_steps_and_errors() -> None:
    steps = np.zeros((4, 8))
    steps[:, 2] = 0.001, 0.003, -0.001, 0.0
    path = PAPER.start + np.vstack([np.zeros(8), np.cumsum(steps, axis=0)])
    report = report_points(PAPER, path)

    summary = summarise(PAPER, path, report)

    assert summary.step_max == pytest.approx(0.003)
    assert summary.roughness == pytest.approx((0.002 + 0.004 + 0.001) / 3 / 8)
    assert summary.error_max == report.error[1:].max()
    assert summary.clearance_min == report.clearance[1:].min()
    assert summary.clearance_min_settled == np.inf
    assert summary.points_outside_zone == np.count_nonzero(report.error[1:] > 0.1)


def test_a_block_down_to_the_floor_has_the_line_itself_inside() -> None:
    floor = TrackingTask.of_paper(height=50.0)

    inside = (floor.path >= floor.boxes[0, :3]) & (floor.path <= floor.boxes[0, 3:])

    assert inside.all(axis=1).nonzero()[0][[0, -1]].tolist() == [334, 809]
