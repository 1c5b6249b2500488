import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.engines.tracking import TrackingEngine
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Tracked

STEPS, JOINTS = 40, 3


def follow(work, seconds=0.001):
    """A path that depends on where it begins, on the point and on the population alone."""
    population = work.work.population
    posture = work.posture.unpack()
    path, cost = [], []
    for point in range(work.work.first, work.work.last):
        posture = np.sin(posture + 0.1 * point + 0.01 * population)
        path.append(posture)
        cost.append(abs(float(posture.sum())))
    return Tracked(work.work, Array.pack(np.array(path)), Array.pack(np.array(cost)), seconds)


def run(engine, order=None, seconds=0.001):
    rows = []
    waiting = []
    while not engine.finished:
        waiting += engine.ask()
        chosen = waiting.pop(order(len(waiting)) if order else 0)
        rows += engine.tell(chosen, follow(chosen, seconds))
    return rows


def new_engine(scenes=1, subpopulations=1):
    starts = np.linspace(0.0, 1.0, scenes * JOINTS).reshape(scenes, JOINTS)
    return TrackingEngine(starts, STEPS, subpopulations, evaluations=10)


@pytest.mark.parametrize(("scenes", "subpopulations"), [(1, 1), (1, 4), (3, 1), (2, 2)])
@given(data=st.data())
def test_neither_the_order_of_answers_nor_their_speed_changes_the_path(
    scenes, subpopulations, data
):
    usual, shuffled = new_engine(scenes, subpopulations), new_engine(scenes, subpopulations)
    run(usual, seconds=1.0)

    speed = data.draw(st.sampled_from([1e-6, 1e-3, 1.0]))
    rows = run(shuffled, lambda n: data.draw(st.integers(0, n - 1)), speed)

    for path, other in zip(usual.final_arrays(), shuffled.final_arrays(), strict=True):
        np.testing.assert_array_equal(path, other)
    assert [row.generation for row in rows] == list(range(1, STEPS + 1))
    assert rows[-1].evaluations == STEPS * 10 * scenes


def test_runs_of_points_grow_until_they_take_long_against_a_message():
    engine = new_engine()
    sizes = []
    while not engine.finished:
        (work,) = engine.ask()
        sizes.append(work.work.size)
        engine.tell(work, follow(work, 0.01 * work.work.size))

    assert sizes[0] == 1
    assert max(sizes) == 5


def test_with_several_sub_populations_each_point_is_asked_of_all_and_the_best_goes_on():
    engine = new_engine(subpopulations=3)

    works = engine.ask()
    answers = [follow(work) for work in works]
    for work, answer in zip(works, answers, strict=True):
        engine.tell(work, answer)

    best = min(answers, key=lambda answer: answer.cost.unpack()[0])
    assert [work.work.population for work in works] == [0, 1, 2]
    np.testing.assert_array_equal(engine.ask()[0].posture.unpack(), best.path.unpack()[0])


def test_equal_costs_go_to_the_lowest_sub_population():
    engine = new_engine(subpopulations=2)
    works = engine.ask()
    for value, work in zip((1.0, 2.0), works, strict=True):
        path, cost = np.full((1, JOINTS), value), np.array([0.5])
        engine.tell(work, Tracked(work.work, Array.pack(path), Array.pack(cost), 0.0))

    assert engine.ask()[0].posture.unpack().tolist() == [1.0] * JOINTS


@given(st.integers(0, STEPS - 1))
def test_a_restored_engine_ends_on_the_same_path(cut):
    whole, first, second = new_engine(2), new_engine(2), new_engine(2)
    run(whole)
    while first.generation < cut:
        for work in first.ask():
            first.tell(work, follow(work, 0.02))

    second.restore(first.state())
    run(second)

    for path, other in zip(whole.final_arrays(), second.final_arrays(), strict=True):
        np.testing.assert_array_equal(path, other)
