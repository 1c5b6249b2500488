"""The methods of ``crank`` made ready for a run: what workers are told, the engine, and what is made of the end."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tramnet_master.design_results import DesignResult, design_result, write_design
from tramnet_master.engines.covariance import CovarianceEngine
from tramnet_master.engines.engine import Engine
from tramnet_master.engines.multipopulation import Found, MultiPopulationEngine
from tramnet_master.engines.population_search import Search
from tramnet_master.experiments.experiment import Common, Timing
from tramnet_master.populations import SearchHistory
from tramnet_master.spatial_results import spatial_result, write_spatial
from tramnet_workers.mpga_settings import GeneticSettings, MpgaSettings
from tramnet_workers.node.evolver import Colony
from tramnet_workers.problems.bilevel import LinkDesign, strategy_for, worth
from tramnet_workers.problems.design_report import DesignedArm, exact_poses, single_poses
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.designs import Design, design_parameters
from tramnet_workers.problems.progressive import Progress, advance, begin
from tramnet_workers.problems.single_design import single_design, single_genetic
from tramnet_workers.problems.spatial_report import SpatialArm
from tramnet_workers.problems.spatial_task import SpatialTask, find_spatial, spatial_stage
from tramnet_workers.problems.steps import Step

Floats = NDArray[np.float64]

PROBLEM = "crank"
"""Name of connected populations in the registry of problems."""

Write = Callable[[Path, Common, Timing, str | None], DesignResult]


@dataclass(frozen=True)
class Conclusion:
    """A method made ready for a task.

    Attributes:
        problem: Name of the problem for workers.
        parameters: Its parameters.
        engine: The method at work.
        population_size: Individuals in a population.
        generations: Generations that are foreseen.
        parallelism: How many workers can compute at once at most, or None.
        write: Writes the files of the design into a folder and returns the result.
    """

    problem: str
    parameters: dict[str, object]
    engine: Engine
    population_size: int
    generations: int
    parallelism: int | None
    write: Write


class ProgressiveSearches:
    """The searches of Progressive Design, one after the other; see ``problems.progressive``.

    Args:
        task: The task.
        settings: Of the method.
        seed: Seed of the run.
    """

    def __init__(self, task: DesignTask, settings: MpgaSettings, seed: int) -> None:
        self._states = [begin(task, settings)]
        self._seed = seed

    @property
    def end(self) -> Progress:
        """The latest state."""
        return self._states[-1]

    def __call__(self, finals: Sequence[Floats]) -> Search | None:
        """Return the search that follows from the final traits of those before it."""
        while len(self._states) <= len(finals):
            self._states.append(advance(self.end, finals[len(self._states) - 1]))
        state = self._states[len(finals)]
        if state.stage is None:
            return None
        stage = state.stage
        return _search(stage.step, stage.problem, stage.genetic, self._seed, state.stream)

    def history(self, found: Sequence[Found]) -> list[SearchHistory]:
        """Return how the populations of all searches evolved."""
        return [
            _history(search, state.stage.step, state.returns, state.task.n_links)
            for search, state in zip(found, self._states, strict=False)
            if state.stage is not None
        ]


def mpga(task: DesignTask, settings: MpgaSettings, seed: int) -> Conclusion:
    """Return the multi-population genetic algorithm with Progressive Design (Kim & Khosla 1992, section 6)."""
    searches = ProgressiveSearches(task, settings, seed)
    engine = MultiPopulationEngine(searches)
    stage = searches.end.stage
    assert stage is not None, "Progressive Design begins with a search"

    def write(folder: Path, common: Common, timing: Timing, variant: str | None) -> DesignResult:
        end = searches.end
        assert end.outcome is not None, "a run that is over has an outcome"
        arm = DesignedArm.after(end.task, end.outcome)
        write_design(folder, arm, searches.history(engine.found))
        return design_result(common, timing, arm, settings.name, variant)

    later = settings.prototype.generations + settings.planning.generations
    return Conclusion(
        PROBLEM,
        design_parameters(_known(stage.problem)),
        engine,
        settings.genetic.population_size,
        settings.genetic.generations + later,
        len(task.stations),
        write,
    )


def single(task: DesignTask, settings: MpgaSettings, seed: int) -> Conclusion:
    """Return one population with all variables, at as many evaluations as step 1 of ``mpga`` takes."""
    problem = single_design(task, settings)
    genetic = single_genetic(task, settings, _budget(task, settings))
    search = _search(Step.DESIGN, problem, genetic, seed, 0)
    engine = MultiPopulationEngine(lambda finals: None if finals else search)

    def write(folder: Path, common: Common, timing: Timing, variant: str | None) -> DesignResult:
        arm = DesignedArm.at_points(task, settings, single_poses(task, engine.finals[0][0]))
        write_design(folder, arm, [_history(engine.found[0], Step.DESIGN, 0, task.n_links)])
        return design_result(common, timing, arm, settings.name, variant)

    parameters = design_parameters(problem)
    size = genetic.population_size
    return Conclusion(PROBLEM, parameters, engine, size, genetic.generations, 1, write)


def bilevel(task: DesignTask, settings: MpgaSettings, seed: int) -> Conclusion:
    """Return CMA-ES over the links with exact inner poses, at as many evaluations as step 1 of ``mpga`` takes."""
    problem = LinkDesign.of(task)
    worth(task, *problem.arm(problem.start))  # complains of an arm without exact poses
    budget = max(1, _budget(task, settings) // problem.evaluations_each)
    engine = CovarianceEngine(lambda: strategy_for(problem, seed), budget)

    def write(folder: Path, common: Common, timing: Timing, variant: str | None) -> DesignResult:
        lengths, base = problem.arm(np.asarray(engine.best.genome, dtype=np.float64))
        arm = DesignedArm.at_points(task, settings, exact_poses(task, lengths, base))
        write_design(folder, arm, [])
        return design_result(common, timing, arm, settings.name, variant)

    parameters, size = problem.parameters(), engine.population_size
    return Conclusion(problem.name, parameters, engine, size, engine.generations, size, write)


def spatial(task: SpatialTask, settings: MpgaSettings, seed: int) -> Conclusion:
    """Return the multi-population genetic algorithm for a spatial arm, RC in place of inverse kinematics."""
    stage = spatial_stage(task, settings)
    search = _search(stage.step, stage.problem, stage.genetic, seed, 0)
    engine = MultiPopulationEngine(lambda finals: None if finals else search)

    def write(folder: Path, common: Common, timing: Timing, variant: str | None) -> DesignResult:
        arm = SpatialArm(task, find_spatial(task, settings, engine.finals[0]))
        write_spatial(folder, arm, [_history(engine.found[0], stage.step, 0, len(task.designed))])
        return spatial_result(common, timing, arm, settings.name, variant or "spatial")

    return Conclusion(
        PROBLEM,
        design_parameters(_known(stage.problem)),
        engine,
        stage.genetic.population_size,
        stage.genetic.generations,
        len(task.points),
        write,
    )


def _budget(task: DesignTask, settings: MpgaSettings) -> int:
    """Return how often step 1 of ``mpga`` evaluates one arm at one task point."""
    genetic = settings.genetic
    return len(task.stations) * genetic.population_size * genetic.generations


def _search(
    step: Step, problem: object, genetic: GeneticSettings, seed: int, stream: int
) -> Search:
    design = _known(problem)
    colony = Colony(PROBLEM, design_parameters(design), genetic.parameters(), seed, stream)
    return Search(
        name=step.value,
        populations=design.n_populations,
        population_size=genetic.population_size,
        generations=genetic.generations,
        n_traits=len(design.circular),
        n_terms=design.n_terms,
        problem=colony.plain(),
    )


def _known(problem: object) -> Design:
    assert isinstance(problem, Design), f"{type(problem).__name__} does not travel"
    return problem


def _history(found: Found, step: Step, returns: int, n_links: int) -> SearchHistory:
    lengths = found.traits[:, :, :n_links]
    return SearchHistory(step, returns, found.best, found.mean, lengths)
