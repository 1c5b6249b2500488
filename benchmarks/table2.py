"""Table 2 of Wang & Zalzala (1995) beside ours, over many seeds, in one process and without a network.

    python -m benchmarks.table2 --seeds 20
    python -m benchmarks.table2 --cases 7 --seeds 5

Engine, problem and seeds are those of ``tramnet run puma560``, so every row is what those runs print.
"""

import argparse
import time

import numpy as np
from rich.console import Console

from tramnet_master.commands.case_table import VARIANTS
from tramnet_master.experiments.puma560 import Choice, options_of, prepare
from tramnet_master.reports.paper_table import CaseOutcome, paper_table
from tramnet_workers.node.evaluator import Evaluator
from tramnet_workers.problems.grid_motion import GridMotion


def best_motion(
    case: int, robot: str, seed: int, generations: int | None, settings: dict[str, object]
) -> tuple[float, float, int]:
    """Run a case; return motion time [s], sum of the end velocities [rad/s] and generation of the best plan."""
    choice = Choice(case, None, robot, "wang-zalzala", seed, None, generations, settings)
    experiment = prepare(options_of(choice))
    evaluator, engine = Evaluator(experiment.setup), experiment.engine
    while not engine.finished:
        for work in engine.ask():
            engine.tell(work, evaluator.compute(work))
    plan = GridMotion.from_parameters(experiment.setup.parameters).plan(engine.best.genome)
    assert plan is not None, "the best chromosome has a motion"
    return plan.duration, float(np.abs(plan.qd[-1]).sum()), engine.best.generation


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--cases", type=int, nargs="+", default=[1, 2, 3, 4, 5, 6])
    parser.add_argument("--robot", default="akb")
    parser.add_argument("--generations", type=int, default=None)
    parser.add_argument("--set", action="append", default=[], help="NAME=VALUE of a number")
    arguments = parser.parse_args()
    extra = {name: float(value) for name, _, value in (s.partition("=") for s in arguments.set)}
    outcomes = []
    for case in arguments.cases:
        for variant, settings in VARIANTS.get(case, {"": {}}).items():
            began = time.perf_counter()
            found = [
                best_motion(
                    case, arguments.robot, seed, arguments.generations, {**settings, **extra}
                )
                for seed in range(1, arguments.seeds + 1)
            ]
            seconds = (time.perf_counter() - began) / arguments.seeds
            print(f"case {case} {variant}: {seconds:.2f} s a run", flush=True)
            times, speeds, generations = zip(*found, strict=True)
            outcomes.append(CaseOutcome(case, variant, times, speeds, generations))
    Console(width=100).print(paper_table(outcomes))


if __name__ == "__main__":
    main()
