"""Trajectories on a grid of joint angles, and random ones.

Wang & Zalzala (1995), section 4.1. A trajectory has a level for each joint at each of its n - 1 inner
nodes; from node to node a joint moves to one of six neighbours. Their figure 4, which showed them, is
lost: level changes of -2 to 3 are the only six around staying that lead towards the goal more often
than away from it when drawn evenly. The *favoured* step, one level towards the goal, comes with a
probability of its own, the paper's "higher probability of moving towards the end point".
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.random import Stream, new_stream, open_stream, uniform

Levels = NDArray[np.int16]

LEAST_STEP = -2
MOST_STEP = 3


class LevelGrid(NamedTuple):
    """Which levels trajectories of n segments may take.

    Attributes:
        start: Levels of the start, of shape (n_joints,).
        goal: Levels of the goal, of shape (n_joints,).
        favoured: Favoured steps, of shape (n_joints,).
        lower: Smallest levels at the inner nodes, of shape (n_joints, n - 1).
        upper: Largest levels at the inner nodes, of shape (n_joints, n - 1).
    """

    start: Levels
    goal: Levels
    favoured: Levels
    lower: Levels
    upper: Levels


class Key(NamedTuple):
    """What random streams of one generation have in common; see ``kernels.random``.

    Attributes:
        seed: Seed of the run; above 2**63 - 1 as ``numpy.uint64``.
        population: Index of the population.
        generation: Index of the generation.
    """

    seed: int
    population: int
    generation: int


class Walk(NamedTuple):
    """How random trajectories are drawn.

    Attributes:
        goal_bias: Probability of the favoured step, where it is possible.
        attempts: How often a joint's two walks may miss each other before the joint goes straight.
    """

    goal_bias: float
    attempts: int


@kernel
def random_trajectories(
    grid: LevelGrid, walk: Walk, key: Key, purpose: int, slots: NDArray[np.int64], genomes: Levels
) -> None:
    """Replace some trajectories of a population by random ones.

    Args:
        grid: Which levels they may take.
        walk: How they are drawn.
        key: Key of the generation.
        purpose: What they are drawn for.
        slots: Indices of the trajectories.
        genomes: The population, of shape (N, n_joints, n - 1).
    """
    stream = new_stream()
    for slot in slots:
        open_stream(stream, key.seed, key.population, key.generation, purpose, slot)
        draw_trajectory(grid, walk, stream, slot, genomes)


@device
def draw_trajectory(
    grid: LevelGrid, walk: Walk, stream: Stream, slot: int, genomes: Levels
) -> None:
    """Replace a trajectory by a random one."""
    for i in range(genomes.shape[1]):
        _draw_joint(grid, walk, stream, i, slot, genomes)


@kernel
def _draw_joint(
    grid: LevelGrid, walk: Walk, stream: Stream, i: int, slot: int, genomes: Levels
) -> None:
    """Walk from the start and from the goal until both walks meet: figure 5."""
    nodes = genomes.shape[2]
    n_forward = (nodes + 1) // 2
    for _ in range(walk.attempts):
        _walk_forward(grid, walk, stream, i, slot, n_forward, genomes)
        _walk_backward(grid, walk, stream, i, slot, n_forward, genomes)
        ahead = grid.goal[i] if n_forward == nodes else genomes[slot, i, n_forward]
        if is_step(genomes[slot, i, n_forward - 1], ahead):
            return
    for j in range(nodes):
        genomes[slot, i, j] = grid.start[i] + grid.favoured[i] * (j + 1)


@device
def _walk_forward(
    grid: LevelGrid, walk: Walk, stream: Stream, i: int, slot: int, last: int, genomes: Levels
) -> None:
    level = int(grid.start[i])
    for j in range(last):
        least = max(LEAST_STEP, grid.lower[i, j] - level)
        most = min(MOST_STEP, grid.upper[i, j] - level)
        level += _draw_step(least, most, grid.favoured[i], walk.goal_bias, uniform(stream))
        genomes[slot, i, j] = level


@device
def _walk_backward(
    grid: LevelGrid, walk: Walk, stream: Stream, i: int, slot: int, last: int, genomes: Levels
) -> None:
    """Take the steps in reverse, from the goal."""
    level = int(grid.goal[i])
    for j in range(genomes.shape[2] - 1, last - 1, -1):
        least = max(LEAST_STEP, level - grid.upper[i, j])
        most = min(MOST_STEP, level - grid.lower[i, j])
        level -= _draw_step(least, most, grid.favoured[i], walk.goal_bias, uniform(stream))
        genomes[slot, i, j] = level


@device
def _draw_step(least: int, most: int, favoured: int, bias: float, u: float) -> int:
    """Turn a number in [0, 1) into a step: the favoured one, or evenly one of the others."""
    possible = least <= favoured <= most
    others = max(most - least, 0) if possible else most - least + 1
    if possible and (u < bias or others == 0):
        return favoured
    rest = (u - bias) / (1.0 - bias) if possible else u
    step = least + min(int(rest * others), others - 1)
    return step + 1 if possible and step >= favoured else step


@device
def is_step(level: int, after: int) -> bool:
    """Return whether a joint may move between two levels from one node to the next."""
    return LEAST_STEP <= after - level <= MOST_STEP


@device
def level_at(grid: LevelGrid, genomes: Levels, slot: int, i: int, node: int) -> int:
    """Return the level of a joint at a node, from 0 (the start) to n (the goal)."""
    if node == 0:
        return int(grid.start[i])
    if node > genomes.shape[2]:
        return int(grid.goal[i])
    return int(genomes[slot, i, node - 1])
