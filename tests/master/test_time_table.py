"""Table 4 of Lin, Chen & Yu (2017) beside times of ours."""

import io
import math

from rich.console import Console

from tramnet_master.experiments.paper_times import NAIVE
from tramnet_master.reports.time_table import quality_table, reading, time_table
from tramnet_master.tracking_times import SHARED, MethodTime
from tramnet_workers.problems.tracking_report import Summary

EAMP = MethodTime(
    "EAMP 500/10", 0.0005, 5480, 1000,
    Summary(0.0023, 0.045, 2.1, 5.48, 9.2, 0, 0.0087, math.radians(0.0714)),
)  # fmt: skip
GRID = MethodTime(
    SHARED, 0.00061, 78125, 1000,
    Summary(0.0154, 0.041, 2.3, 6.98, 8.3, 0, 0.0087, math.radians(0.3043)),
)  # fmt: skip
NAIVELY = MethodTime(NAIVE, 0.0415, 5**8, 10, None)
MEMETIC = MethodTime("memetic 50/5", 0.000036, 290, 1000, None)


def printed(*parts: object) -> str:
    console = Console(file=io.StringIO(), width=80)
    with console.capture() as capture:
        for part in parts:
            console.print(part)
    return capture.get()


def cells(text: str, name: str) -> list[str]:
    (line,) = (line for line in text.splitlines() if line.startswith(f" {name} "))
    return line.removeprefix(f" {name} ").split()


def test_our_times_stand_beside_the_paper_s_with_their_ratios_to_the_naive_grid():
    text = printed(time_table([EAMP, MEMETIC, GRID, NAIVELY]))

    assert cells(text, "EAMP 500/10") == ["78", "244", "48", "398", "0.5", "83", "156"]
    assert cells(text, "EAMP 1000/10") == ["152", "126", "106", "180"]
    assert cells(text, NAIVE) == ["19083", "1", "41.5", "1.0", "460"]
    assert cells(text, "memetic 50/5") == ["0.036", "1,153"]
    assert cells(text, SHARED) == ["0.61", "68"]


def test_a_time_alone_has_no_ratio_to_a_grid_that_was_not_measured():
    text = printed(time_table([EAMP]))

    assert cells(text, "EAMP 500/10") == ["78", "244", "48", "398", "0.5", "156"]


def test_the_text_says_what_the_398_is_against_and_what_sharing_makes_of_it():
    text = reading([EAMP, GRID, NAIVELY])

    assert text.startswith("The paper's 398 is against the naive search of its grid")
    assert "Here that takes 41.5 ms, 83 times as long as EAMP 500/10." in text
    assert "finds the same steps 68 times as fast, in 0.61 ms: 1.2 times the 0.5 ms of" in text
    assert "its mean error is 0.0023 cm, that of the grid 0.0154 cm." in text


def test_without_measurements_the_text_says_where_they_come_from():
    text = reading([EAMP])

    assert "The paper's 398 is against the naive search of its grid" in text
    assert "takes about as long as the EAMP: `tramnet table redundant8` measures both" in text


def test_the_table_of_paths_has_those_that_were_followed_to_their_end():
    text = printed(quality_table([EAMP, NAIVELY]))

    assert cells(text, "EAMP 500/10") == ["5,480", "2.3e-03", "4.5e-02", "5.48", "0.0714"]
    assert NAIVE not in text
