"""Any installed problem over a box of real numbers, minimised by the real-coded genetic algorithm."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from tramnet_master.engines.farmed import GenerationalEngine
from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.experiment import Common, Experiment, Load, Timing
from tramnet_master.results import Result
from tramnet_master.run_folder import OpenRunFolder
from tramnet_protocol.messages import Setup
from tramnet_workers.evolution.box import SETTINGS, BoxEvolution
from tramnet_workers.problems.problem import Problem
from tramnet_workers.problems.registry import build

NAME = "problem"
METHOD = "real-coded"
POPULATION = 100
GENERATIONS = 200


@runtime_checkable
class BoxProblem(Problem, Protocol):
    """A problem whose chromosomes are vectors in a box.

    Attributes:
        lower: Smallest genes, of the shape of a chromosome.
        upper: Largest genes, of the shape of a chromosome.
    """

    @property
    def lower(self) -> NDArray[np.float64]:
        """Smallest genes, of the shape of a chromosome."""

    @property
    def upper(self) -> NDArray[np.float64]:
        """Largest genes, of the shape of a chromosome."""


class OwnProblemResult(Result, frozen=True, kw_only=True):
    """What a run of an installed problem writes beside.

    Attributes:
        problem: Its name.
        parameters: Its parameters.
        genome: The best chromosome, flat.
        evaluations_per_second: Rate over the whole run [1/s].
        network_overhead_fraction: Share of the run in which no worker computed.
    """

    problem: str
    parameters: dict[str, object]
    genome: list[float]
    evaluations_per_second: float
    network_overhead_fraction: float


class OwnProblemOptions(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is run.

    Attributes:
        problem: Name of the problem.
        parameters: Its parameters.
        seed: Seed of all random streams.
        population: Individuals in a generation.
        generations: Number of generations.
    """

    problem: str
    parameters: dict[str, object] = {}
    seed: int = 1
    population: int = POPULATION
    generations: int = GENERATIONS


def prepare(options: OwnProblemOptions) -> Experiment:
    """Prepare a run of an installed problem.

    Raises:
        UnknownProblem: None of that name is installed.
        InvalidParameters: Its parameters are wrong.
        InvalidOption: Its chromosomes are no vectors in a box.
    """
    problem = build(options.problem, options.parameters)
    if not isinstance(problem, BoxProblem) or problem.genome_dtype != np.float64:
        raise InvalidOption(
            "PROBLEM",
            options.problem,
            "a problem of float64 vectors with the attributes lower and upper",
            "see docs/writing-a-problem.md",
        )
    algorithm = BoxEvolution(
        options.seed,
        options.population,
        options.generations,
        problem.lower,
        problem.upper,
        SETTINGS,
    )
    engine = GenerationalEngine(algorithm, options.generations)

    def conclude(_: OpenRunFolder, common: Common, timing: Timing, __: Load) -> OwnProblemResult:
        return OwnProblemResult(
            **common,
            **timing,
            problem=options.problem,
            parameters=options.parameters,
            genome=np.asarray(engine.best.genome, dtype=np.float64).ravel().tolist(),
        )

    return Experiment(
        name=NAME,
        method=METHOD,
        case=None,
        seed=options.seed,
        population_size=options.population,
        generations=options.generations,
        setup=Setup(options.problem, dict(options.parameters)),
        engine=engine,
        document={"problem": options.problem, "parameters": options.parameters},
        paper=None,
        conclude=conclude,
    )


def restore(document: Mapping[str, object]) -> Experiment:
    """Prepare the run that a ``run.toml`` describes again."""
    own = document[NAME]
    assert isinstance(own, dict)
    return prepare(
        OwnProblemOptions(
            problem=own["problem"],
            parameters=own["parameters"],
            seed=int(str(document["seed"])),
            population=int(str(document["population"])),
            generations=int(str(document["generations"])),
        )
    )
