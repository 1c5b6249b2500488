import pytest

from tramnet_master.experiments.sharing import Shared, advice


def shared(**changes):
    usual = {
        "what": "sub-populations",
        "parts": 4,
        "steps": 100,
        "wall_seconds": 1.0,
        "compute_seconds": 1.5,
        "busy_seconds": (0.75, 0.75),
    }
    return Shared(**{**usual, **changes})


def test_a_single_path_is_for_one_worker():
    text = advice(shared(what="scenes", parts=1, busy_seconds=(0.5, 0.4)))

    assert "one of 2 workers computes at a time" in text
    assert "--workers 1" in text


def test_workers_that_pay_are_told_by_how_much():
    text = advice(shared())

    assert "2 workers took 10 ms a step" in text
    assert "15 ms, 1.50 times as long" in text
    assert "All of them computed for as long." in text


def test_workers_that_do_not_pay_are_told_what_would_be_faster():
    text = advice(shared(compute_seconds=0.4))

    assert "4 ms and is the faster choice (--workers 1 --subpopulations 1)" in text


@pytest.mark.parametrize(
    ("parts", "busy", "why"),
    [
        (2, (0.5, 0.5, 0.0), "Worker 3 computed less: there are 2 scenes for 3 workers"),
        (3, (1.0, 0.5), "Worker 2 computed less: 3 scenes do not divide among 2 workers"),
    ],
)
def test_idle_workers_are_named_with_the_reason(parts, busy, why):
    assert why in advice(shared(what="scenes", parts=parts, busy_seconds=busy))


def test_one_worker_alone_is_told_what_it_computed():
    text = advice(shared(what="scenes", parts=1, busy_seconds=(0.9,), compute_seconds=0.9))

    assert text == "One worker computed 9 ms of each step of 10 ms."
