"""Times of the methods: all of the paper's and ours, measured on the path that they follow."""

import time

import numpy as np
import pytest

from tramnet_master import tracking_times
from tramnet_master.experiments.paper_times import NAIVE, PAPER_TIMES
from tramnet_master.tracking_times import (
    METHODS,
    NAIVE_METHODS,
    SHARED,
    follow,
    label,
    measure,
    measure_methods,
    quality,
)
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.tracking_evolution import Eamp, Memetic
from tramnet_workers.tracking_methods import Perturbation, ResolvedRate, method_names

PAPER = TrackingTask.of_paper(n_steps=300)


def test_every_method_and_all_that_the_paper_timed_is_measured():
    assert {method.name for method in METHODS.values()} == set(method_names())
    assert set(PAPER_TIMES) <= set(METHODS) | set(NAIVE_METHODS)
    assert NAIVE in NAIVE_METHODS
    assert SHARED in METHODS


@pytest.mark.parametrize(
    ("method", "name"),
    [
        (Eamp(population=70, generations=3), "EAMP 70/3"),
        (Memetic(), "memetic 50/5"),
        (ResolvedRate(), "resolved-rate"),
        (Perturbation(4, "naive"), "perturbation 4^8, naive"),
    ],
)
def test_a_method_is_called_by_how_much_it_computes(method, name):
    assert label(method) == name


def test_the_printed_speed_ups_are_those_of_the_printed_times():
    naive = PAPER_TIMES[NAIVE].cpu.milliseconds
    for paper in PAPER_TIMES.values():
        for printed in (paper.cpu, paper.gpu):
            if printed is not None:
                assert naive / printed.milliseconds == pytest.approx(printed.speed_up, abs=0.7)


def test_a_whole_path_is_timed_and_judged():
    began = time.thread_time()

    found = measure("rates", ResolvedRate(), PAPER, 1, 301, PAPER.start)

    assert 0.0 < 300 * found.seconds < time.thread_time() - began
    assert (found.name, found.points, found.evaluations) == ("rates", 300, 1)
    assert found.quality == quality(PAPER, follow(PAPER, ResolvedRate(), 1, 301, PAPER.start))


def test_a_part_of_a_path_is_timed_but_not_judged():
    found = measure("rates", ResolvedRate(), PAPER, 1, 11, PAPER.start)

    assert found.points == 10
    assert found.quality is None


def test_naive_searches_are_measured_on_a_few_points_in_the_middle(monkeypatch):
    few = {"rates": ResolvedRate()}
    naive = {"naive 2^8": Perturbation(2, "naive")}
    monkeypatch.setattr(tracking_times, "METHODS", few)
    monkeypatch.setattr(tracking_times, "NAIVE_METHODS", naive)
    told: list[str] = []

    whole, part = measure_methods(PAPER, told.append)

    assert told == ["rates", "naive 2^8"]
    assert (whole.points, part.points) == (300, 10)
    assert part.evaluations == 2**8


def test_a_path_followed_begins_with_the_posture_before_it():
    path = follow(PAPER, ResolvedRate(), 1, 4, PAPER.start)

    assert path.shape == (4, 8)
    np.testing.assert_array_equal(path[0], PAPER.start)
