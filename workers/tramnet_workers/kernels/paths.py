"""Runs of points of a path, followed by one of the methods, a step after the other.

Each function takes the joint angles at the point before the run, and writes the angles at its
points and the costs of the steps. What it writes depends on nothing else, not even on the step
before, so a path may be cut into runs anywhere. Storage is allocated once per run.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.breeding import Breeding, new_nursery
from tramnet_workers.kernels.differential import (
    Ascent,
    correct_step,
    new_tangent,
    resolve_step,
)
from tramnet_workers.kernels.eamp import evolve_step
from tramnet_workers.kernels.grids import new_grid, search_naively
from tramnet_workers.kernels.perturbation import search_shared
from tramnet_workers.kernels.scenes import Scene
from tramnet_workers.kernels.tracking import new_stage, set_stage

Array = NDArray[np.float64]


@kernel
def follow_by_evolution(
    scene: Scene,
    breeding: Breeding,
    warm: bool,
    first: int,
    posture: Array,
    path: Array,
    costs: Array,
) -> None:
    """Follow points of a path by evolution: EAMP of Lin, Chen & Yu (2017).

    Args:
        scene: The task.
        breeding: How populations evolve.
        warm: Whether each first population has the step 0 and a Gauss-Newton step.
        first: Number of the first point, from 1.
        posture: Joint angles at the point before it, of shape (n,) [rad].
        path: Receives the joint angles at the points, of shape (n_points, n) [rad].
        costs: Receives the costs of the steps, of shape (n_points,).
    """
    n = path.shape[1]
    stage, nursery, tangent = new_stage(scene), new_nursery(breeding, n), new_tangent(n)
    dq, q, hints = np.empty(n), posture.copy(), np.zeros((2 if warm else 0, n))
    for i in range(len(path)):
        set_stage(scene, first + i, q, stage)
        if warm:
            hints[1, :] = 0.0
            correct_step(scene, stage, q, 1, tangent, hints[1])
        costs[i] = evolve_step(scene, stage, breeding, first + i, hints, nursery, dq)
        take_step(scene, dq, q)
        path[i] = q


@kernel
def follow_by_memetics(
    scene: Scene,
    breeding: Breeding,
    ascent: Ascent,
    n_corrections: int,
    first: int,
    posture: Array,
    path: Array,
    costs: Array,
) -> None:
    """Follow points of a path by evolution with local search.

    Each first population has the step 0 and that of resolved-rate control; the best individual of
    the last one is corrected by Gauss-Newton steps.

    Args:
        scene: The task.
        breeding: How populations evolve.
        ascent: How resolved-rate control moves away from the boxes.
        n_corrections: Number of Gauss-Newton steps.
        first: Number of the first point, from 1.
        posture: Joint angles at the point before it, of shape (n,) [rad].
        path: Receives the joint angles at the points, of shape (n_points, n) [rad].
        costs: Receives the costs of the steps, of shape (n_points,).
    """
    n = path.shape[1]
    stage, nursery, tangent = new_stage(scene), new_nursery(breeding, n), new_tangent(n)
    dq, q, hints = np.empty(n), posture.copy(), np.zeros((2, n))
    for i in range(len(path)):
        set_stage(scene, first + i, q, stage)
        resolve_step(scene, stage, q, ascent, 1, tangent, hints[1])
        evolve_step(scene, stage, breeding, first + i, hints, nursery, dq)
        costs[i] = correct_step(scene, stage, q, n_corrections, tangent, dq)
        take_step(scene, dq, q)
        path[i] = q


@kernel
def follow_by_rates(
    scene: Scene,
    ascent: Ascent,
    n_corrections: int,
    first: int,
    posture: Array,
    path: Array,
    costs: Array,
) -> None:
    """Follow points of a path by resolved-rate control with ascent of the clearance.

    Args:
        scene: The task.
        ascent: How the arm moves away from the boxes in the null space.
        n_corrections: Number of Gauss-Newton steps that end each step.
        first: Number of the first point, from 1.
        posture: Joint angles at the point before it, of shape (n,) [rad].
        path: Receives the joint angles at the points, of shape (n_points, n) [rad].
        costs: Receives the costs of the steps, of shape (n_points,).
    """
    n = path.shape[1]
    stage, tangent = new_stage(scene), new_tangent(n)
    dq, q = np.empty(n), posture.copy()
    for i in range(len(path)):
        set_stage(scene, first + i, q, stage)
        costs[i] = resolve_step(scene, stage, q, ascent, n_corrections, tangent, dq)
        take_step(scene, dq, q)
        path[i] = q


@kernel
def follow_by_perturbation(
    scene: Scene,
    levels: int,
    first: int,
    posture: Array,
    path: Array,
    costs: Array,
) -> None:
    """Follow points of a path by the perturbation method, sharing common parts of combinations.

    Args:
        scene: The task.
        levels: Number of values of each joint's change.
        first: Number of the first point, from 1.
        posture: Joint angles at the point before it, of shape (n,) [rad].
        path: Receives the joint angles at the points, of shape (n_points, n) [rad].
        costs: Receives the costs of the steps, of shape (n_points,).
    """
    n = path.shape[1]
    stage, grid = new_stage(scene), new_grid(n, levels)
    dq, q = np.empty(n), posture.copy()
    for i in range(len(path)):
        set_stage(scene, first + i, q, stage)
        costs[i] = search_shared(scene, stage, grid, dq)
        take_step(scene, dq, q)
        path[i] = q


@kernel
def follow_by_naive_perturbation(
    scene: Scene, levels: int, first: int, posture: Array, path: Array, costs: Array
) -> None:
    """Follow points of a path by the perturbation method, each combination on its own.

    Args:
        scene: The task.
        levels: Number of values of each joint's change.
        first: Number of the first point, from 1.
        posture: Joint angles at the point before it, of shape (n,) [rad].
        path: Receives the joint angles at the points, of shape (n_points, n) [rad].
        costs: Receives the costs of the steps, of shape (n_points,).
    """
    n = path.shape[1]
    stage, grid = new_stage(scene), new_grid(n, levels)
    dq, q = np.empty(n), posture.copy()
    for i in range(len(path)):
        set_stage(scene, first + i, q, stage)
        costs[i] = search_naively(scene, stage, grid, dq)
        take_step(scene, dq, q)
        path[i] = q


@device
def take_step(scene: Scene, dq: Array, q: Array) -> None:
    """Move q by dq, or by so little less that rounding leads over no limit."""
    for j in range(len(q)):
        reached, short = q[j] + dq[j], 2.0**-40
        while abs(reached - q[j]) > scene.step[j]:
            reached = q[j] + dq[j] * (1.0 - short)
            short *= 2.0
        q[j] = min(max(reached, scene.lower[j]), scene.upper[j])
