"""The farm: what the network costs a generation, and what a second worker gains.

    python -m benchmarks.farm

Overhead is the time the root waits for a generation beyond what the worker computes, for a hundred chromosomes of 90
numbers of two bytes' worth; beside it stands the raw publish / publish round trip between two Python processes,
measured in the same run. The gain is measured with an evaluation that sleeps 1 ms.
"""

import statistics
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.round_trip import measure
from tramnet_master.engines.farmed import GenerationalEngine
from tramnet_master.experiments.experiment import Common, Experiment, Timing
from tramnet_master.experiments.runner import RunOptions, run
from tramnet_master.progress import QuietProgress
from tramnet_master.results import Result
from tramnet_master.run_folder import OpenRunFolder
from tramnet_protocol.messages import Setup

POPULATION = 100
DIMENSION = 23  # 184 bytes a chromosome: as many as 6 joints of 15 nodes


class Repeat:
    """An algorithm that costs nothing: the next population is the same."""

    population_size = POPULATION

    def initial(self) -> NDArray[np.float64]:
        """Return the one population there is."""
        return np.linspace(-1.0, 1.0, POPULATION * DIMENSION).reshape(POPULATION, DIMENSION)

    def breed(
        self, genomes: NDArray[np.generic], objectives: NDArray[np.float64], generation: int
    ) -> NDArray[np.generic]:
        """Return the same population."""
        return genomes


def timed_run(workers: int, delay: float, generations: int) -> tuple[Result, Timing]:
    """Run the sphere function over the farm and return the result with its timing."""
    timings: list[Timing] = []

    def conclude(_: OpenRunFolder, common: Common, timing: Timing) -> Result:
        timings.append(timing)
        return Result(**common)

    engine = GenerationalEngine(Repeat(), generations)
    setup = Setup("sphere", {"dimension": DIMENSION, "delay": delay})
    experiment = Experiment(
        "sphere", "repeat", None, 0, POPULATION, generations, setup, engine, {}, None, conclude
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run"
        options = RunOptions(workers=workers, checkpoint_seconds=60.0)
        _, result = run(
            experiment, options, lambda document: OpenRunFolder.create(path, document), QuietProgress()
        )
    return result, timings[0]


def overhead_us(generations: int = 2000) -> float:
    """Return what the network costs a generation with one worker [us]."""
    result, timing = timed_run(1, 0.0, generations)
    return timing["network_overhead_fraction"] * result.wall_seconds / generations * 1e6


def main() -> None:
    """Print overhead and gain."""
    print("network overhead of a generation, one worker, 100 x 184 bytes")
    ratios = []
    for _ in range(3):
        raw = measure(size=1024).median_us
        own = overhead_us()
        ratios.append(own / raw)
        print(f"  {own:6.0f} us, raw round trip {raw:6.0f} us, ratio {own / raw:.2f}")
    print(f"  median ratio {statistics.median(ratios):.2f}")

    print("gain of a second worker, 1 ms an individual")
    one, _ = timed_run(1, 0.001, 20)
    two, _ = timed_run(2, 0.001, 20)
    print(
        f"  1 worker {one.wall_seconds:.2f} s, 2 workers {two.wall_seconds:.2f} s, "
        f"gain {one.wall_seconds / two.wall_seconds:.2f}"
    )


if __name__ == "__main__":
    main()
