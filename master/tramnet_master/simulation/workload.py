"""What a run asks of a farm, in numbers: how many individuals, how long they are and what they cost."""

import math
import time
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from tramnet_master.engines.engine import Engine
from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.experiment import Experiment
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evaluate, Evaluated, WorkId

if TYPE_CHECKING:
    from tramnet_workers.node.evaluator import Evaluator

_LONG_ENOUGH = 0.05  # a measurement of evaluations [s]
_GENERATIONS = 12  # that are bred to measure breeding
_PATIENCE = 2.0  # after which breeding is measured well enough [s]


class Workload(Struct, frozen=True):
    """Generations of one population, evaluated by the workers and bred by the root.

    Attributes:
        name: What runs.
        population: Individuals in a generation.
        generations: Number of generations.
        genome_bytes: Length of a chromosome [B].
        evaluation: Time to evaluate an individual [s].
        breeding: Time from the last objective of a generation to the next chromosomes [s].
        genes: Genes of a chromosome.
        objective_bytes: Length of an individual's answer [B].
    """

    name: str
    population: int
    generations: int
    genome_bytes: int
    evaluation: float
    breeding: float = 0.0
    genes: int = 1
    objective_bytes: int = 8

    @property
    def serial_seconds(self) -> float:
        """Time of all of it on one processor that does it alone, without a network [s]."""
        return self.generations * (self.population * self.evaluation + self.breeding)


def measure(experiment: Experiment) -> Workload:
    """Return what an experiment asks of a farm, with its costs on this core.

    Some generations are bred to measure it, with objectives that mean nothing: the engine is of no use afterwards.

    Raises:
        InvalidOption: It asks for something else than the evaluation of one population.
    """
    from tramnet_workers.node.evaluator import Evaluator  # noqa: PLC0415  slow to import

    (work,) = _ask(experiment.engine)
    evaluation = _evaluation(Evaluator(experiment.setup), work)
    return Workload(
        name=experiment.title,
        population=work.work.size,
        generations=experiment.generations,
        genome_bytes=len(work.genomes.data) // work.work.size,
        evaluation=evaluation,
        breeding=_breeding(experiment.engine, work),
        genes=math.prod(work.genomes.shape[1:]),
    )


def _ask(engine: Engine) -> list[Evaluate]:
    works = engine.ask()
    found = [work for work in works if isinstance(work, Evaluate)]
    if len(works) != 1 or len(found) != 1:
        raise InvalidOption(
            "JOB", f"{len(works)} works at a time", "a job that evaluates one population at a time"
        )
    return found


def _evaluation(evaluator: "Evaluator", work: Evaluate) -> float:
    """Time of an individual: as many as take long enough to be measured, all of them at most."""
    genomes = work.genomes.unpack()
    size = 1
    while True:
        part = WorkId(work.work.kind, work.work.population, work.work.step, 0, size)
        outcome = evaluator.compute(Evaluate(part, Array.pack(genomes[:size])))
        assert isinstance(outcome, Evaluated)
        if outcome.seconds >= _LONG_ENOUGH or size == len(genomes):
            return outcome.seconds / size
        size = min(4 * size, len(genomes))


def _breeding(engine: Engine, work: Evaluate) -> float:
    """Median time of ``tell`` and ``ask``."""
    times: list[float] = []
    end = time.perf_counter() + _PATIENCE
    while not engine.finished and len(times) < _GENERATIONS and time.perf_counter() < end:
        objectives = Array.pack(np.linspace(1.0, 2.0, work.work.size))
        began = time.perf_counter()
        engine.tell(work, Evaluated(work.work, objectives, 0.0))
        if engine.finished:
            break
        (work,) = _ask(engine)
        times.append(time.perf_counter() - began)
    return float(np.median(times)) if times else 0.0
