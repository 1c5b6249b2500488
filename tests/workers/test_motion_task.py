"""What a motion is asked to do: every wrong number is refused by name, every right one travels."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from tramnet_workers.errors import InvalidTask
from tramnet_workers.problems.motion_task import MotionTask, ObjectiveWeights
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.puma560 import akb

ARM = akb()


def paper_task(**changes: object) -> MotionTask:
    arguments: dict[str, object] = {"start": PAPER_START, "goal": PAPER_GOAL}
    return MotionTask.for_arm(ARM, **arguments | changes)  # type: ignore[arg-type]


def test_limits_are_the_arm_s_own_unless_given() -> None:
    task = paper_task(velocity_limits=[2.0] * 6)

    assert (task.torque_limits == ARM.torque_limits).all()
    assert (task.position_lower == ARM.position_lower).all()
    assert (task.velocity_limits == 2.0).all()
    assert task.weights == ObjectiveWeights(1.0, 0.0, 0.1)
    assert (task.segments, task.margin_levels) == (16, 0)


def test_arrays_are_copied_and_read_only() -> None:
    start = np.array(PAPER_START)
    task = paper_task(start=start)
    start[0] = 9.0

    assert task.start[0] == PAPER_START[0]
    with pytest.raises(ValueError, match="read-only"):
        task.start[0] = 1.0


def but(values: tuple[float, ...], index: int, value: object) -> list[object]:
    changed: list[object] = list(values)
    changed[index] = value
    return changed


WRONG = {
    "too few": ({"start": PAPER_START[:5]}, "start", "5 numbers", "6 numbers"),
    "too many": ({"goal": [*PAPER_GOAL, 0.0]}, "goal", "7 numbers", "6 numbers"),
    "no list": ({"goal": 0.5}, "goal", "0.5", "6 numbers"),
    "text": ({"goal": "far away"}, "goal", "far away", "6 numbers"),
    "nan": ({"start": but(PAPER_START, 2, float("nan"))}, "start[2]", "nan", "a number"),
    "no number": ({"start": but(PAPER_START, 1, "x")}, "start[1]", "'x'", "a number"),
    "a truth value": ({"start": but(PAPER_START, 1, True)}, "start[1]", "True", "a number"),
    "infinite": ({"goal": but(PAPER_GOAL, 0, np.inf)}, "goal[0]", "inf", "an angle"),
    "outside": ({"start": but(PAPER_START, 1, 1.0)}, "start[1]", "1.0", "[-3.9269"),
    "nowhere to go": ({"goal": PAPER_START}, "goal", "the start", "another position"),
    "no torque": ({"torque_limits": [0.0] * 6}, "torque_limits[0]", "0.0", "above 0"),
    "endless torque": ({"torque_limits": [np.inf] * 6}, "torque_limits[0]", "inf", "finite"),
    "no speed": ({"velocity_limits": [-1.0] * 6}, "velocity_limits[0]", "-1.0", "above 0"),
    "no room": ({"position_lower": [9.0] * 6}, "position_lower[0]", "9.0", "less than"),
    "too weak": ({"torque_limits": [10.0] * 6}, "torque_limits[1]", "10.0", "35.5034"),
    "no segments": ({"segments": 1}, "segments", "1", "from 2"),
    "half a segment": ({"segments": 16.5}, "segments", "16.5", "whole number"),
    "no margin": ({"margin_levels": -1}, "margin_levels", "-1", "from 0"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_named_with_what_was_found_and_expected(name: str) -> None:
    changes, field, found, expected = WRONG[name]

    with pytest.raises(InvalidTask) as caught:
        paper_task(**changes)

    assert caught.value.field == field
    assert found in caught.value.found
    assert expected in caught.value.expected
    assert str(caught.value) == (
        f"{field}: found {caught.value.found}, expected {caught.value.expected}"
    )


@pytest.mark.parametrize(
    ("weights", "field"),
    [
        ((-1.0, 0.0, 0.1), "weights.time"),
        ((1.0, float("nan"), 0.1), "weights.torque"),
        ((1.0, 0.0, float("inf")), "weights.end_velocity"),
        ((0.0, 0.0, 0.1), "weights"),
    ],
)
def test_wrong_weights_are_refused(weights: tuple[float, float, float], field: str) -> None:
    with pytest.raises(InvalidTask) as caught:
        ObjectiveWeights(*weights)

    assert caught.value.field == field


def test_a_joint_may_start_at_its_limit_and_stay_there() -> None:
    start, goal = list(PAPER_START), list(PAPER_GOAL)
    start[2] = goal[2] = ARM.position_lower[2]

    task = paper_task(start=start, goal=goal)

    assert task.start[2] == task.position_lower[2]


def test_a_payload_counts_in_what_the_arm_can_hold() -> None:
    heavy = ARM.with_payload(60.0, (0.0, 0.0, 0.1))

    with pytest.raises(InvalidTask, match="holds the arm still at the start"):
        MotionTask.for_arm(heavy, PAPER_START, PAPER_GOAL)


def test_a_task_travels_as_plain_values() -> None:
    task = paper_task(weights=ObjectiveWeights(0.0, 1.0, 0.0), segments=25, margin_levels=2)

    frame = msgspec.msgpack.encode(task.parameters())
    rebuilt = MotionTask.from_parameters(msgspec.msgpack.decode(frame))

    assert rebuilt == task
    assert hash(rebuilt) == hash(task)
    assert rebuilt != replace(task, segments=24)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"segmnts": 4}, "segmnts"),
        ({"segments": "4"}, "segments"),
        ({"arm": {}}, "arm"),
        ({"start": [0.0]}, "start"),
    ],
)
def test_parameters_that_make_no_task_are_refused(change: dict[str, object], said: str) -> None:
    with pytest.raises(InvalidTask, match=said):
        MotionTask.from_parameters(paper_task().parameters() | change)
