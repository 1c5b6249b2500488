"""Lin, Chen & Yu (2017): an arm with eight joints follows a line past an obstacle; or any arm any path past boxes.

``eamp`` is the paper's evolution and ``perturbation`` its baseline; ``memetic`` and ``resolved-rate`` are what one
would use today. Several scenes are followed at once.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from msgspec import Struct

from tramnet_master.engines.tracking import TrackingEngine
from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.experiment import Common, Experiment, Load, Timing
from tramnet_master.experiments.sharing import Shared, advice
from tramnet_master.run_folder import OpenRunFolder
from tramnet_master.tracked_paths import write_tracking
from tramnet_master.tracking_files import Scene, read_scenes, read_tracking_task
from tramnet_master.tracking_results import NetworkCost, TrackingResult, tracking_result
from tramnet_protocol.messages import Setup
from tramnet_workers.errors import InvalidParameters
from tramnet_workers.problems.line_tracking import LineTracking
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.tracking_evolution import Eamp, Evolution
from tramnet_workers.tracking_methods import TrackingMethod, build_method, method_names

NAME = "redundant8"

SETTINGS = ("literal", "recommended")


class Redundant8Options(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is run.

    Attributes:
        tasks: The scenes, as plain values.
        names: Their names; one empty name for a scene alone.
        method: The method with all its settings, as plain values.
        subpopulations: Sub-populations that work on each point at once.
        case: 1 for the paper's task, None for a user's own.
        seed: Seed of all random streams.
    """

    tasks: list[dict[str, object]]
    names: list[str]
    method: dict[str, object]
    subpopulations: int = 1
    case: int | None = None
    seed: int = 1


class Choice(NamedTuple):
    """What a user asks for on the command line.

    Attributes:
        task: File of a task of the user's own, or None.
        scenes: File of scenes, or None.
        method: ``eamp``, ``memetic``, ``perturbation`` or ``resolved-rate``.
        settings_name: ``literal`` or ``recommended``.
        settings: Settings of the method that differ from these.
        subpopulations: Sub-populations that work on each point at once.
        seed: Seed of all random streams.
        population: Individuals for each point, or None for the method's own number.
        generations: Generations for each point, or None for the method's own number.
    """

    task: Path | None
    scenes: Path | None
    method: str
    settings_name: str
    settings: dict[str, object]
    subpopulations: int
    seed: int
    population: int | None
    generations: int | None


def options_of(choice: Choice) -> Redundant8Options:
    """Return what is to be run.

    Raises:
        InvalidOption: A task and scenes, or an option that the method does not have.
        InvalidParameters: A setting of the method is unknown or wrong.
        InvalidFile: The task file is wrong.
    """
    if choice.task is not None and choice.scenes is not None:
        raise InvalidOption(
            "--scenes", str(choice.scenes), "either a task file or a file of scenes"
        )
    scenes = _scenes(choice)
    own = choice.task is not None or choice.scenes is not None
    return Redundant8Options(
        tasks=[scene.task.parameters() for scene in scenes],
        names=[scene.name for scene in scenes],
        method=_method(choice).parameters(),
        subpopulations=choice.subpopulations,
        case=None if own else 1,
        seed=choice.seed,
    )


def prepare(options: Redundant8Options) -> Experiment:
    """Prepare a run.

    Raises:
        InvalidTask: A task makes no sense.
        InvalidParameters: The method or its division makes none.
    """
    scenes = [
        Scene(name, TrackingTask.from_parameters(task))
        for name, task in zip(options.names, options.tasks, strict=True)
    ]
    method = build_method(options.method)
    problem = LineTracking(tuple(scene.task for scene in scenes), method, options.subpopulations)
    steps, each = scenes[0].task.n_steps, problem.evaluations_per_step()
    starts = np.stack([scene.task.start for scene in scenes])
    engine = TrackingEngine(starts, steps, options.subpopulations, each)

    def conclude(
        folder: OpenRunFolder, common: Common, timing: Timing, load: Load
    ) -> TrackingResult:
        for scene, path in zip(scenes, engine.paths, strict=True):
            write_tracking(folder.path, scene.name, scene.task, path)
        points = steps * len(scenes)
        shared = Shared(
            what="sub-populations" if options.subpopulations > 1 else "scenes",
            parts=options.subpopulations * len(scenes),
            steps=points,
            wall_seconds=common["wall_seconds"],
            compute_seconds=engine.step_seconds,
            busy_seconds=load.busy_seconds,
        )
        silent = timing["network_overhead_fraction"] * common["wall_seconds"]
        cost = NetworkCost(
            1e3 * silent / points, load.exchanges, list(load.busy_seconds), advice(shared)
        )
        return tracking_result(common, timing, scenes, engine.paths, engine.step_seconds, cost)

    return Experiment(
        name=NAME,
        method=method.name,
        case=options.case,
        seed=options.seed,
        population_size=method.population if isinstance(method, Evolution) else each,
        generations=steps,
        setup=Setup(problem.name, problem.parameters()),
        engine=engine,
        document=msgspec.to_builtins(options),
        paper=None,
        conclude=conclude,
        parallelism=options.subpopulations * len(scenes),
        subject=f"{len(scenes)} scenes" if len(scenes) > 1 else "",
    )


def restore(document: Mapping[str, object]) -> Experiment:
    """Prepare the run that a ``run.toml`` describes again.

    Raises:
        InvalidOption: The file does not say what tramnet wrote.
    """
    try:
        return prepare(msgspec.convert(document[NAME], Redundant8Options, strict=True))
    except (KeyError, msgspec.ValidationError) as error:
        raise InvalidOption(
            "run.toml", str(error), f"the table {NAME} that tramnet wrote"
        ) from error


def _scenes(choice: Choice) -> tuple[Scene, ...]:
    if choice.scenes is not None:
        return read_scenes(choice.scenes)
    if choice.task is not None:
        return (Scene("", read_tracking_task(choice.task)),)
    return (Scene("", TrackingTask.of_paper()),)


def _method(choice: Choice) -> TrackingMethod:
    """Return the method with its settings."""
    if choice.method not in method_names():
        raise InvalidOption("--method", repr(choice.method), f"one of {', '.join(method_names())}")
    if choice.settings_name not in SETTINGS:
        raise InvalidOption("--settings", repr(choice.settings_name), " or ".join(SETTINGS))
    method = build_method({"name": choice.method, **choice.settings})
    sizes = {"population": choice.population, "generations": choice.generations}
    wanted: dict[str, object] = {name: n for name, n in sizes.items() if n is not None}
    if not isinstance(method, Evolution):
        for name, size in wanted.items():
            raise InvalidOption(f"--{name}", str(size), f"none: {method.name} has none")
        return method
    if "seed" in choice.settings:
        raise InvalidParameters(method.name, "seed is set by --seed")
    recommended = choice.settings_name == "recommended" and isinstance(method, Eamp)
    stock = Eamp.recommended() if recommended else type(method)()
    own = {**choice.settings, **wanted, "seed": choice.seed}
    return build_method({**stock.parameters(), **own})
