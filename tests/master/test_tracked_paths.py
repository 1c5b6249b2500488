"""Files of followed paths: what stands in them, and that it reads back."""

import numpy as np
import pytest

from tramnet_master.errors import DamagedFile
from tramnet_master.tracked_paths import TrackedPath, write_tracking
from tramnet_master.tracking_times import follow
from tramnet_workers.problems.tracking_report import report_points
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.tracking_methods import ResolvedRate

PAPER = TrackingTask.of_paper(n_steps=100)
BARE = TrackingTask.for_arm(PAPER.arm, PAPER.start, PAPER.path)
FOLLOWED = follow(PAPER, ResolvedRate(), 1, 101, PAPER.start)


def test_a_followed_path_reads_back_bit_for_bit(tmp_path):
    write_tracking(tmp_path, "", PAPER, FOLLOWED)

    found, report = TrackedPath.read(tmp_path / "trajectory.csv"), report_points(PAPER, FOLLOWED)
    assert found.n_steps == 100
    np.testing.assert_array_equal(found.q, np.degrees(FOLLOWED))
    np.testing.assert_array_equal(found.position, report.position)
    np.testing.assert_array_equal(found.error, report.error)
    np.testing.assert_array_equal(found.clearance, report.clearance)
    np.testing.assert_array_equal(found.nearest_link, report.nearest_link)
    np.testing.assert_array_equal(found.nearest_box, report.nearest_box)
    np.testing.assert_array_equal(found.step, np.degrees(report.step))


def test_the_columns_say_their_units(tmp_path):
    write_tracking(tmp_path, "", PAPER, FOLLOWED)

    head, first, *_ = (tmp_path / "trajectory.csv").read_text().splitlines()
    assert head == (
        "k,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,q7_deg,q8_deg,"
        "x_cm,y_cm,z_cm,error_cm,clearance_cm,nearest_link,nearest_box,step_deg"
    )
    assert first.startswith("0,0.0,-90.0,-50.0,")
    assert first.endswith(",5,1,0.0")


def test_without_boxes_clearances_are_empty_cells_that_read_back_as_nan(tmp_path):
    write_tracking(tmp_path, "bare", BARE, FOLLOWED)

    file = tmp_path / "trajectory-bare.csv"
    assert all(",,0,0," in line for line in file.read_text().splitlines()[1:])
    assert np.isnan(TrackedPath.read(file).clearance).all()


@pytest.mark.parametrize("column", ["q1_deg", "x_cm", "error_cm", "clearance_cm", "nearest_box"])
def test_a_file_without_a_column_is_told_of(tmp_path, column):
    write_tracking(tmp_path, "", PAPER, FOLLOWED)
    file = tmp_path / "trajectory.csv"
    file.write_text(file.read_text().replace(column, "other"))

    with pytest.raises(DamagedFile, match=column):
        TrackedPath.read(file)
