"""The farm: what the network costs a generation, and what a second worker gains.

    python -m benchmarks.farm

The network's overhead of a generation is all that passes between the engine's ``ask`` and its ``tell`` beyond what
the worker computes: for a hundred chromosomes of 184 bytes, with one worker. After each generation follows one raw
publish / publish round trip of as many bytes between two Python processes, so that both meet the same caches and
whatever else the machine does; the bar is the median of their ratios in blocks of a hundred. Round trips in a row,
which keep everything warm that no generation leaves warm, are printed for information. The gain of a second worker
is measured with an evaluation that sleeps 1 ms.
"""

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from benchmarks.round_trip import echoing
from numpy.typing import NDArray

from tramnet_master.engines.engine import GenerationRow
from tramnet_master.engines.farmed import GenerationalEngine
from tramnet_master.experiments.experiment import Common, Experiment, Load, Timing
from tramnet_master.experiments.run_options import RunOptions
from tramnet_master.experiments.runner import run
from tramnet_master.progress import QuietProgress
from tramnet_master.results import Result
from tramnet_master.run_folder import OpenRunFolder
from tramnet_protocol.messages import Evaluated, Outcome, Setup, Work

POPULATION = 100
DIMENSION = 23  # 184 bytes a chromosome: as many as 6 joints of 15 nodes of two bytes

BLOCK = 100
"""Generations, each with a round trip after it, in a block."""

GENERATIONS = 30 * BLOCK
FRAME_BYTES = 18_550  # what a generation sends, and what is sent back
ANSWER_BYTES = 950
REQUIRED_RATIO = 2.0
REQUIRED_GAIN = 1.9


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


class TimedEngine(GenerationalEngine):
    """An engine that measures what lies between ``ask`` and ``tell``, and raw round trips in between.

    Args:
        generations: Number of generations.
        round_trip: Makes a round trip and returns its time [us].

    Attributes:
        blocks: Median overhead of a generation, median round trip after one, and median round trip in a row,
            of each block [us].
    """

    def __init__(self, generations: int, round_trip: Callable[[bytes], float]) -> None:
        super().__init__(Repeat(), generations)
        self.blocks: list[tuple[float, float, float]] = []
        self._round_trip = round_trip
        self._overheads: list[float] = []
        self._round_trips: list[float] = []
        self._asked_at = 0.0

    def ask(self) -> list[Work]:
        """Return the current generation, once."""
        works = super().ask()
        self._asked_at = time.perf_counter()
        return works

    def tell(self, work: Work, outcome: Outcome) -> list[GenerationRow]:
        """Take the objectives of the current generation."""
        passed = time.perf_counter() - self._asked_at
        assert isinstance(outcome, Evaluated)
        self._overheads.append((passed - outcome.seconds) * 1e6)
        rows = super().tell(work, outcome)
        self._round_trips.append(self._round_trip(bytes(FRAME_BYTES)))
        if len(self._overheads) == BLOCK:
            in_a_row = [self._round_trip(bytes(FRAME_BYTES)) for _ in range(BLOCK)]
            times = (self._overheads, self._round_trips, in_a_row)
            own, after, warm = (statistics.median(values) for values in times)
            self.blocks.append((own, after, warm))
            self._overheads.clear()
            self._round_trips.clear()
        return rows


def run_sphere(engine: GenerationalEngine, workers: int, delay: float) -> Result:
    """Run the sphere function over the farm and return the result."""

    def conclude(_: OpenRunFolder, common: Common, __: Timing, ___: Load) -> Result:
        return Result(**common)

    setup = Setup("sphere", {"dimension": DIMENSION, "delay": delay})
    experiment = Experiment(
        "sphere", "repeat", None, 0, POPULATION, GENERATIONS, setup, engine, {}, None, conclude
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run"
        options = RunOptions(workers=workers, checkpoint_seconds=60.0)
        _, result = run(
            experiment,
            options,
            lambda document: OpenRunFolder.create(path, document),
            QuietProgress(),
        )
    return result


def main() -> None:
    """Print overhead and gain."""
    print("network overhead of a generation, one worker, 100 x 184 bytes")
    with echoing(ANSWER_BYTES) as round_trip:
        engine = TimedEngine(GENERATIONS, round_trip)
        run_sphere(engine, 1, 0.0)
    own, after, warm = (statistics.median(times) for times in zip(*engine.blocks, strict=True))
    ratio = statistics.median(block[0] / block[1] for block in engine.blocks)
    warm_ratio = statistics.median(block[0] / block[2] for block in engine.blocks)
    verdict = "reached" if ratio <= REQUIRED_RATIO else "MISSED"
    print(f"  {own:.0f} us")
    print(f"  raw round trip {after:.0f} us: ratio {ratio:.2f} (bar: {REQUIRED_RATIO}, {verdict})")
    print(f"  raw round trips in a row {warm:.0f} us: ratio {warm_ratio:.2f}")

    print("gain of a second worker, 1 ms an individual")
    one, two = (
        run_sphere(GenerationalEngine(Repeat(), 20), workers, 0.001).wall_seconds
        for workers in (1, 2)
    )
    verdict = "reached" if one / two >= REQUIRED_GAIN else "MISSED"
    print(
        f"  1 worker {one:.2f} s, 2 workers {two:.2f} s: "
        f"gain {one / two:.2f} (bar: {REQUIRED_GAIN}, {verdict})"
    )


if __name__ == "__main__":
    main()
