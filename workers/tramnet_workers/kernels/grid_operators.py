"""Genetic operators for trajectories on a grid: Wang & Zalzala (1995), section 4.3."""

from typing import NamedTuple

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.grid import (
    Key,
    LevelGrid,
    Levels,
    Walk,
    draw_trajectory,
    is_step,
    level_at,
)
from tramnet_workers.kernels.random import Stream, below, new_stream, open_stream, uniform


class Circle(NamedTuple):
    """How crossover goes about.

    Attributes:
        rate: Probability that a pair tries to cross.
        radius: Largest distance of the two crossing sites [levels].
        attempts: How many sites a pair tries.
    """

    rate: float
    radius: int
    attempts: int


class Shift(NamedTuple):
    """How the position operator goes about.

    Attributes:
        rate: Probability that it changes a trajectory.
        nodes: Most nodes that it moves in one.
        variation: Farthest that it moves one [levels].
    """

    rate: float
    nodes: int
    variation: int


@kernel
def cross_circles(grid: LevelGrid, circle: Circle, key: Key, purpose: int, genomes: Levels) -> None:
    """Cross trajectories 0 and 1, 2 and 3, and so on, in place.

    A pair swaps everything after a node of a joint: the rest of that joint's way and all later
    joints. It does so only where the second trajectory passes within a circle about the first one's
    node, and both ways across are possible steps; otherwise it tries another node.

    Args:
        grid: Which levels trajectories may take.
        circle: How to cross.
        key: Key of the generation.
        purpose: What the numbers are drawn for.
        genomes: Trajectories, of shape (N, n_joints, n - 1).
    """
    stream = new_stream()
    for pair in range(genomes.shape[0] // 2):
        open_stream(stream, key.seed, key.population, key.generation, purpose, pair)
        if uniform(stream) < circle.rate:
            _cross_pair(grid, circle, stream, 2 * pair, genomes)


@device
def _cross_pair(
    grid: LevelGrid, circle: Circle, stream: Stream, slot: int, genomes: Levels
) -> None:
    for _ in range(circle.attempts):
        i = below(stream, genomes.shape[1])
        node = 1 + below(stream, genomes.shape[2])
        if _may_cross(grid, circle.radius, slot, i, node, genomes):
            _swap_after(slot, i, node, genomes)
            return


@device
def _may_cross(grid: LevelGrid, radius: int, slot: int, i: int, node: int, genomes: Levels) -> bool:
    a, b = level_at(grid, genomes, slot, i, node), level_at(grid, genomes, slot + 1, i, node)
    after_a = level_at(grid, genomes, slot, i, node + 1)
    after_b = level_at(grid, genomes, slot + 1, i, node + 1)
    return abs(a - b) <= radius and is_step(a, after_b) and is_step(b, after_a)


@device
def _swap_after(slot: int, joint: int, node: int, genomes: Levels) -> None:
    for i in range(joint, genomes.shape[1]):
        for j in range(node if i == joint else 0, genomes.shape[2]):
            a, b = genomes[slot, i, j], genomes[slot + 1, i, j]
            genomes[slot, i, j], genomes[slot + 1, i, j] = b, a


@kernel
def shift_positions(grid: LevelGrid, shift: Shift, key: Key, purpose: int, genomes: Levels) -> None:
    """Move a few nodes of some trajectories, in place: the position operator.

    A node moves only if it stays on the grid, and the steps to it and from it stay possible.

    Args:
        grid: Which levels trajectories may take.
        shift: How to move.
        key: Key of the generation.
        purpose: What the numbers are drawn for.
        genomes: Trajectories, of shape (N, n_joints, n - 1).
    """
    stream = new_stream()
    for slot in range(genomes.shape[0]):
        open_stream(stream, key.seed, key.population, key.generation, purpose, slot)
        if uniform(stream) < shift.rate:
            for _ in range(1 + below(stream, shift.nodes)):
                _shift_node(grid, shift.variation, stream, slot, genomes)


@device
def _shift_node(
    grid: LevelGrid, variation: int, stream: Stream, slot: int, genomes: Levels
) -> None:
    i = below(stream, genomes.shape[1])
    node = 1 + below(stream, genomes.shape[2])
    drawn = below(stream, 2 * variation)
    level = level_at(grid, genomes, slot, i, node) + (
        drawn - variation if drawn < variation else drawn - variation + 1
    )
    before = level_at(grid, genomes, slot, i, node - 1)
    after = level_at(grid, genomes, slot, i, node + 1)
    on_grid = grid.lower[i, node - 1] <= level <= grid.upper[i, node - 1]
    if on_grid and is_step(before, level) and is_step(level, after):
        genomes[slot, i, node - 1] = level


@kernel
def destroy_trajectories(
    grid: LevelGrid, walk: Walk, rate: float, key: Key, purpose: int, genomes: Levels
) -> None:
    """Replace some trajectories by random ones, in place: the destroy-trajectory operator.

    Args:
        grid: Which levels trajectories may take.
        walk: How random ones are drawn.
        rate: Probability that a trajectory is destroyed.
        key: Key of the generation.
        purpose: What the numbers are drawn for.
        genomes: Trajectories, of shape (N, n_joints, n - 1).
    """
    stream = new_stream()
    for slot in range(genomes.shape[0]):
        open_stream(stream, key.seed, key.population, key.generation, purpose, slot)
        if uniform(stream) < rate:
            draw_trajectory(grid, walk, stream, slot, genomes)
