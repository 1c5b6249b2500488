"""What an experiment asks of a farm, measured on this core: its engine and evaluator run here, without a farm."""

import math
import statistics
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tramnet_master.engines.engine import Engine, HoldsPopulations
from tramnet_master.engines.tracking import CHUNK_SECONDS
from tramnet_master.experiments.experiment import Experiment
from tramnet_master.simulation.workload import Grain, Workload
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evaluate, Evaluated, Evolve, Track, Work, WorkId
from tramnet_protocol.modelled import HEADER_BYTES, modelled_bytes

if TYPE_CHECKING:
    from tramnet_workers.node.evaluator import Evaluator

_LONG_ENOUGH = 0.05  # a measurement of evaluations [s]
_ROUNDS = 12  # that are measured; every tenth generation of populations brings a snapshot
_PATIENCE = 2.0  # after which no further round is measured [s]


class _Round(NamedTuple):
    """One work of a round, as it went here.

    Attributes:
        work: The work.
        seconds: Its compute time [s].
        back_bytes: Modelled length of its answer [B].
        breeding: Time of the engine from the answer to the next work [s].
        works: Works of the round.
    """

    work: Work
    seconds: float
    back_bytes: int
    breeding: float
    works: int


def measure(experiment: Experiment) -> Workload:
    """Return what an experiment asks of a farm, with its costs on this core.

    Some rounds are computed to measure it; the engine is of no use afterwards.
    """
    engine = experiment.engine
    if isinstance(engine, HoldsPopulations):
        engine.spread(1)
    from tramnet_workers.node.evaluator import Evaluator  # noqa: PLC0415  slow to import

    evaluator = Evaluator(experiment.setup)
    works = engine.ask()
    match works[0]:
        case Evaluate() as work:
            return _individuals(experiment, evaluator, work)
        case Evolve():
            return _populations(experiment, list(_rounds(engine, evaluator, works)))
        case Track():
            return _paths(experiment, list(_rounds(engine, evaluator, works)))


def _individuals(experiment: Experiment, evaluator: "Evaluator", work: Evaluate) -> Workload:
    return Workload(
        name=experiment.title,
        population=work.work.size,
        generations=experiment.generations,
        genome_bytes=len(work.genomes.data) // work.work.size,
        evaluation=_evaluation(evaluator, work),
        breeding=_breeding(experiment.engine, work),
        genes=math.prod(work.genomes.shape[1:]),
    )


def _populations(experiment: Experiment, rounds: list[_Round]) -> Workload:
    """Every round is one work here, of all populations; the first one only begins them."""
    later = rounds[1:] or rounds
    n = later[0].work.work.size
    return Workload(
        name=experiment.title,
        population=n,
        generations=experiment.generations,
        genome_bytes=0,
        evaluation=min(one.seconds for one in later) / n,
        breeding=statistics.median(one.breeding for one in later),
        objective_bytes=round(
            (statistics.mean(one.back_bytes for one in later) - HEADER_BYTES) / n
        ),
        grain=Grain.POPULATIONS,
        work_bytes=modelled_bytes(later[0].work) - HEADER_BYTES,
    )


def _paths(experiment: Experiment, rounds: list[_Round]) -> Workload:
    largest = max(rounds, key=lambda one: one.work.work.size)
    size = largest.work.work.size
    same = [one for one in rounds if one.work.work.size == size]
    each = min(one.seconds for one in same) / size
    return Workload(
        name=experiment.title,
        population=rounds[0].works,
        generations=experiment.generations,
        genome_bytes=0,
        evaluation=each,
        breeding=statistics.median(one.breeding for one in rounds),
        objective_bytes=(largest.back_bytes - HEADER_BYTES) // size,
        grain=Grain.PATHS,
        work_bytes=modelled_bytes(largest.work) - HEADER_BYTES,
        run=1 if size == 1 else points_of_a_run(each, experiment.generations),
    )


def points_of_a_run(each: float, points: int) -> int:
    """Return how many points the engine makes one work where a point takes ``each`` seconds."""
    return max(1, min(int(CHUNK_SECONDS / each), points))


def _rounds(engine: Engine, evaluator: "Evaluator", works: list[Work]) -> Iterator[_Round]:
    """Compute rounds in this process, one work after another, until they are enough."""
    end = time.perf_counter() + _PATIENCE
    for _ in range(_ROUNDS):
        found = []
        for work in works:
            if (
                isinstance(work, Evolve)
                and isinstance(engine, HoldsPopulations)
                and not work.work.step
            ):
                work = engine.restate(work)  # noqa: PLW2901  nobody holds its populations yet
            outcome = evaluator.compute(work)
            size = modelled_bytes(outcome)
            snapshot = evaluator.snapshot(work)
            if snapshot is not None and isinstance(engine, HoldsPopulations):
                engine.keep(snapshot)
                size += modelled_bytes(snapshot)
            began = time.perf_counter()
            engine.tell(work, outcome)
            breeding = time.perf_counter() - began
            found.append(_Round(work, outcome.seconds, size, breeding, len(works)))
        yield from found
        if engine.finished or time.perf_counter() > end:
            return
        works = engine.ask()


def _evaluation(evaluator: "Evaluator", work: Evaluate) -> float:
    """Least time of an individual, in ever larger parts until they have taken long enough."""
    genomes = work.genomes.unpack()
    size, spent, best = 1, 0.0, float("inf")
    while spent < _LONG_ENOUGH:
        part = WorkId(work.work.kind, work.work.population, work.work.step, 0, size)
        outcome = evaluator.compute(Evaluate(part, Array.pack(genomes[:size])))
        spent += outcome.seconds
        best = min(best, outcome.seconds / size)
        size = min(4 * size, len(genomes))
    return best


def _breeding(engine: Engine, work: Work) -> float:
    """Median time of ``tell`` and ``ask``, with objectives that mean nothing."""
    times: list[float] = []
    end = time.perf_counter() + _PATIENCE
    while not engine.finished and len(times) < _ROUNDS and time.perf_counter() < end:
        objectives = Array.pack(np.linspace(1.0, 2.0, work.work.size))
        began = time.perf_counter()
        engine.tell(work, Evaluated(work.work, objectives, 0.0))
        if engine.finished:
            break
        (work,) = engine.ask()
        times.append(time.perf_counter() - began)
    return statistics.median(times) if times else 0.0
