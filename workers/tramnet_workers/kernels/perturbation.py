"""The perturbation method's search among all combinations, sharing what they have in common.

It returns the same step as ``grids.search_naively``, bit for bit. It turns each joint once for all
combinations that agree up to it, leaves out joints that move nothing, and asks for distances only
within the permissible zone. The first joints' combinations stand side by side in lanes; below each
block of them, the other joints' combinations are walked through depth first, those of the last two
at once.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.grids import Grid, consider, count_up, set_grid, write_best
from tramnet_workers.kernels.kinematics import advance, start_at_base
from tramnet_workers.kernels.lanes import LANES
from tramnet_workers.kernels.scenes import Scene, error_limit, step_cost
from tramnet_workers.kernels.tracking import (
    Stage,
    count_below,
    evaluate_block,
    measure_errors,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# Combinations of the first joints that are laid side by side in lanes.
_PACKED = 256


@kernel
def search_shared(scene: Scene, stage: Stage, grid: Grid, dq: Array) -> float:
    """Find the best step on the grid.

    Args:
        scene: The task.
        stage: From ``set_stage``.
        grid: Storage, overwritten.
        dq: Receives the best step, of shape (n,) [rad].

    Returns:
        Its cost.
    """
    set_grid(scene, stage, grid)
    levels, n_moving = grid.values.shape[1], scene.n_moving
    n_packed, packed = 0, 1
    while n_packed < n_moving - 1 and packed < _PACKED:
        n_packed += 1
        packed *= levels
    for first in range(0, packed, LANES):
        _place_packed(scene, grid, first, packed, n_packed)
        _walk(scene, stage, grid, first, packed, n_packed, n_moving)
    _evaluate_waiting(scene, stage, grid)
    return write_best(grid, dq)


@kernel
def _place_packed(scene: Scene, grid: Grid, first: int, packed: int, n_packed: int) -> None:
    """Turn the first joints of a block of their combinations."""
    levels = grid.values.shape[1]
    turns, packed_turns, poses, rows = grid.turns, grid.packed_turns, grid.poses, scene.chain.rows
    for lane in range(LANES):
        rest = min(first + lane, packed - 1)
        for j in range(n_packed - 1, -1, -1):
            row = j * levels + rest % levels
            rest //= levels
            packed_turns[j, lane] = turns[row, lane]
            packed_turns[j, LANES + lane] = turns[row, LANES + lane]
    start_at_base(scene.chain, poses[0])
    for j in range(n_packed):
        advance(rows[j], rows[j + 1], packed_turns[j], poses[j], poses[j + 1])


@kernel
def _walk(
    scene: Scene, stage: Stage, grid: Grid, first: int, packed: int, n_packed: int, n_moving: int
) -> None:
    """Compare all combinations of the joints from ``n_packed`` on below a block of the others."""
    n, levels = grid.values.shape
    # Taken out of their tuples once: Numba counts references at each access.
    rows, digits, turns, poses = scene.chain.rows, grid.digits, grid.turns, grid.poses
    errors = grid.errors
    target, best, objective = stage.target, grid.best.cost, scene.objective
    digits[:] = 0
    for j in range(n_moving, n):
        digits[j] = _stillest(levels)
    swept = max(n_packed, n_moving - 2)
    place = n_packed
    while place >= 0:
        for j in range(place, swept):
            _turn_joint(rows, j, turns[j * levels + digits[j]], poses)
        limit = error_limit(objective, best[0])
        if _sweep(rows, swept, n_moving, levels, turns, poses, target, errors, limit):
            _compare(scene, stage, grid, first, packed, n_packed, swept, n_moving)
        place = count_up(digits, n_packed, swept, levels)


@device
def _stillest(levels: int) -> int:
    """Return the level nearest to standing still; the lower one of two."""
    return (levels - 1) // 2


@kernel
def _turn_joint(rows: Array, j: int, turn: Array, poses: Array) -> None:
    advance(rows[j], rows[j + 1], turn, poses[j], poses[j + 1])


@kernel
def _sweep(
    rows: Array,
    swept: int,
    n_moving: int,
    levels: int,
    turns: Array,
    poses: Array,
    target: Array,
    errors: Array,
    limit: float,
) -> bool:
    """Turn the last one or two joints through all levels; tell if an error is within the limit.

    The joints behind them turn nothing, but their links still lead on to the tip.
    """
    n, last, count = len(poses) - 1, n_moving - 1, 0
    for i in range(levels ** (last - swept)):
        for j in range(swept, last):
            advance(rows[j], rows[j + 1], turns[j * levels + i], poses[j], poses[j + 1])
        for k in range(levels):
            for j in range(last, n):
                row = j * levels + (k if j == last else 0)
                advance(rows[j], rows[j + 1], turns[row], poses[j], poses[j + 1])
            measure_errors(target, poses[n], errors[i * levels + k])
            count += count_below(errors[i * levels + k], limit)
    return count > 0


@kernel
def _compare(
    scene: Scene,
    stage: Stage,
    grid: Grid,
    first: int,
    packed: int,
    n_packed: int,
    swept: int,
    n_moving: int,
) -> None:
    """Let candidates within the zone wait for their clearance, and compare the others by error."""
    n, levels = grid.values.shape
    digits, errors, best = grid.digits, grid.errors, grid.best.cost
    indices, size, objective = grid.waiting.indices, grid.waiting.size, scene.objective
    leaves, behind = levels ** (n_moving - swept), levels ** (n - n_moving)
    still = _still_behind(n - n_moving, levels)
    for leaf in range(leaves):
        limit = error_limit(objective, best[0])
        if count_below(errors[leaf], limit) == 0:
            continue
        for lane in range(min(LANES, packed - first)):
            error = errors[leaf, lane]
            if error > limit:
                continue
            index = first + lane
            for j in range(n_packed, swept):
                index = index * levels + digits[j]
            index = (index * leaves + leaf) * behind + still
            if error > objective.zone * objective.zone:
                consider(grid.best, n, levels, index, step_cost(objective, error, np.inf))
                continue
            indices[size[0]] = index
            size[0] += 1
            if size[0] == LANES:
                _evaluate_waiting(scene, stage, grid)


@device
def _still_behind(n_joints: int, levels: int) -> int:
    """Return the index of the combination in which so many joints stand as still as they can."""
    index = 0
    for _ in range(n_joints):
        index = index * levels + _stillest(levels)
    return index


@kernel
def _evaluate_waiting(scene: Scene, stage: Stage, grid: Grid) -> None:
    n, levels = grid.values.shape
    indices, size = grid.waiting.indices, grid.waiting.size
    for lane in range(size[0]):
        rest = indices[lane]
        for j in range(n - 1, -1, -1):
            grid.block[j, lane] = grid.values[j, rest % levels]
            rest //= levels
    evaluate_block(scene, stage, grid.block, 0, grid.costs)
    for lane in range(size[0]):
        consider(grid.best, n, levels, indices[lane], grid.costs[lane])
    size[0] = 0
