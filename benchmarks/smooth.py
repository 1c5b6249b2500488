"""How near the smooth planner comes to the physical limit, how honest its plans are, and how fast.

Run as ``python -m benchmarks.smooth --seeds 20``. For both arms and each seed from 1 on, the paper's
task is planned with the method's own population and generations, in one process, and every plan is
verified. Processor time is counted: that of the whole run, and of breeding apart from evaluation.
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.evolution.smooth import GENERATIONS, POPULATION_SIZE, SmoothEvolution
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.smooth_motion import SmoothMotion
from tramnet_workers.problems.straight_line import straight_line
from tramnet_workers.problems.verification import LARGEST_RATIO, Verification, verify
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START, reference_limit
from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.puma560 import akb, p560

LARGEST_GAP = 0.01
LARGEST_ERROR = 1e-6  # at the end of the open-loop simulation [rad]


@dataclass(frozen=True)
class Run:
    """One run and its plan.

    Attributes:
        gap: Motion time above the physical limit, as a part of it.
        found: What verification says.
        evaluating: Processor time of the evaluations [s].
        breeding: Processor time of the genetic operators [s].
        planning: Processor time of the final plan, timed on the fine grid [s].
    """

    gap: float
    found: Verification
    evaluating: float
    breeding: float
    planning: float

    @property
    def seconds(self) -> float:
        """Processor time of the run [s]."""
        return self.evaluating + self.breeding + self.planning


def main() -> None:
    """Print the medians of each arm beside their bars."""
    parser = argparse.ArgumentParser(description="The smooth planner against the physical limit.")
    parser.add_argument("--seeds", type=int, default=20, help="number of seeds")
    seeds = parser.parse_args().seeds
    print(f"{seeds} seeds, {POPULATION_SIZE} individuals, {GENERATIONS} generations")
    for arm in (akb(), p560()):
        report(arm, [plan_once(arm, seed) for seed in range(seeds + 1)][1:])  # 0 warms up


def plan_once(arm: SerialArm, seed: int) -> Run:
    """Plan the paper's task once and verify the plan."""
    task = MotionTask.for_arm(arm, PAPER_START, PAPER_GOAL)
    problem = SmoothMotion(task)
    genome, evaluating, breeding = evolve(problem, seed)
    began = time.process_time()
    plan = problem.plan(genome)
    planning = time.process_time() - began
    limit = reference_limit(task)
    assert plan is not None
    assert limit is not None
    gap = plan.duration / limit - 1.0
    return Run(gap, verify(task, plan), evaluating, breeding, planning)


def evolve(problem: SmoothMotion, seed: int) -> tuple[NDArray[np.generic], float, float]:
    """Return the best chromosome of a run, and what evaluating and breeding took [s]."""
    algorithm = SmoothEvolution(seed, POPULATION_SIZE, GENERATIONS, problem.lower, problem.upper)
    evaluating = breeding = 0.0
    genomes = algorithm.initial()
    for generation in range(1, GENERATIONS + 1):
        began = time.process_time()
        objectives = problem.evaluate(genomes)
        evaluated = time.process_time()
        evaluating += evaluated - began
        if generation < GENERATIONS:
            genomes = algorithm.breed(genomes, objectives, generation)
            breeding += time.process_time() - evaluated
    return genomes[objectives.argmin()], evaluating, breeding


def report(arm: SerialArm, runs: list[Run]) -> None:
    """Print what the runs on an arm came to."""
    task = MotionTask.for_arm(arm, PAPER_START, PAPER_GOAL)
    limit, line = reference_limit(task), straight_line(task)
    assert limit is not None
    assert line is not None
    gaps = np.array([run.gap for run in runs])
    ratio = max(run.found.torque_ratio_max for run in runs)
    error = max(run.found.simulated_position_error for run in runs)
    gap = float(np.median(gaps))
    evaluating, breeding, seconds = (
        float(np.median([getattr(run, name) for run in runs]))
        for name in ("evaluating", "breeding", "seconds")
    )
    print(f"{arm.name}: limit {limit} s, straight line {line.duration:.4f} s")
    print(
        f"  motion time: median {limit * (1 + gap):.4f} s, {100 * gap:.2f} % above the limit "
        f"({100 * gaps.min():.2f} to {100 * gaps.max():.2f}; "
        f"bar: {100 * LARGEST_GAP:g}, {_verdict(gap <= LARGEST_GAP)})"
    )
    print(
        f"  largest torque ratio: {ratio:.7f} (bar: {LARGEST_RATIO}, "
        f"{_verdict(ratio <= LARGEST_RATIO)})"
    )
    print(
        f"  largest open-loop end error: {error:.1e} rad (bar: {LARGEST_ERROR:g}, "
        f"{_verdict(error < LARGEST_ERROR)})"
    )
    print(
        f"  a run takes {seconds:.2f} s: evaluating {evaluating:.2f}, breeding {breeding:.2f}; "
        f"{1e6 * evaluating / (POPULATION_SIZE * GENERATIONS):.0f} us an evaluation"
    )
    print(f"  verified: {sum(run.found.passed for run in runs)} of {len(runs)}")


def _verdict(reached: bool) -> str:
    return "reached" if reached else "MISSED"


if __name__ == "__main__":
    main()
