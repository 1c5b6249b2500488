"""Evolution of the steps of a redundant arm along a path, a population for each point.

EAMP of Lin, Chen & Yu (2017): real-coded individuals dq, tournament, crossover (eq. 18), mutation
(eq. 19), elitism. The whole evolution of a point is a function of the posture before it and of the
key (seed, population, point), so that any worker may compute any run of points. Streams are opened
for each individual of the first population, for each couple and for each child that mutates; the
generation in their key is the point in its high half and the generation in its low half.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.breeding import Breeding, Nursery, breed, keep_elites
from tramnet_workers.kernels.lanes import LANES
from tramnet_workers.kernels.random import open_stream, uniform
from tramnet_workers.kernels.scenes import Scene
from tramnet_workers.kernels.tracking import Stage, evaluate_block

Array = NDArray[np.float64]
Words = NDArray[np.uint64]

#: Purpose of the streams of the first population, as in ``evolution.streams``.
FIRST_STEPS = 10


@kernel
def evolve_step(
    scene: Scene,
    stage: Stage,
    breeding: Breeding,
    k: int,
    hints: Array,
    nursery: Nursery,
    dq: Array,
) -> float:
    """Find a step to point k of the path.

    Args:
        scene: The task.
        stage: From ``set_stage``.
        breeding: How populations evolve.
        k: Number of the point, from 1.
        hints: Steps that the first population has beside random ones, of shape (n_hints, n) [rad].
        nursery: Scratch.
        dq: Receives the best step; the lowest index of equals, of shape (n,) [rad].

    Returns:
        Its cost.
    """
    size, n = breeding.size, len(dq)
    parents, children = nursery.genes[:n], nursery.genes[n:]
    costs, next_costs = nursery.costs[0], nursery.costs[1]
    first_steps(scene, stage, breeding, k, hints, nursery)
    for generation in range(1, breeding.generations + 1):
        breed(
            breeding,
            (k << 32) | generation,
            stage.low,
            stage.high,
            nursery,
            parents,
            costs,
            children,
        )
        keep_elites(breeding, parents, costs, children, next_costs)
        _evaluate(scene, stage, children, size - breeding.elites, next_costs)
        parents, children = children, parents
        costs, next_costs = next_costs, costs
    best = 0
    for i in range(1, size):
        if costs[i] < costs[best]:
            best = i
    for j in range(n):
        dq[j] = parents[j, best]
    return float(costs[best])


@kernel
def first_steps(
    scene: Scene, stage: Stage, breeding: Breeding, k: int, hints: Array, nursery: Nursery
) -> None:
    """Draw the first population, each individual the best of so many draws, with its costs.

    Args:
        scene: The task.
        stage: From ``set_stage``.
        breeding: How populations evolve.
        k: Number of the point, from 1.
        hints: Steps that the first population has beside random ones, of shape (n_hints, n) [rad].
        nursery: Receives genes and costs in its first half.
    """
    size, n = breeding.size, len(stage.low)
    chosen, trial = nursery.genes[:n], nursery.genes[n:]
    costs, trial_costs = nursery.costs[0], nursery.costs[1]
    _draw(breeding, k << 32, 0, stage, chosen, nursery.stream)
    for i in range(len(hints)):
        for j in range(n):
            chosen[j, i] = min(max(hints[i, j], stage.low[j]), stage.high[j])
    _evaluate(scene, stage, chosen, size, costs)
    for draw in range(1, breeding.draws):
        _draw(breeding, k << 32, draw * size, stage, trial, nursery.stream)
        _evaluate(scene, stage, trial, size, trial_costs)
        for i in range(size):
            if trial_costs[i] < costs[i]:
                costs[i] = trial_costs[i]
                for j in range(n):
                    chosen[j, i] = trial[j, i]


@kernel
def _evaluate(scene: Scene, stage: Stage, genes: Array, count: int, costs: Array) -> None:
    for first in range(0, count, LANES):
        evaluate_block(scene, stage, genes, first, costs)


@kernel
def _draw(
    breeding: Breeding, key: int, slot: int, stage: Stage, genes: Array, stream: Words
) -> None:
    """Fill a population with uniform random individuals, from a slot of the streams on."""
    low, high = stage.low, stage.high
    for i in range(breeding.size):
        open_stream(stream, breeding.seed, breeding.population, key, FIRST_STEPS, slot + i)
        for j in range(len(low)):
            genes[j, i] = low[j] + (high[j] - low[j]) * uniform(stream)
