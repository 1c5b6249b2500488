"""The grid search: shared and naive are the same search, and both are the best there is."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.kernels.grids import new_grid, search_naively
from tramnet_workers.kernels.perturbation import search_shared
from tramnet_workers.kernels.scenes import Scene
from tramnet_workers.kernels.tracking import evaluate_steps, new_stage, set_stage
from tramnet_workers.problems.line_tracking import track
from tramnet_workers.problems.tracking_report import report_points, summarise
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.robots.dh_rows import arm_from_dh_rows
from tramnet_workers.tracking_methods import Perturbation

Array = NDArray[np.float64]

PAPER = TrackingTask.of_paper()


def both(scene: Scene, k: int, q: Array, levels: int) -> tuple[Array, Array]:
    """Return the steps of the naive and the shared search, with their costs in front."""
    stage, grid, dq = new_stage(scene), new_grid(len(q), levels), np.empty(len(q))
    set_stage(scene, k, q, stage)
    naive = np.append(search_naively(scene, stage, grid, dq), dq)
    shared = np.append(search_shared(scene, stage, grid, dq), dq)
    return naive, shared


def small_task(tool_offset: float, zone: float, levels: int) -> TrackingTask:
    """Return a task for an arm of four joints; without an offset, the last one is inert."""
    rows = [
        (0.0, 0.3, 0.0, 90.0),
        (0.0, 0.0, 0.4, 0.0),
        (0.0, 0.0, 0.3, 90.0),
        (0.0, 0.2, tool_offset, 0.0),
    ]
    arm = arm_from_dh_rows(f"small-{levels}", rows)
    start = np.array([0.3, 0.4, -0.9, 0.2])
    task = TrackingTask.for_arm(arm, start, [[0, 0, 0], [1, 0, 0]][:1] * 2, zone=1e9)
    tip = task.chain.points(start[None])[0, -1]
    path = tip + np.linspace(0.0, 1.0, 11)[:, None] * np.array([0.2, 0.3, -0.2])
    boxes = [(*(tip + 3.0), *(tip + 9.0)), (*(tip - 20.0), *(tip - 12.0))]
    return TrackingTask.for_arm(arm, start, path, boxes=boxes, zone=zone, step=np.radians(1.0))


@pytest.mark.parametrize("levels", [5, 4])
def test_sharing_changes_no_bit_on_the_paper_s_path(levels: int) -> None:
    scene, q = PAPER.scene(0.1), PAPER.start.copy()

    for k in range(1, 26):
        naive, shared = both(scene, k, q, levels)
        np.testing.assert_array_equal(naive, shared)
        q += naive[1:]


@pytest.mark.parametrize("tool_offset", [0.0, 0.1])
@pytest.mark.parametrize("zone", [1e-6, 0.1, 0.5, 50.0])
@pytest.mark.parametrize("levels", [2, 3, 4, 5])
def test_sharing_changes_no_bit_with_and_without_an_inert_joint(
    tool_offset: float, zone: float, levels: int
) -> None:
    task = small_task(tool_offset, 1.0, levels)
    scene, q = task.scene(0.1), task.start.copy()
    scene = scene._replace(objective=scene.objective._replace(zone=zone))

    assert scene.n_moving == (4 if tool_offset else 3)
    for k in range(1, 11):
        naive, shared = both(scene, k, q, levels)
        np.testing.assert_array_equal(naive, shared)
        q += naive[1:]


def test_sharing_changes_no_bit_without_an_inert_joint_on_the_paper_s_arm() -> None:
    rows = [(0.0, 0.28, 0.0, 0.0), (0.0, 0.15, 0.0, -76.0), (0.0, 0.275, 0.0, 90.0)]
    rows += [(0.0, 0.0, 0.0, -90.0), (0.0, 0.4, 0.0, -90.0), (0.0, 0.17, 0.0, -90.0)]
    rows += [(0.0, 0.34, 0.0, 90.0), (0.0, 0.0, 0.0, -90.0), (0.0, 0.24, 0.02, 0.0)]
    arm = arm_from_dh_rows("offset tool", rows, fixed_rows=[0])
    blank = TrackingTask.for_arm(arm, PAPER.start, PAPER.path, zone=5.0)
    tip = blank.chain.points(PAPER.start[None])[0, -1]
    path = PAPER.path - PAPER.path[0] + tip
    task = TrackingTask.for_arm(arm, PAPER.start, path, boxes=PAPER.boxes)
    scene, q = task.scene(0.1), task.start.copy()

    assert scene.n_moving == 8
    for k in (1, 2):
        naive, shared = both(scene, k, q, 4)
        np.testing.assert_array_equal(naive, shared)
        q += naive[1:]


@pytest.mark.parametrize("levels", [2, 3, 5])
def test_no_combination_of_the_grid_is_better(levels: int) -> None:
    task = small_task(0.0, 0.3, levels)
    scene, q = task.scene(0.1), task.start.copy()
    offsets = np.array(list(product(range(levels), repeat=4)))
    grid = task.step * (2 * offsets - (levels - 1)) / (levels - 1)

    found = both(scene, 1, q, levels)[0]

    costs = evaluate_steps(scene, 1, q, grid)
    motion = ((2 * offsets - (levels - 1)) ** 2).sum(axis=1)
    best = min(range(len(grid)), key=lambda i: (costs[i], motion[i], i))
    np.testing.assert_array_equal(found, np.append(costs[best], grid[best]))


@pytest.mark.parametrize(("levels", "still"), [(5, 0.0), (4, -1.0 / 6.0)])
def test_a_joint_that_moves_nothing_stands_as_still_as_the_grid_allows(
    levels: int, still: float
) -> None:
    naive, shared = both(PAPER.scene(0.1), 1, PAPER.start.copy(), levels)

    np.testing.assert_allclose(np.degrees([naive[-1], shared[-1]]), still, atol=1e-12)


def test_joint_limits_hold_in_both_searches() -> None:
    task = small_task(0.1, 0.3, 5)
    scene, q = task.scene(0.1), task.start.copy()
    scene = scene._replace(upper=q + 0.003, lower=q - 0.001)

    naive, shared = both(scene, 1, q, 5)

    np.testing.assert_array_equal(naive, shared)
    assert (q + naive[1:] <= scene.upper).all()
    assert (q + naive[1:] >= scene.lower).all()


def test_the_grid_follows_the_paper_s_line_as_the_prototypes_did() -> None:
    run = track(PAPER, Perturbation(), 1, 1001, PAPER.start)

    path = np.vstack([PAPER.start, run.path])
    summary = summarise(PAPER, path, report_points(PAPER, path))
    found = (summary.error_mean, summary.error_max, summary.clearance_min_settled)
    np.testing.assert_allclose(found, (0.0154, 0.0413, 6.976), rtol=0.01)
    assert summary.step_max <= PAPER.step.max()


def test_naive_and_shared_follow_the_same_path() -> None:
    runs = [
        track(PAPER, Perturbation(4, search), 1, 6, PAPER.start) for search in ("naive", "shared")
    ]

    np.testing.assert_array_equal(runs[0].path, runs[1].path)
    np.testing.assert_array_equal(runs[0].cost, runs[1].cost)


def test_the_report_s_count_is_the_search_s() -> None:
    scene = PAPER.scene(0.1)

    assert Perturbation(5, "naive").evaluations_per_step(scene) == 5**8
    assert Perturbation(5, "shared").evaluations_per_step(scene) == 5**7


def test_one_level_is_no_grid() -> None:
    with pytest.raises(InvalidParameters, match="levels is 1"):
        Perturbation(levels=1)
