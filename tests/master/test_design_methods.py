import pytest
from rich.console import Console

from tramnet_master.design_methods import BUDGET, METHODS, measure_methods
from tramnet_master.reports.method_table import method_table


@pytest.fixture(scope="module")
def outcomes():
    return measure_methods([4, 8], range(1, 3))


def test_every_method_is_measured_for_every_number_of_points(outcomes):
    measured = [(outcome.task_points, outcome.method) for outcome in outcomes]

    assert measured == [(t, method) for t in (4, 8) for method in METHODS]
    assert all(len(outcome.quality) == len(outcome.seconds) == 2 for outcome in outcomes)


def test_the_search_with_exact_poses_finds_the_best_arm_and_the_others_come_close(outcomes):
    for outcome in outcomes:
        least = {"mpga": 0.97, "single-ga": 0.97, "bilevel-cma": 0.9999}[outcome.method]
        assert least <= min(outcome.quality) <= max(outcome.quality) <= 1.0 + 1e-6


def test_the_table_fits_a_terminal_and_says_who_wins(outcomes):
    console = Console(width=80, record=True)

    console.print(method_table(outcomes, BUDGET))
    text = console.export_text()

    assert "…" not in text
    assert "CMA-ES on the links alone is ahead of mpga in 2 of 2 rows." in text
    assert "the paper says constant" in text
