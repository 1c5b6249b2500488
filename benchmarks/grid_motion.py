"""The 1995 algorithm: what a chromosome costs against inverse dynamics, and what breeding costs against evaluating.

    python -m benchmarks.grid_motion

A chromosome of 16 segments needs at least 3 inverse dynamics a segment (K, H v and g of eq 5). Everything is
processor time of one thread, in interleaved repeats; medians are printed.
"""

import functools
import statistics
import time
from collections.abc import Callable

import numpy as np

from tramnet_workers.evolution.wang_zalzala import WangZalzala
from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.problems.grid_motion import DecodingSettings, GridMotion
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.puma560 import akb

POPULATION = 100
REPEATS = 60
DYNAMICS_EACH = 48


def cost(call: Callable[[], object]) -> float:
    """Return the processor time of a call [s]."""
    began = time.thread_time()
    call()
    return time.thread_time() - began


def main() -> None:
    """Print costs and ratios."""
    task = MotionTask.for_arm(akb(), PAPER_START, PAPER_GOAL)
    rng = np.random.default_rng(1)
    states = [rng.normal(size=(DYNAMICS_EACH * POPULATION, 6)) for _ in range(3)]
    problems = {
        f"{switch}, {posture}": GridMotion(task, DecodingSettings(switch=switch, posture=posture))
        for switch in ("literal", "continuous")
        for posture in ("start", "exact")
    }
    grid_motion = problems["literal, start"]
    algorithm = WangZalzala(1, POPULATION, grid_motion.grid)
    genomes = algorithm.initial()
    objectives = grid_motion.evaluate(genomes)
    calls: dict[str, Callable[[], object]] = {
        "dynamics": lambda: inverse_dynamics_batch(task.arm.table, task.arm.gravity, *states),
        "breeding": lambda: algorithm.breed(genomes, objectives, 1),
    }
    for name, problem in problems.items():
        calls[name] = functools.partial(problem.evaluate, genomes)
    for call in calls.values():
        call()
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(REPEATS):
        for name, call in calls.items():
            times[name].append(cost(call) / POPULATION * 1e6)
    each = {name: statistics.median(found) for name, found in times.items()}
    print(f"{DYNAMICS_EACH} inverse dynamics  {each['dynamics']:7.2f} us")
    for name in problems:
        ratio = each[name] / each["dynamics"]
        print(f"chromosome ({name})  {each[name]:7.2f} us, ratio {ratio:.2f}")
    fitness = each["literal, start"]
    print(
        f"breeding an individual  {each['breeding']:7.2f} us, {each['breeding'] / fitness:.2f} of its evaluation"
    )


if __name__ == "__main__":
    main()
