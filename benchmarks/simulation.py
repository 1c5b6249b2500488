"""The simulator against real runs on this machine, and how long the simulator itself takes.

    python -m benchmarks.simulation

Three runs whose fitness costs next to nothing tell what messages cost here: one worker, two in a star, two in a
pipeline. From these the simulator predicts runs whose fitness takes time (it sleeps, so that two cores are enough),
and each of them is then made. The bars: predictions within 10 % where computing dominates, and within 25 % where
the network takes over 30 % of the time. Last, a generation on 4,096 TRAMs is to be simulated within 60 s.
"""

import statistics
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tramnet_master.commands.launch import make_run
from tramnet_master.csv_tables import read_table
from tramnet_master.experiments.experiment import Experiment
from tramnet_master.experiments.own_problem import OwnProblemOptions, prepare
from tramnet_master.experiments.run_options import RunOptions
from tramnet_master.run_folder import HISTORY
from tramnet_master.simulation.agenda import SECOND
from tramnet_master.simulation.farm import VirtualFarm
from tramnet_master.simulation.machines import T805, TODAY, Machine, machine
from tramnet_master.simulation.measuring import measure
from tramnet_master.simulation.prediction import lay, predict
from tramnet_master.simulation.workload import Workload
from tramnet_protocol.links import LinkTiming
from tramnet_protocol.topology import SHAPES

REPEATS = 3
MOST_TRAMS = 4096
REQUIRED_SECONDS = 60.0


class Case(NamedTuple):
    """A run to predict and to make.

    Attributes:
        topology: Shape of the network.
        workers: Number of workers.
        population: Individuals in a generation.
        fitness: Time that each sleeps [s].
        generations: Number of generations.
    """

    topology: str
    workers: int
    population: int
    fitness: float
    generations: int

    def experiment(self) -> Experiment:
        """The run, ready to be made."""
        parameters: dict[str, object] = {"dimension": 23, "delay": self.fitness}
        return prepare(
            OwnProblemOptions(
                problem="sphere",
                parameters=parameters,
                population=self.population,
                generations=self.generations,
            )
        )


FREE = {
    "alone": Case("star", 1, 20, 0.0, 400),
    "two": Case("star", 2, 20, 0.0, 400),
    "behind": Case("pipeline", 2, 20, 0.0, 400),
}
"""Runs that tell what messages cost."""

CASES = {
    Case("star", 1, 100, 1e-3, 20): 0.10,
    Case("star", 2, 100, 1e-3, 30): 0.10,
    Case("pipeline", 1, 20, 2e-5, 400): 0.25,
    Case("pipeline", 2, 20, 2e-5, 400): 0.25,
}
"""Runs to predict, and how far off a prediction may be."""


def per_generation(case: Case) -> float:
    """Make a run; the median time of a generation [s]."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run"
        options = RunOptions(
            workers=case.workers, topology=case.topology, checkpoint_seconds=60.0, node="none"
        )
        make_run(case.experiment(), options, path, overwrite=False)
        return float(np.median(np.diff(read_table(path / HISTORY)["elapsed_s"])))


def make_all() -> dict[Case, float]:
    """Make every run some times, in turn, so that the machine's other work falls on all; median times [s]."""
    every = [*FREE.values(), *CASES]
    times = [[per_generation(case) for case in every] for _ in range(REPEATS)]
    return dict(zip(every, map(statistics.median, zip(*times, strict=True)), strict=True))


def calibrate(found: dict[Case, float]) -> Machine:
    """What messages cost on this machine, from the runs that hardly compute."""
    alone, two, behind = (found[case] for case in FREE.values())
    workload = measure(FREE["alone"].experiment())
    own = workload.breeding + workload.population * workload.evaluation
    # The root takes answers in one by one, and two come at once:
    # alone = own + 2 hops + root; two = alone + root; behind = two + 2 (hop + routing).
    root = min(max(0.0, two - alone), alone - own)  # it cannot be more, whoever shares a core
    hop = (alone - own - root) / 2.0
    routing = max(0.0, (behind - two) / 2.0 - hop)
    print(
        f"a generation without fitness: {1e6 * alone:.0f} us with one worker, {1e6 * two:.0f} us with "
        f"two, {1e6 * behind:.0f} us with two in a pipeline; {1e6 * own:.0f} us of each are its own\n"
        f"a message: {1e6 * hop:.0f} us a hop, {1e6 * routing:.0f} us to be passed on; "
        f"an answer takes the root {1e6 * root:.0f} us"
    )
    timing = LinkTiming(1, 1, 0, round(hop * SECOND), round(routing * SECOND))
    return Machine(TODAY, timing, receiving=round(root * SECOND))


def compare(today: Machine, found: dict[Case, float]) -> None:
    """Predict the other runs, and print both."""
    for case, tolerance in CASES.items():
        workload = measure(case.experiment())
        (point,) = predict(workload, today, SHAPES[case.topology], [case.workers]).points
        predicted, measured = point.seconds / case.generations, found[case]
        off = predicted / measured - 1.0
        computing = workload.population * workload.evaluation / case.workers
        verdict = "reached" if abs(off) <= tolerance else "MISSED"
        print(
            f"{case.population} individuals of {1e6 * case.fitness:.0f} us, {case.workers} in a "
            f"{case.topology}: predicted {1e3 * predicted:.3f} ms a generation, measured "
            f"{1e3 * measured:.3f} ms, {off:+.1%} (bar: ±{tolerance:.0%}, {verdict}); "
            f"network {1 - computing / measured:.0%} of it"
        )


def simulate_many() -> None:
    """Simulate a generation on as many TRAMs as there are seats, and one more."""
    workload = Workload("many", 2 * (MOST_TRAMS - 1), 1, 180, 0.030)
    for topology in ("tree", "torus"):
        began = time.perf_counter()
        ways = lay(SHAPES[topology], MOST_TRAMS - 1)
        (lap,) = VirtualFarm(workload, machine(T805, 20), ways).run(1)
        took = time.perf_counter() - began
        verdict = "reached" if took <= REQUIRED_SECONDS else "MISSED"
        hops = sum(traffic.frames for traffic in lap.traffic.values())
        print(
            f"{MOST_TRAMS} TRAMs in a {topology}, {workload.population} individuals: {took:.1f} s for "
            f"{lap.time / SECOND:.3f} s of virtual time, {hops:,} hops (bar: {REQUIRED_SECONDS:.0f} s, "
            f"{verdict})",
            flush=True,
        )


def main() -> None:
    found = make_all()
    compare(calibrate(found), found)
    simulate_many()


if __name__ == "__main__":
    main()
