"""The evaluation of candidate steps of an arm along a path past boxes, a block of lanes at a time."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.distances import approach, box_at, subtract
from tramnet_workers.kernels.kinematics import (
    POSE_ROWS,
    TURN_ROWS,
    directions,
    joint_poses,
    origin,
    turn_from,
)
from tramnet_workers.kernels.lanes import LANES, new_rows
from tramnet_workers.kernels.scenes import Objective, Scene, step_cost

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# Rounding must not leave out a link that comes as near as another one [cm].
_SLACK = 1e-6


class Stage(NamedTuple):
    """Storage for evaluations, and what all candidates of one step share.

    Attributes:
        sine: Sines of the present joint angles, of shape (n,).
        cosine: Their cosines, of shape (n,).
        low: Smallest dq within step and joint limits, of shape (n,) [rad].
        high: Largest dq, of shape (n,) [rad].
        target: The point to reach, of shape (3,) [cm].
        pairs: Link and box of each pair that may be the nearest, of shape (n_links * n_boxes, 2).
        n_pairs: How many pairs that are, of shape (1,).
        turns: Turns of the lanes' joints, of shape (n, TURN_ROWS * LANES).
        poses: Poses of the lanes' joints and tips, of shape (n + 1, POSE_ROWS * LANES) [cm].
        errors: Squared distances of the lanes' tips from the target, of shape (LANES,) [cm²].
        nearest: Squared distances of arm and boxes, of shape (LANES,) [cm²].
    """

    sine: Array
    cosine: Array
    low: Array
    high: Array
    target: Array
    pairs: Indices
    n_pairs: Indices
    turns: Array
    poses: Array
    errors: Array
    nearest: Array


@kernel
def new_stage(scene: Scene) -> Stage:
    """Return storage for the evaluations of a scene."""
    n, n_pairs = len(scene.step), len(scene.links) * len(scene.boxes)
    return Stage(
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(3),
        np.empty((n_pairs, 2), np.int64),
        np.zeros(1, np.int64),
        new_rows(n, TURN_ROWS),
        new_rows(n + 1, POSE_ROWS),
        new_rows(1, 1)[0],
        new_rows(1, 1)[0],
    )


@kernel
def set_stage(scene: Scene, k: int, q: Array, stage: Stage) -> None:
    """Prepare the evaluation of steps from a posture to point k of the path.

    Args:
        scene: The task.
        k: Number of the point, from 1.
        q: Joint angles at the point before, of shape (n,) [rad].
        stage: Overwritten.
    """
    directions(scene.chain, q, stage.sine, stage.cosine)
    stage.target[:] = scene.targets[k]
    for j in range(len(q)):
        stage.low[j] = max(-scene.step[j], min(scene.lower[j] - q[j], 0.0))
        stage.high[j] = min(scene.step[j], max(scene.upper[j] - q[j], 0.0))
    _find_near_pairs(scene, stage)


@device
def evaluate_block(scene: Scene, stage: Stage, dq: Array, first: int, costs: Array) -> None:
    """Compute the costs of the candidates ``first`` to ``first + LANES - 1``.

    Args:
        scene: The task.
        stage: From ``set_stage``.
        dq: Candidates, of shape (n, at least first + LANES) [rad].
        first: Index of the first one.
        costs: Receives the costs in the same places.
    """
    _place(scene, stage, dq, first)
    measure_errors(stage.target, stage.poses[len(dq)], stage.errors)
    # The clearance of a candidate outside the zone does not matter.
    if count_below(stage.errors, scene.objective.zone * scene.objective.zone) > 0:
        _approach_boxes(scene, stage)
    _sum_up(scene.objective, stage.errors, stage.nearest, costs[first : first + LANES])


@device
def evaluate_block_in_full(scene: Scene, stage: Stage, dq: Array, first: int, costs: Array) -> None:
    """Do as ``evaluate_block``, with the distance of every link from every box for every candidate.

    The costs are the same, bit for bit; this is what an evaluation takes without any thought.
    """
    _place(scene, stage, dq, first)
    measure_errors(stage.target, stage.poses[len(dq)], stage.errors)
    _approach_all_boxes(scene, stage)
    _sum_up(scene.objective, stage.errors, stage.nearest, costs[first : first + LANES])


@kernel
def evaluate_steps(scene: Scene, k: int, q: Array, dq: Array) -> Array:
    """Compute the costs of any number of candidate steps from one posture.

    Args:
        scene: The task.
        k: Number of the point to reach, from 1.
        q: Joint angles at the point before, of shape (n,) [rad].
        dq: Candidates, of shape (m, n) [rad].

    Returns:
        Costs, of shape (m,).
    """
    m, n = dq.shape
    stage = new_stage(scene)
    set_stage(scene, k, q, stage)
    block, costs, result = new_rows(n, 1), new_rows(1, 1)[0], np.empty(m)
    for first in range(0, m, LANES):
        count = min(LANES, m - first)
        for j in range(n):
            for lane in range(count):
                block[j, lane] = dq[first + lane, j]
        evaluate_block(scene, stage, block, 0, costs)
        result[first : first + count] = costs[:count]
    return result


@device
def measure_errors(target: Array, tip: Array, errors: Array) -> None:
    """Compute the squared distances of all lanes' tips from the target.

    Args:
        target: The point to reach, of shape (3,) [cm].
        tip: Poses of the lanes' tips, of shape (POSE_ROWS * LANES,) [cm].
        errors: Receives the squared distances, of shape (LANES,) [cm²].
    """
    x, y, z = target[0], target[1], target[2]
    for lane in range(LANES):
        p = origin(tip, lane)
        dx, dy, dz = p.x - x, p.y - y, p.z - z
        errors[lane] = dx * dx + dy * dy + dz * dz


@device
def count_below(errors: Array, limit: float) -> int:
    """Return in how many lanes a squared error is at most the limit."""
    count = 0  # a sum of integers is vectorised, one of doubles is not
    for lane in range(LANES):
        count += 1 if errors[lane] <= limit else 0
    return count


@device
def _place(scene: Scene, stage: Stage, dq: Array, first: int) -> None:
    """Compute the points of a block of candidates."""
    for j in range(len(dq)):
        turn_from(stage.sine[j], stage.cosine[j], dq[j, first : first + LANES], stage.turns[j])
    joint_poses(scene.chain, stage.turns, stage.poses)
    stage.nearest[:] = np.inf


@kernel
def _approach_boxes(scene: Scene, stage: Stage) -> None:
    """Compute the squared distances of all lanes' arms from the boxes, by the near pairs."""
    for i in range(stage.n_pairs[0]):
        link, box = stage.pairs[i, 0], stage.pairs[i, 1]
        start, end = scene.links[link, 0], scene.links[link, 1]
        _approach_box(stage.poses[start], stage.poses[end], scene.boxes, box, stage.nearest)


@kernel
def _approach_all_boxes(scene: Scene, stage: Stage) -> None:
    """Compute the squared distances of all lanes' arms from the boxes, by all pairs."""
    for link in range(len(scene.links)):
        start, end = scene.links[link, 0], scene.links[link, 1]
        for box in range(len(scene.boxes)):
            _approach_box(stage.poses[start], stage.poses[end], scene.boxes, box, stage.nearest)


@device
def _approach_box(starts: Array, ends: Array, boxes: Array, box: int, nearest: Array) -> None:
    """Reduce the squared distances by those between one link and one box."""
    obstacle = box_at(boxes, box)
    for lane in range(LANES):
        a, b = origin(starts, lane), origin(ends, lane)
        nearest[lane] = min(nearest[lane], approach(a, subtract(b, a), obstacle).squared)


@device
def _sum_up(objective: Objective, errors: Array, nearest: Array, costs: Array) -> None:
    for lane in range(LANES):
        costs[lane] = step_cost(objective, errors[lane], nearest[lane])


@kernel
def _find_near_pairs(scene: Scene, stage: Stage) -> None:
    """List the pairs of link and box that can be the nearest one after some step.

    No point of a link travels farther in a step than the link's swing. So a pair that is farther
    apart than another one by more than the swings of both never decides the clearance; leaving it
    out changes no bit of any cost.
    """
    for j in range(len(stage.sine)):
        stage.turns[j, :LANES] = stage.sine[j]
        stage.turns[j, LANES:] = stage.cosine[j]
    joint_poses(scene.chain, stage.turns, stage.poses)
    reach = np.inf
    for link in range(len(scene.links)):
        for box in range(len(scene.boxes)):
            apart = _present_distance(scene, stage, link, box)
            reach = min(reach, apart + scene.swings[link] + _SLACK)
    n_pairs = 0
    for link in range(len(scene.links)):
        for box in range(len(scene.boxes)):
            if _present_distance(scene, stage, link, box) - scene.swings[link] <= reach:
                stage.pairs[n_pairs] = link, box
                n_pairs += 1
    stage.n_pairs[0] = n_pairs if scene.objective.clearance_weight > 0.0 else 0


@kernel
def _present_distance(scene: Scene, stage: Stage, link: int, box: int) -> float:
    a = origin(stage.poses[scene.links[link, 0]], 0)
    b = origin(stage.poses[scene.links[link, 1]], 0)
    return float(np.sqrt(approach(a, subtract(b, a), box_at(scene.boxes, box)).squared))
