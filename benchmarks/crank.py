"""Quality and cost of the design of the crank's arm, on one core, in one process.

Run as ``python -m benchmarks.crank [--seeds 8] [--most-points 128]``. Quality q is the mean dexterity of
the links found, with exact poses, over the optimum's. Every method may evaluate one arm at one task
point 100,000 times the number of points. Seconds are processor time, for information; bars are ratios.
"""

import argparse
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tramnet_master.console import people
from tramnet_master.design_methods import (
    BUDGET,
    POINTS,
    Found,
    by_mpga,
    measure,
    measure_methods,
    step_1,
)
from tramnet_master.reports.method_table import method_table
from tramnet_workers.evolution.coupling import medians
from tramnet_workers.evolution.encodings import Layout, decode, gene_steps
from tramnet_workers.evolution.mpga import run_mpga
from tramnet_workers.kernels.design import RC
from tramnet_workers.mpga_settings import SETTINGS, GeneticSettings
from tramnet_workers.problems.checks import follow_poses
from tramnet_workers.problems.crank_design import PlanarDesign
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.progressive import Outcome, advance, begin

Floats = NDArray[np.float64]

FIRST_SEED = 1000
REQUIRED_SPREAD = {4: 0.003, 64: 0.010}  # [m]
REQUIRED_Q, REQUIRED_WORST, REQUIRED_POLISHED = 0.98, 0.97, 0.999
REQUIRED_OVERHEAD, REQUIRED_CONSTANCY = 1.5, 1.3


def main() -> None:
    """Print the tables."""
    arguments = _arguments()
    seeds = range(FIRST_SEED, FIRST_SEED + arguments.seeds)
    points = [t for t in POINTS if t <= arguments.most_points]
    run_mpga(*_short(4, 3), seed=0)  # loads the compiled kernels
    _print_quality([t for t in points if t in (4, 16, 64)], seeds)
    _print_cost(points)
    people.print(method_table(measure_methods(points, seeds), BUDGET))
    _print_progressive(seeds)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--most-points", type=int, default=128)
    return parser.parse_args()


def _short(points: int, generations: int) -> tuple[PlanarDesign, GeneticSettings]:
    problem, genetic = step_1(points, "recommended")
    return problem, replace(genetic, generations=generations)


def _print_quality(points: Iterable[int], seeds: range) -> None:
    print(f"MPGA, m = 100, 1000 generations, {len(seeds)} seeds")
    print("settings       t   q mean  q worst  link spread mean, worst [mm]")
    spreads: dict[tuple[str, int], float] = {}
    for settings in ("literal", "recommended", "polished"):
        for t in points:
            found = measure(t, seeds, by_mpga(t, settings))
            spreads[settings, t] = float(found.spread.mean())
            print(
                f"{settings:<12} {t:>3}   {found.quality.mean():.4f}   {found.quality.min():.4f}  "
                f"{1e3 * found.spread.mean():8.2f} {1e3 * found.spread.max():8.2f}"
                f"   {_quality_verdict(settings, t, found)}"
            )
    for t in points:
        ratio = spreads["literal", t] / spreads["recommended", t]
        print(f"t = {t}: literal spread over recommended {ratio:.0f} {_verdict(ratio > 10.0)}")
    print()


def _quality_verdict(settings: str, t: int, found: Found) -> str:
    if settings == "polished":
        return _verdict(found.quality.min() >= REQUIRED_POLISHED)
    if settings == "literal":
        return ""
    good = found.quality.mean() >= REQUIRED_Q and found.quality.min() >= REQUIRED_WORST
    return _verdict(bool(good and found.spread.max() <= REQUIRED_SPREAD.get(t, np.inf)))


def _print_cost(points: Iterable[int]) -> None:
    """Print what a generation costs, and how much of it is not evaluation of eqs (1) to (11)."""
    print("cost of MPGA, recommended, m = 100")
    print("  t   s for 1000 generations   us a population and generation   over evaluation")
    each: list[float] = []
    for t in points:
        generations = max(100, 4000 // t)
        problem, genetic = _short(t, generations)
        run = _least_seconds(partial(run_mpga, problem, genetic, 1))
        alone = _least_seconds(partial(_only_evaluate, problem, genetic))
        each.append(run / generations / t)
        ratio = run / alone
        print(
            f"{t:>3} {1000 * run / generations:24.3f} {1e6 * each[-1]:32.2f} {ratio:17.2f}"
            f"   {_verdict(ratio <= REQUIRED_OVERHEAD)}"
        )
    constancy = max(each) / min(each)
    print(
        f"dearest over cheapest population {constancy:.2f} {_verdict(constancy <= REQUIRED_CONSTANCY)}\n"
    )


def _only_evaluate(problem: PlanarDesign, genetic: GeneticSettings) -> None:
    """Evaluate eqs (1) to (11) for as many individuals as a run does, and nothing else."""
    t, m, n_traits = problem.n_populations, genetic.population_size, len(problem.circular)
    free = np.flatnonzero((problem.lower != problem.upper).any(axis=0))
    layout = Layout(len(free), genetic.bits)
    rng = np.random.default_rng(0)
    strings = rng.integers(0, 2**60, (t, layout.n_words, m), dtype=np.uint64)
    step = gene_steps(problem.lower, problem.upper, genetic.bits)
    genes = np.repeat(problem.lower[:, :, None], m, axis=2)
    traits, terms = np.empty((t, n_traits, m)), np.empty((t, problem.n_terms, m))
    values, fitness = np.empty((t, n_traits)), np.empty((t, m))
    for generation in range(genetic.generations):
        decode(strings, genetic.bits, True, problem.lower, step, free, genes)
        problem.evaluate(0, genes, traits, terms)
        medians(problem.circular, traits, values)
        problem.rate(0, generation, values, traits, terms, fitness)


def _print_progressive(seeds: range) -> None:
    print("Progressive Design of the crank, recommended")
    print("seed  returns  stations  RC max [m]  end error [rad]  null peak/mean exact  printed  s")
    for seed in seeds:
        started = time.process_time()
        task, outcome = _designed(seed)
        seconds = time.process_time() - started
        printed = follow_poses(task, outcome.poses, exact_gain=False)
        reach, end = outcome.terms[:, RC].max(), outcome.motion.end_errors.max()
        exact, peak = outcome.motion.null_peaks.max(), printed.null_peaks.min()
        good = reach <= 1e-3 and end <= 1e-3 and exact <= 1.1 and peak > 2.0
        print(
            f"{seed:>4}  {outcome.returns:>7}  {len(outcome.terms):>8}  {reach:10.1e}  {end:15.1e}"
            f"  {exact:20.3f}  {peak:7.2f}  {seconds:.2f} "
            f"{_verdict(bool(good) and not outcome.violations)}"
        )


def _designed(seed: int) -> tuple[DesignTask, Outcome]:
    state = begin(DesignTask(), SETTINGS["recommended"])
    while state.stage is not None:
        found = run_mpga(state.stage.problem, state.stage.genetic, seed, stream=state.stream)
        state = advance(state, found.final_traits)
    assert state.outcome is not None
    return state.task, state.outcome


def _least_seconds(call: Callable[[], object], repeats: int = 5) -> float:
    times = []
    for _ in range(repeats):
        started = time.process_time()
        call()
        times.append(time.process_time() - started)
    return min(times)


def _verdict(reached: bool) -> str:
    return "reached" if reached else "MISSED"


if __name__ == "__main__":
    main()
