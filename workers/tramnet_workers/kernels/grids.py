"""The perturbation method as the paper means it: all combinations on a regular grid, in full.

Lin, Chen & Yu (2017), tables 3 and 4 (after Lin 2004): each joint changes by one of ``levels``
values between -M and M. The best combination is the one of the lowest cost, of equals the one
nearest to standing still (counted in spacings of the grid), of these the one of the lowest index,
joint 1 first.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.kinematics import POSE_ROWS, TURN_ROWS, turn_from
from tramnet_workers.kernels.lanes import LANES, new_rows
from tramnet_workers.kernels.scenes import Scene
from tramnet_workers.kernels.tracking import Stage, evaluate_block_in_full

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Best(NamedTuple):
    """The best combination so far.

    Attributes:
        cost: Its cost, of shape (1,).
        keys: Its distance from standing still and its index, of shape (2,).
    """

    cost: Array
    keys: Indices


class Waiting(NamedTuple):
    """Candidates that wait until a block of them is full.

    Attributes:
        indices: Their indices, of shape (LANES,).
        size: Their number, of shape (1,).
    """

    indices: Indices
    size: Indices


class Grid(NamedTuple):
    """Storage for a search among ``levels`` values for each of n joints.

    Attributes:
        values: The joints' changes, of shape (n, levels) [rad].
        turns: Turns by each change, all lanes alike, of shape (n * levels, TURN_ROWS * LANES).
        packed_turns: Turns of a block of combinations, of shape (n, TURN_ROWS * LANES).
        poses: Poses of a block, of shape (n + 1, POSE_ROWS * LANES) [cm].
        errors: Squared errors of the last two joints' levels, of shape (levels², LANES) [cm²].
        block: Candidates, of shape (n, LANES) [rad].
        costs: Their costs, of shape (LANES,).
        digits: Levels of the joints, of shape (n,).
        best: The best combination so far.
        waiting: Indices of candidates whose clearance is not known yet.
    """

    values: Array
    turns: Array
    packed_turns: Array
    poses: Array
    errors: Array
    block: Array
    costs: Array
    digits: Indices
    best: Best
    waiting: Waiting


@kernel
def new_grid(n: int, levels: int) -> Grid:
    """Return storage for a search with so many values for each of n joints."""
    return Grid(
        np.empty((n, levels)),
        new_rows(n * levels, TURN_ROWS),
        new_rows(n, TURN_ROWS),
        new_rows(n + 1, POSE_ROWS),
        new_rows(levels * levels, 1),
        new_rows(n, 1),
        new_rows(1, 1)[0],
        np.empty(n, np.int64),
        Best(np.empty(1), np.empty(2, np.int64)),
        Waiting(np.empty(LANES, np.int64), np.zeros(1, np.int64)),
    )


@kernel
def search_naively(scene: Scene, stage: Stage, grid: Grid, dq: Array) -> float:
    """Find the best step by evaluating each combination in full.

    Args:
        scene: The task.
        stage: From ``set_stage``.
        grid: Storage, overwritten.
        dq: Receives the best step, of shape (n,) [rad].

    Returns:
        Its cost.
    """
    set_grid(scene, stage, grid)
    n, levels = grid.values.shape
    total = levels**n
    # Taken out of their tuples once: Numba counts references at each access.
    values, digits, block, costs, best = (
        grid.values,
        grid.digits,
        grid.block,
        grid.costs,
        grid.best.cost,
    )
    digits[:] = 0
    for first in range(0, total, LANES):
        count = min(LANES, total - first)
        for lane in range(count):
            for j in range(n):
                block[j, lane] = values[j, digits[j]]
            count_up(digits, 0, n, levels)
        evaluate_block_in_full(scene, stage, block, 0, costs)
        for lane in range(count):
            if costs[lane] <= best[0]:
                consider(grid.best, n, levels, first + lane, costs[lane])
    return write_best(grid, dq)


@kernel
def set_grid(scene: Scene, stage: Stage, grid: Grid) -> None:
    """Compute the grid's values within all limits, with their turns."""
    n, levels = grid.values.shape
    for j in range(n):
        for i in range(levels):
            value = scene.step[j] * (2 * i - (levels - 1)) / (levels - 1)
            value = min(max(value, stage.low[j]), stage.high[j])
            grid.values[j, i] = value
            grid.block[j, :] = value
            turn_from(stage.sine[j], stage.cosine[j], grid.block[j], grid.turns[j * levels + i])
    grid.best.cost[0] = np.inf
    grid.waiting.size[0] = 0


@device
def count_up(digits: Indices, first: int, last: int, levels: int) -> int:
    """Count the number with digits ``first`` to ``last - 1`` up by one.

    Returns:
        The place of the digit that went up, or -1 where the count is over and begins again.
    """
    for j in range(last - 1, first - 1, -1):
        digits[j] += 1
        if digits[j] < levels:
            return j
        digits[j] = 0
    return -1


@kernel
def consider(best: Best, n: int, levels: int, index: int, cost: float) -> None:
    """Keep a combination if it is better than the best one so far."""
    if cost > best.cost[0]:
        return
    motion = _motion(index, n, levels)
    later = motion > best.keys[0] or (motion == best.keys[0] and index > best.keys[1])
    if cost == best.cost[0] and later:
        return
    best.cost[0] = cost
    best.keys[0], best.keys[1] = motion, index


@device
def _motion(index: int, n: int, levels: int) -> int:
    """Return the squared distance from standing still, in half spacings of the grid."""
    motion, rest = 0, index
    for _ in range(n):
        offset = 2 * (rest % levels) - (levels - 1)
        motion += offset * offset
        rest //= levels
    return motion


@device
def write_best(grid: Grid, dq: Array) -> float:
    """Write the best step and return its cost."""
    n, levels = grid.values.shape
    rest = grid.best.keys[1]
    for j in range(n - 1, -1, -1):
        dq[j] = grid.values[j, rest % levels]
        rest //= levels
    return float(grid.best.cost[0])
