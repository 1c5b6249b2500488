"""What the methods of ``crank`` find at equal evaluations, measured in this process.

Each may evaluate one arm at one task point ``BUDGET`` times the number of points. Quality is the mean dexterity of
the links found, with exact poses, over that of the best arm. Times are processor time.
"""

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_master.reports.method_table import MethodOutcome
from tramnet_workers.evolution.mpga import run_mpga
from tramnet_workers.mpga_settings import SETTINGS, GeneticSettings
from tramnet_workers.problems.bilevel import polish, run_bilevel, worth
from tramnet_workers.problems.crank_design import PlanarDesign
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.design_yardsticks import best_arm
from tramnet_workers.problems.single_design import single_design, single_genetic
from tramnet_workers.problems.stages import design_stage

Floats = NDArray[np.float64]

BUDGET = 100_000
"""Evaluations for each task point."""

POINTS = (4, 8, 16, 32, 64, 128)
"""Numbers of task points that are compared."""

_ORIGIN = np.zeros(2)


class Links(NamedTuple):
    """What a search ends with.

    Attributes:
        lengths: Link lengths, of shape (3,) [m].
        spread: Largest difference between populations in one of them [m].
    """

    lengths: Floats
    spread: float


Search = Callable[[int], Links]
"""Returns what is found with a seed."""


class Found(NamedTuple):
    """What a method found with some seeds.

    Attributes:
        quality: Of each seed's links.
        spread: Of each seed's populations [m].
        seconds: Processor time of each run [s].
    """

    quality: Floats
    spread: Floats
    seconds: Floats


def crank_task(points: int) -> DesignTask:
    """Return the paper's crank with a number of task points, evenly spaced."""
    return DesignTask(stations=tuple(np.arange(points) / points))


def step_1(points: int, settings: str) -> tuple[PlanarDesign, GeneticSettings]:
    """Return step 1 of ``mpga`` for the crank, without a rule for elbows, and its genetic settings."""
    stage = design_stage(crank_task(points), replace(SETTINGS[settings], elbow=None))
    assert isinstance(stage.problem, PlanarDesign)
    return stage.problem, stage.genetic


def by_mpga(points: int, settings: str = "recommended") -> Search:
    """Return the search by connected populations, under settings of a name."""
    problem, genetic = step_1(points, settings)

    def search(seed: int) -> Links:
        lengths = run_mpga(problem, genetic, seed).final_traits[:, :3]
        if SETTINGS[settings].polish:
            found = polish(crank_task(points), lengths.mean(axis=0), _ORIGIN)
            return Links(np.array(found.lengths), 0.0)
        return Links(lengths.mean(axis=0), float(np.ptp(lengths, axis=0).max()))

    return search


def by_single_ga(points: int) -> Search:
    """Return the search by one population with all variables."""
    task, settings = crank_task(points), SETTINGS["recommended"]
    problem, genetic = (
        single_design(task, settings),
        single_genetic(task, settings, BUDGET * points),
    )
    return lambda seed: Links(run_mpga(problem, genetic, seed).final_traits[0, :3], 0.0)


def by_bilevel(points: int) -> Search:
    """Return the search by CMA-ES over the links."""
    task = crank_task(points)
    return lambda seed: Links(np.array(run_bilevel(task, BUDGET * points, seed).lengths), 0.0)


METHODS: Mapping[str, Callable[[int], Search]] = {
    "mpga": by_mpga,
    "single-ga": by_single_ga,
    "bilevel-cma": by_bilevel,
}
"""The methods by name."""


def measure(points: int, seeds: Iterable[int], search: Search) -> Found:
    """Search with some seeds and measure the links found by exact poses."""
    task = crank_task(points)
    optimum, rows = best_arm(task).dexterity, []
    for seed in seeds:
        started = time.process_time()
        links = search(seed)
        seconds = time.process_time() - started
        rows.append((worth(task, links.lengths, _ORIGIN).mean / optimum, links.spread, seconds))
    return Found(*np.array(rows).T)


def measure_methods(
    points: Iterable[int], seeds: range, tell: Callable[[str], None] = lambda _: None
) -> list[MethodOutcome]:
    """Measure each method for each number of points; fewer seeds where there are many points.

    Args:
        points: Numbers of task points.
        seeds: Seeds to search with.
        tell: Is told what is measured next.
    """
    for search_for in METHODS.values():
        search_for(POINTS[0])(0)  # loads the compiled kernels
    outcomes = []
    for t in points:
        few = seeds[: max(2, len(seeds) * 8 // t)] if t > 8 else seeds
        for method, search_for in METHODS.items():
            tell(f"{method}, {t} points")
            found = measure(t, few, search_for(t))
            outcomes.append(
                MethodOutcome(
                    method, t, tuple(found.quality.tolist()), tuple(found.seconds.tolist())
                )
            )
    return outcomes
