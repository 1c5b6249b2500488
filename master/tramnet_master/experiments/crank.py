"""Kim & Khosla (1992): design of an arm that turns a crank, or of any arm for any task points.

``mpga`` is the paper's: one population for each task point, and Progressive Design from the links to the motion.
``single-ga`` and ``bilevel-cma`` are what it is compared with, at equal evaluations of an arm at a point.
"""

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import NamedTuple

import msgspec
from msgspec import Struct

from tramnet_master.design_files import names_of, read_design_task
from tramnet_master.engines.engine import Engine
from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.design_searches import Conclusion, bilevel, mpga, single, spatial
from tramnet_master.experiments.experiment import Common, Experiment, Load, Timing
from tramnet_master.results import Result
from tramnet_master.run_folder import OpenRunFolder
from tramnet_master.spatial_files import read_spatial_task
from tramnet_protocol.messages import Setup
from tramnet_workers.mpga_settings import SETTINGS, GeneticSettings, MpgaSettings, Ramp
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.spatial_task import SpatialTask
from tramnet_workers.problems.variants import VARIANTS

NAME = "crank"
SPATIAL = "spatial"
METHODS: Mapping[str, Callable[[DesignTask, MpgaSettings, int], Conclusion]] = {
    "mpga": mpga,
    "single-ga": single,
    "bilevel-cma": bilevel,
}


class CrankOptions(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is run.

    Attributes:
        task: The task, the variant's changes included, as plain values.
        variant: Variant of the task, or None for the plain one.
        method: ``mpga``, ``single-ga`` or ``bilevel-cma``.
        settings: Name of the settings.
        changes: Settings that differ from these.
        printed_hc: Whether HC has the printed sign.
        seed: Seed of all random streams.
        case: 1 for the paper's task, None for a user's own.
    """

    task: dict[str, object]
    variant: str | None = None
    method: str = "mpga"
    settings: str = "recommended"
    changes: dict[str, object] = {}
    printed_hc: bool = False
    seed: int = 1
    case: int | None = None


class Choice(NamedTuple):
    """What a user asks for on the command line.

    Attributes:
        task: File of a task of the user's own, or None.
        variant: Variant of the task, or None.
        method: ``mpga``, ``single-ga`` or ``bilevel-cma``.
        settings_name: ``literal``, ``recommended`` or ``polished``.
        settings: Settings that differ from these.
        printed_hc: Whether HC has the printed sign.
        seed: Seed of all random streams.
        population: Individuals in each population, or None for the settings' own number.
        generations: Generations of the first search, or None for the settings' own number.
    """

    task: Path | None
    variant: str | None
    method: str
    settings_name: str
    settings: dict[str, object]
    printed_hc: bool
    seed: int
    population: int | None
    generations: int | None


def options_of(choice: Choice) -> CrankOptions:
    """Return what is to be run.

    Raises:
        InvalidOption: The variant, method or settings are unknown.
        InvalidFile: The task file is wrong, or none for the variant or the method.
    """
    known = [*VARIANTS, SPATIAL]
    if choice.variant is not None and choice.variant not in known:
        raise InvalidOption("--variant", repr(choice.variant), f"one of {', '.join(known)}")
    with names_of(choice.task) if choice.task is not None else nullcontext():
        options = _options(choice)
        if choice.task is not None:
            prepare(options)  # whose complaints are to have the names of the file
    return options


def _options(choice: Choice) -> CrankOptions:
    sizes = {"population_size": choice.population, "generations": choice.generations}
    wanted = {name: size for name, size in sizes.items() if size is not None}
    return CrankOptions(
        task=_task(choice),
        variant=choice.variant,
        method=choice.method,
        settings=choice.settings_name,
        changes={**choice.settings, **wanted},
        printed_hc=choice.printed_hc,
        seed=choice.seed,
        case=1 if choice.task is None else None,
    )


def prepare(options: CrankOptions) -> Experiment:
    """Prepare a run.

    Raises:
        InvalidTask: The task makes no sense, or none for the method.
        InvalidOption: The method or a setting is unknown or wrong.
    """
    settings, search = _settings(options), _search(options)
    conclusion = search(settings)

    def conclude(folder: OpenRunFolder, common: Common, timing: Timing, _: Load) -> Result:
        return conclusion.write(folder.path, common, timing, options.variant)

    engine: Engine = conclusion.engine
    return Experiment(
        name=NAME,
        method=options.method,
        case=options.case,
        seed=options.seed,
        population_size=conclusion.population_size,
        generations=conclusion.generations,
        setup=Setup(conclusion.problem, conclusion.parameters),
        engine=engine,
        document=msgspec.to_builtins(options),
        paper=None,
        conclude=conclude,
        parallelism=conclusion.parallelism,
    )


def restore(document: Mapping[str, object]) -> Experiment:
    """Prepare the run that a ``run.toml`` describes again.

    Raises:
        InvalidOption: The file does not say what tramnet wrote.
    """
    try:
        return prepare(msgspec.convert(document[NAME], CrankOptions, strict=True))
    except (KeyError, msgspec.ValidationError) as error:
        raise InvalidOption(
            "run.toml", str(error), f"the table {NAME} that tramnet wrote"
        ) from error


def _task(choice: Choice) -> dict[str, object]:
    if choice.variant == SPATIAL:
        spatial_task = SpatialTask() if choice.task is None else read_spatial_task(choice.task)
        return spatial_task.parameters()
    task = DesignTask() if choice.task is None else read_design_task(choice.task)
    vary = VARIANTS[choice.variant] if choice.variant is not None else None
    return (task if vary is None else vary(task)).parameters()


def _search(options: CrankOptions) -> Callable[[MpgaSettings], Conclusion]:
    if options.method not in METHODS:
        raise InvalidOption("--method", repr(options.method), f"one of {', '.join(METHODS)}")
    if options.variant == SPATIAL:
        if options.method != "mpga":
            raise InvalidOption("--method", options.method, "mpga, the one for spatial arms")
        task = SpatialTask.from_parameters(options.task)
        return lambda settings: spatial(task, settings, options.seed)
    planar = DesignTask.from_parameters(options.task)
    return lambda settings: METHODS[options.method](planar, settings, options.seed)


def _settings(options: CrankOptions) -> MpgaSettings:
    """Return the named settings with the user's changes."""
    if options.settings not in SETTINGS:
        raise InvalidOption("--settings", repr(options.settings), f"one of {', '.join(SETTINGS)}")
    named, changes = SETTINGS[options.settings], dict(options.changes)
    known = [f.name for f in fields(GeneticSettings)], [f.name for f in fields(Ramp)]
    own, ramp = ({k: changes.pop(k) for k in names if k in changes} for names in known)
    snap = changes.pop("snap", named.snap)
    if changes or not isinstance(snap, bool):
        expected = ", ".join([*known[0], *known[1], "snap (true or false)"])
        found = next(iter(changes), f"snap={snap}")
        raise InvalidOption("--set", repr(found), f"a setting of crank: {expected}")
    try:
        genetic = msgspec.convert({**asdict(named.genetic), **own}, GeneticSettings, strict=True)
        growth = msgspec.convert({**asdict(named.ramp), **ramp}, Ramp, strict=True)
    except msgspec.ValidationError as error:
        raise InvalidOption("--set", str(error), "a value that the setting can have") from error
    return replace(named, genetic=genetic, ramp=growth, snap=snap, printed_hc=options.printed_hc)
