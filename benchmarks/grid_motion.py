"""The 1995 algorithm: what a chromosome costs against inverse dynamics, and breeding against evaluating.

Run as ``python -m benchmarks.grid_motion``. A chromosome of 16 segments needs 3 inverse dynamics a
segment (K, H v and g of eq 5). Everything is processor time of one thread. Evaluations are measured
in interleaved repeats, whose medians are compared; breeding in runs, as it meets populations and
caches there. Times are for information, the bars are ratios.
"""

import functools
import statistics
import time
from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.evolution.wang_zalzala import WangZalzala
from tramnet_workers.kernels import kernel, switching
from tramnet_workers.kernels.dynamics import LANES, dynamics_workspace, inverse_dynamics
from tramnet_workers.problems.grid_motion import DecodingSettings, GridMotion
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.puma560 import akb

Array = NDArray[np.float64]
Switch = Literal["literal", "continuous"]
Posture = Literal["start", "middle", "exact"]

CHROMOSOMES = 6 * LANES  # whole blocks, as the inverse dynamics get them
REPEATS = 101
DYNAMICS_EACH = 48
DYNAMICS = f"{DYNAMICS_EACH} inverse dynamics"

POPULATION = 100
MOST_DYNAMICS = 1.2
MOST_BREEDING = 1.0

KINDS: tuple[tuple[Switch, Posture], ...] = (
    ("literal", "start"),
    ("literal", "exact"),
    ("continuous", "start"),
    ("continuous", "exact"),
)


class Run(NamedTuple):
    """Processor time of a run.

    Attributes:
        evaluating: Of all evaluations [s].
        breeding: Of the genetic operators [s].
    """

    evaluating: float
    breeding: float


def main() -> None:
    """Print costs and ratios."""
    costs = measure(contestants())
    for name, cost in costs.items():
        print(f"{name:<24} {cost:8.2f} us a chromosome, {cost / costs[DYNAMICS]:6.2f} of the first")
    ratio = costs["literal, start"] / costs[DYNAMICS]
    _judge(f"a chromosome, in {DYNAMICS}", ratio, MOST_DYNAMICS)
    case_1 = run(16, "literal", 300)
    _judge("breeding, in evaluations", case_1.breeding / case_1.evaluating, MOST_BREEDING)
    print(f"case 1: {sum(case_1):.2f} s of computing")
    switches: tuple[Switch, ...] = ("literal", "continuous")
    for switch in switches:
        seconds = 100 * sum(run(25, switch, 500))
        print(f"case 7, {switch} switch: {seconds:.0f} s of computing for 50,000 generations")


def contestants() -> dict[str, Callable[[], object]]:
    """Return what to compare, each for all chromosomes once."""
    task = MotionTask.for_arm(akb(), PAPER_START, PAPER_GOAL)
    genomes = WangZalzala(1, CHROMOSOMES, GridMotion(task).grid).initial()
    rng = np.random.default_rng(560)
    states = rng.uniform(-1.0, 1.0, (8, 3, 6, LANES))  # few, so that they stay in the cache
    n_blocks = DYNAMICS_EACH * CHROMOSOMES // LANES
    torques, work = np.empty((6, LANES)), dynamics_workspace(6)
    calls: dict[str, Callable[[], object]] = {
        DYNAMICS: lambda: _all_blocks(
            n_blocks, task.arm.table, task.arm.gravity, states, torques, work
        )
    }
    for switch, posture in KINDS:
        problem = GridMotion(task, DecodingSettings(switch=switch, posture=posture))
        calls[f"{switch}, {posture}"] = functools.partial(_evaluate_afresh, problem, genomes)
    return calls


def measure(calls: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Return the median processor time of each call [us per chromosome]."""
    for call in calls.values():
        call()  # compiles, and fills the caches
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(REPEATS):
        for name, call in calls.items():
            began = time.thread_time()
            call()
            times[name].append((time.thread_time() - began) / CHROMOSOMES * 1e6)
    return {name: statistics.median(found) for name, found in times.items()}


def run(segments: int, switch: Switch, generations: int) -> Run:
    """Run the algorithm on the paper's task; return what it took."""
    task = MotionTask.for_arm(akb(), PAPER_START, PAPER_GOAL, segments=segments)
    problem = GridMotion(task, DecodingSettings(switch=switch))
    algorithm = WangZalzala(1, POPULATION, problem.grid)
    genomes = algorithm.initial()
    algorithm.breed(genomes, problem.evaluate(genomes), 0)  # compiles
    evaluating = breeding = 0.0
    for generation in range(1, generations + 1):
        began = time.thread_time()
        objectives = problem.evaluate(genomes)
        evaluated = time.thread_time()
        genomes = algorithm.breed(genomes, objectives, generation)
        evaluating += evaluated - began
        breeding += time.thread_time() - evaluated
    return Run(evaluating, breeding)


def _evaluate_afresh(problem: GridMotion, genomes: NDArray[np.int16]) -> None:
    """Evaluate all, also those that the problem would remember."""
    switching.evaluate(problem.decoder, genomes, np.empty(len(genomes)))


@kernel
def _all_blocks(
    n_blocks: int, arm: Array, gravity: Array, states: Array, torques: Array, work: Array
) -> None:
    for block in range(n_blocks):
        k = block % states.shape[0]
        q, qd, qdd = states[k, 0], states[k, 1], states[k, 2]
        inverse_dynamics(arm, gravity, q, qd, qdd, torques, work)


def _judge(what: str, ratio: float, bar: float) -> None:
    verdict = "reached" if ratio <= bar else "MISSED"
    print(f"{what}: {ratio:.2f} (bar: {bar}, {verdict})")


if __name__ == "__main__":
    main()
