"""Tracking tasks: what is refused, what travels, and where the points of a path lie."""

from dataclasses import replace

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from tramnet_workers.errors import InvalidParameters, InvalidTask
from tramnet_workers.problems.line_tracking import LineTracking, track
from tramnet_workers.problems.tracking_task import TrackingTask, points_along
from tramnet_workers.robots.dh_rows import arm_from_dh_rows
from tramnet_workers.tracking_evolution import Eamp, Memetic
from tramnet_workers.tracking_methods import (
    Perturbation,
    ResolvedRate,
    TrackingMethod,
    build_method,
    method_names,
)

PAPER = TrackingTask.of_paper()
BOX = [5.0, 50.0, 50.0, 15.0, 100.0, 50.0]


def task_with(**changes: object) -> TrackingTask:
    given = {"start": PAPER.start, "path": PAPER.path, "boxes": [BOX], **changes}
    start, path = given.pop("start"), given.pop("path")
    return TrackingTask.for_arm(PAPER.arm, start, path, **given)  # type: ignore[arg-type]


def path_with(place: tuple[int, int], value: float) -> ArrayLike:
    path = PAPER.path.copy()
    path[place] = value
    return path


@pytest.mark.parametrize(
    ("changes", "field", "found"),
    [
        ({"start": [0.0] * 7}, "start", "7 numbers"),
        ({"start": np.full(8, np.nan)}, "start[0]", "nan"),
        ({"start": np.zeros(8)}, "start", "the tip at"),
        ({"path": [[17.0, 57.6, 30.5]]}, "path", "1 rows"),
        ({"path": [[17.0, 57.6], [11.0, 110.0]]}, "path[0]", "2 numbers"),
        ({"path": path_with((7, 1), np.nan)}, "path[7][1]", "nan"),
        ({"path": path_with((9, 2), np.inf)}, "path[9][2]", "inf"),
        ({"path": path_with((500, 1), 900.0)}, "path[500]", "cm from the first link"),
        ({"path": PAPER.path[::100]}, "path[1]", "cm from the one before"),
        ({"boxes": [[5, 50, 50, 15, 100]]}, "boxes[0]", "5 numbers"),
        ({"boxes": [BOX, [5, 50, 60, 15, 100, 50]]}, "boxes[1]", "lower z = 60 cm"),
        ({"boxes": "none"}, "boxes", "'none'"),
        ({"step": [0.01] * 3}, "step", "3 numbers"),
        ({"step": 0.0}, "step[0]", "0.0 rad"),
        ({"step": 1.0}, "step[0]", "1.0 rad"),
        ({"zone": 0.0}, "zone", "0.0 cm"),
        ({"zone": "wide"}, "zone", "'wide'"),
        ({"radius": -1.0}, "radius", "-1.0 cm"),
        ({"error_weight": -1.0}, "error_weight", "-1.0"),
        ({"error_weight": 0.0, "clearance_weight": 0.0}, "error_weight", "0, as"),
        ({"clearance_weight": np.inf}, "clearance_weight", "inf"),
    ],
)
def test_what_makes_no_task_is_refused_by_name(
    changes: dict[str, object], field: str, found: str
) -> None:
    with pytest.raises(InvalidTask) as refused:
        task_with(**changes)

    assert refused.value.field == field
    assert found in refused.value.found


def test_a_start_outside_its_joint_s_range_is_refused() -> None:
    arm = replace(PAPER.arm, position_upper=np.full(8, 0.5))

    with pytest.raises(InvalidTask, match=r"start\[4\]"):
        TrackingTask.for_arm(arm, PAPER.start, PAPER.path)


def test_an_arm_with_too_many_joints_is_refused() -> None:
    arm = arm_from_dh_rows("snake", [(0.0, 0.0, 0.1, 90.0)] * 13)

    with pytest.raises(InvalidTask, match="13 joints"):
        TrackingTask.for_arm(arm, np.zeros(13), [[0, 0, 0], [1, 0, 0]])


def test_an_arm_that_cannot_move_its_tip_is_refused() -> None:
    arm = arm_from_dh_rows("pole", [(0.0, 0.5, 0.0, 0.0)] * 2)

    with pytest.raises(InvalidTask, match="no joint that moves a link"):
        TrackingTask.for_arm(arm, np.zeros(2), [[0, 0, 100], [0, 0, 101]])


@pytest.mark.parametrize(
    "task",
    [
        PAPER,
        TrackingTask.of_paper(5.0, 200),
        task_with(boxes=[], radius=2.0, clearance_weight=3.0, step=[0.01] * 8),
    ],
)
def test_a_task_comes_back_from_the_wire_as_it_was(task: TrackingTask) -> None:
    wire = msgpack.packb(task.parameters())

    again = TrackingTask.from_parameters(msgpack.unpackb(wire))

    assert again == task
    assert hash(again) == hash(task)


def test_a_run_file_that_leaves_out_a_weight_of_none_is_understood() -> None:
    kept = {name: value for name, value in PAPER.parameters().items() if value is not None}

    assert "clearance_weight" not in kept
    assert TrackingTask.from_parameters(kept) == PAPER


def test_an_unknown_key_is_refused() -> None:
    with pytest.raises(InvalidTask, match="speed"):
        TrackingTask.from_parameters({**PAPER.parameters(), "speed": 1.0})


@pytest.mark.parametrize("name", ["start", "path", "boxes", "step"])
def test_the_arrays_of_a_task_cannot_be_changed(name: str) -> None:
    assert not getattr(PAPER, name).flags.writeable


def test_the_paper_s_points_are_those_of_eq_21() -> None:
    r_0, r_d = np.array([17.0, 57.6, 30.5]), np.array([11.0, 110.0, 40.0])

    for k in (0, 1, 334, 1000):
        np.testing.assert_allclose(PAPER.path[k], r_0 + (r_d - r_0) / 1000 * k, atol=1e-12)


corners = st.lists(
    st.tuples(*[st.floats(-50.0, 50.0)] * 3), min_size=2, max_size=6, unique=True
).map(np.array)


@given(corners, st.integers(1, 300))
def test_points_along_a_polyline_are_as_far_apart_as_they_can_be(
    polyline: np.ndarray, n_steps: int
) -> None:
    points = points_along(polyline, n_steps)

    length = np.linalg.norm(np.diff(polyline, axis=0), axis=1).sum()
    assert points.shape == (n_steps + 1, 3)
    np.testing.assert_allclose(points[0], polyline[0], atol=1e-9)
    np.testing.assert_allclose(points[-1], polyline[-1], atol=1e-9)
    spacings = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert (spacings <= length / n_steps + 1e-9).all()


@pytest.mark.parametrize("apart", [0.0, 1e-300, 1e-17])
def test_a_corner_given_twice_is_one_corner(apart: float) -> None:
    twice = points_along([[0, 0, 0], [1, 0, 0], [1, 0, apart], [1, 1, 0]], 10)

    np.testing.assert_array_equal(twice, points_along([[0, 0, 0], [1, 0, 0], [1, 1, 0]], 10))


def test_a_line_of_no_length_is_refused() -> None:
    with pytest.raises(InvalidTask, match="no length"):
        points_along([[1, 2, 3], [1, 2, 3]], 10)


def test_a_task_for_another_arm_is_followed() -> None:
    rows = [(0.0, 0.3, 0.0, 90.0), (0.0, 0.0, 0.4, 0.0), (0.0, 0.0, 0.3, 0.0), (0.0, 0.0, 0.2, 0.0)]
    arm = arm_from_dh_rows("planar wrist", rows)
    start = np.array([0.2, 0.9, -1.1, -0.4])
    blank = TrackingTask.for_arm(arm, start, [[0, 0, 0], [1, 0, 0]], zone=1e3, step=0.5)
    tip = blank.chain.points(start[None])[0, -1]
    task = TrackingTask.for_arm(
        arm, start, points_along([tip, tip + np.array([5.0, 8.0, 6.0])], 150)
    )

    run = track(task, Memetic(seed=1), 1, 151, start)

    errors = np.linalg.norm(task.chain.points(run.path)[:, -1] - task.path[1:], axis=1)
    assert errors.max() < 1e-4


@pytest.mark.parametrize("span", [(0, 5), (5, 4), (990, 1002)])
def test_a_run_outside_the_path_is_refused(span: tuple[int, int]) -> None:
    with pytest.raises(InvalidTask, match="points"):
        track(PAPER, ResolvedRate(), *span, PAPER.start)


def test_a_posture_of_another_arm_is_refused() -> None:
    with pytest.raises(InvalidTask, match="posture"):
        track(PAPER, ResolvedRate(), 1, 2, PAPER.start[:6])


METHODS: list[TrackingMethod] = [
    Eamp(population=100, seed=2**64 - 1, crossing="single-point", warm_start=True),
    Memetic(),
    Perturbation(4, "naive"),
    ResolvedRate(ascent=0.0),
]


@pytest.mark.parametrize("method", METHODS)
def test_a_method_comes_back_from_the_wire_as_it_was(method: TrackingMethod) -> None:
    wire = msgpack.packb(method.parameters())

    assert build_method(msgpack.unpackb(wire)) == method


def test_all_methods_have_the_names_that_users_type() -> None:
    assert method_names() == ["eamp", "memetic", "resolved-rate", "perturbation"]


@pytest.mark.parametrize(
    ("parameters", "complaint"),
    [
        ({"name": "sga"}, "known are eamp, memetic"),
        ({"name": "eamp", "speed": 1}, "no setting 'speed'"),
        ({"name": "eamp", "population": "many"}, r"\$.population"),
        ({"name": "eamp", "crossing": "two-point"}, r"\$.crossing"),
    ],
)
def test_a_method_that_does_not_exist_is_refused(
    parameters: dict[str, object], complaint: str
) -> None:
    with pytest.raises(InvalidParameters, match=complaint):
        build_method(parameters)


def test_scenes_and_sub_populations_share_one_count() -> None:
    scenes = (TrackingTask.of_paper(0.0, 1000), TrackingTask.of_paper(5.0, 1000))
    problem = LineTracking(scenes, Eamp(population=41, generations=2, seed=4), 2)

    runs = [problem.track(i, 1, 3, PAPER.start) for i in range(4)]

    for i, run in enumerate(runs):
        method = Eamp(population=21 - i % 2, generations=2, seed=4)
        expected = track(scenes[i // 2], method, 1, 3, PAPER.start, i % 2)
        np.testing.assert_array_equal(run.path, expected.path)
    assert problem.evaluations_per_step() == 41 + 2 * (41 - 4)


def test_a_problem_comes_back_from_the_wire_as_it_was() -> None:
    problem = LineTracking((PAPER,), Memetic(seed=3))

    again = LineTracking.from_parameters(msgpack.unpackb(msgpack.packb(problem.parameters())))

    assert (again.tasks, again.method, again.subpopulations) == ((PAPER,), Memetic(seed=3), 1)


@pytest.mark.parametrize("method", [Perturbation(), ResolvedRate()])
def test_a_method_without_a_population_cannot_be_split(method: TrackingMethod) -> None:
    with pytest.raises(InvalidParameters, match="no population to split"):
        LineTracking((PAPER,), method, 2)


def test_too_small_shares_are_refused() -> None:
    with pytest.raises(InvalidParameters, match="population is 3"):
        LineTracking((PAPER,), Eamp(population=12), 4)
