"""Connected populations on the network: what a generation takes, beside a raw round trip.

    python -m benchmarks.populations

Step 1 of the crank (Kim & Khosla 1992): 4 and 16 populations of 100 individuals on 1, 2 and 4 workers. What passes
between the engine's ``ask`` and the last ``tell`` of a generation, beyond what the slowest worker computes, is the
network's; after each generation follows one raw publish / publish round trip of as many bytes between two Python
processes. A worker costs the network one round trip, however many populations it holds.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from benchmarks.round_trip import echoing

from tramnet_master.engines.engine import GenerationRow
from tramnet_master.engines.multipopulation import Follow, MultiPopulationEngine
from tramnet_master.engines.population_search import Search
from tramnet_master.experiments.experiment import Common, Experiment, Load, Timing
from tramnet_master.experiments.run_options import RunOptions
from tramnet_master.experiments.runner import run
from tramnet_master.progress import QuietProgress
from tramnet_master.results import Result
from tramnet_master.run_folder import OpenRunFolder
from tramnet_protocol.messages import Outcome, Setup, Work
from tramnet_workers.mpga_settings import SETTINGS
from tramnet_workers.node.evolver import Colony
from tramnet_workers.problems.crank_design import PlanarDesign
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.designs import design_parameters
from tramnet_workers.problems.stages import design_stage

POINTS = (4, 16)
WORKERS = (1, 2, 4)
FRAME_BYTES = 600  # the values of four populations and a header


class Generations(NamedTuple):
    """Medians over the generations of a run [us].

    Attributes:
        whole: From ``ask`` to the last ``tell``.
        computed: Compute time of the slowest worker.
        overhead: The difference.
        ratio: Of the difference to the raw round trip that followed it.
        messages: Messages that workers sent, a generation.
    """

    whole: float
    computed: float
    overhead: float
    ratio: float
    messages: float


class TimedEngine(MultiPopulationEngine):
    """An engine that measures its generations, with a raw round trip after each.

    Args:
        follow: Tells what to search.
        round_trip: Makes a round trip and returns its time [us].
    """

    def __init__(self, follow: Follow, round_trip: Callable[[bytes], float]) -> None:
        super().__init__(follow)
        self.times: list[tuple[float, float, float]] = []
        self.messages = 0
        self._round_trip = round_trip
        self._slowest = self._asked_at = 0.0

    def ask(self) -> list[Work]:
        """Return the next step of every share of the populations, once."""
        works = super().ask()
        if works:
            self._asked_at, self._slowest = time.perf_counter(), 0.0
        return works

    def tell(self, work: Work, outcome: Outcome) -> list[GenerationRow]:
        """Take what some populations tell."""
        passed = time.perf_counter() - self._asked_at
        self._slowest = max(self._slowest, outcome.seconds)
        self.messages += 1
        rows = super().tell(work, outcome)
        if rows:
            self.times.append(
                (1e6 * passed, 1e6 * self._slowest, self._round_trip(bytes(FRAME_BYTES)))
            )
        return rows

    def measured(self) -> Generations:
        """Return the medians."""
        whole, computed, raw = np.array(self.times).T
        overhead = whole - computed
        return Generations(
            float(np.median(whole)),
            float(np.median(computed)),
            float(np.median(overhead)),
            float(np.median(overhead / raw)),
            self.messages / len(self.times),
        )


def search_for(points: int) -> Search:
    """Return step 1 for points on the crank."""
    task = DesignTask(stations=tuple(i / points for i in range(points)))
    stage = design_stage(task, SETTINGS["recommended"])
    design = stage.problem
    assert isinstance(design, PlanarDesign)
    colony = Colony("crank", design_parameters(design), stage.genetic.parameters(), 1, 0)
    return Search(
        "design",
        points,
        stage.genetic.population_size,
        stage.genetic.generations,
        len(design.circular),
        design.n_terms,
        colony.plain(),
    )


def measure(points: int, workers: int, round_trip: Callable[[bytes], float]) -> Generations:
    """Run step 1 on some workers and return what its generations took."""
    search = search_for(points)
    engine = TimedEngine(lambda finals: None if finals else search, round_trip)

    def conclude(_: OpenRunFolder, common: Common, __: Timing, ___: Load) -> Result:
        return Result(**common)

    parameters = search.problem["parameters"]
    assert isinstance(parameters, dict)
    experiment = Experiment(
        name="crank",
        method="mpga",
        case=None,
        seed=1,
        population_size=search.population_size,
        generations=search.generations,
        setup=Setup("crank", parameters),
        engine=engine,
        document={},
        paper=None,
        conclude=conclude,
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run"
        run(
            experiment,
            RunOptions(workers=workers, checkpoint_seconds=60.0),
            lambda document: OpenRunFolder.create(path, document),
            QuietProgress(),
        )
    return engine.measured()


def main() -> None:
    """Print the table."""
    print(
        "populations  workers  generation  computing  network  over a raw round trip  messages each"
    )
    with echoing(FRAME_BYTES) as round_trip:
        for points in POINTS:
            for workers in WORKERS:
                found = measure(points, workers, round_trip)
                print(
                    f"{points:>11}  {workers:>7}  {found.whole:>7.0f} us  {found.computed:>6.0f} us"
                    f"  {found.overhead:>4.0f} us  {found.ratio:>21.2f}  {found.messages:>13.2f}"
                )


if __name__ == "__main__":
    main()
