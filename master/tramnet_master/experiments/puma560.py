"""Wang & Zalzala (1995): minimum-time motion of the PUMA 560; cases 1-7, and anybody's own task.

Two methods. ``wang-zalzala`` is the paper's, on its grid of joint angles. ``smooth`` is today's: a genetic
algorithm over smooth paths, each timed as fast as the torques allow.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple, TypeVar

import msgspec
import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from tramnet_master.configuration import ROBOTS, read_motion_task
from tramnet_master.engines.farmed import GenerationalEngine
from tramnet_master.errors import InvalidOption, RunFailed
from tramnet_master.experiments.experiment import Common, Experiment, Load, Timing
from tramnet_master.experiments.paper_cases import paper_cases
from tramnet_master.motion_results import motion_result, write_motion
from tramnet_master.results import MotionResult
from tramnet_master.run_folder import OpenRunFolder
from tramnet_master.servo_results import servo_result
from tramnet_protocol.messages import Setup
from tramnet_workers.evolution import smooth, wang_zalzala
from tramnet_workers.evolution.algorithm import Algorithm
from tramnet_workers.problems.grid_motion import DecodingSettings, GridMotion
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.plan import Plan
from tramnet_workers.problems.servo import PERIODS, ServoSettings
from tramnet_workers.problems.smooth_motion import SmoothMotion
from tramnet_workers.problems.straight_line import straight_line
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START

NAME = "puma560"

SERVO_PERIODS_MS = tuple(round(1000 * period, 6) for period in PERIODS)

ONE_POSTURE = (
    "as in the paper, torques were bounded at one posture of each segment: --set posture=exact "
    "bounds them at three, and --method smooth finds a faster motion that holds"
)
"""What to do about a plan of the paper's method that overshoots."""

Settings = TypeVar("Settings", bound=Struct)


class Puma560Options(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is run.

    Attributes:
        task: The motion, as plain values.
        method: ``wang-zalzala`` or ``smooth``.
        case: Case of the paper, or None for a user's own task.
        paper: The paper's motion time for that case [s], or None.
        seed: Seed of all random streams.
        population: Individuals in a generation, or None for the method's own.
        generations: Number of generations, or None for the method's own.
        settings: Settings of the method that differ from its own.
        servo_ms: Period of the set-points with which the plan is replayed through a servo, or None [ms].
    """

    task: dict[str, object]
    method: str = "wang-zalzala"
    case: int | None = None
    paper: float | None = None
    seed: int = 1
    population: int | None = None
    generations: int | None = None
    settings: dict[str, object] = {}
    servo_ms: float | None = None


class Planner(NamedTuple):
    """A method made ready for a task.

    Attributes:
        setup: The problem, as workers build it.
        algorithm: What breeds.
        generations: Number of generations.
        plan: Turns a chromosome into its motion, or None where it has none.
    """

    setup: Setup
    algorithm: Algorithm
    generations: int
    plan: Callable[[NDArray[np.generic]], Plan | None]


class Choice(NamedTuple):
    """What a user asks for on the command line.

    Attributes:
        case: Case of the paper, or None.
        task: File of a task of the user's own, or None.
        robot: The arm of a case, ``akb`` or ``p560``; a task file names its own.
        method: ``wang-zalzala`` or ``smooth``.
        seed: Seed of all random streams.
        population: Individuals in a generation, or None for the method's own.
        generations: Number of generations, or None for the method's own.
        settings: Settings of the method that differ from its own.
        servo_ms: Period of the set-points of a replay through a servo, or None [ms].
    """

    case: int | None
    task: Path | None
    robot: str
    method: str
    seed: int
    population: int | None
    generations: int | None
    settings: dict[str, object]
    servo_ms: float | None = None


def options_of(choice: Choice) -> Puma560Options:
    """Return what is to be run.

    Raises:
        InvalidOption: A case and a task, or an unknown robot.
        InvalidFile: The task file is wrong.
    """
    own = Puma560Options(
        task={},
        method=choice.method,
        seed=choice.seed,
        population=choice.population,
        generations=choice.generations,
        settings=choice.settings,
        servo_ms=choice.servo_ms,
    )
    if choice.servo_ms is not None and choice.servo_ms not in SERVO_PERIODS_MS:
        known = ", ".join(f"{period:g}" for period in SERVO_PERIODS_MS)
        raise InvalidOption("--servo", f"{choice.servo_ms:g}", f"one of {known}")
    if choice.task is not None:
        if choice.case is not None:
            raise InvalidOption("--case", str(choice.case), "either a case or a task file")
        return replace(own, task=read_motion_task(choice.task).parameters())
    if choice.robot not in ROBOTS:
        raise InvalidOption("--robot", repr(choice.robot), f"one of {', '.join(ROBOTS)}")
    cases = paper_cases()
    case = cases.find(choice.case or 1)
    task = MotionTask.for_arm(
        ROBOTS[choice.robot](),
        PAPER_START,
        PAPER_GOAL,
        weights=case.weights,
        segments=case.segments,
    )
    faithful = choice.method == "wang-zalzala"
    return replace(
        own,
        task=task.parameters(),
        case=case.number,
        paper=case.motion_time_s,
        population=choice.population or (cases.population if faithful else None),
        generations=choice.generations or (cases.generations_of(case) if faithful else None),
    )


def prepare(options: Puma560Options) -> Experiment:
    """Prepare a run.

    Raises:
        InvalidTask: The task makes no sense.
        InvalidOption: The method or one of its settings is unknown or wrong.
    """
    task = MotionTask.from_parameters(options.task)
    if options.method not in METHODS:
        raise InvalidOption("--method", repr(options.method), f"one of {', '.join(METHODS)}")
    planner = METHODS[options.method](task, options)
    engine = GenerationalEngine(planner.algorithm, planner.generations)

    def conclude(folder: OpenRunFolder, common: Common, timing: Timing, _: Load) -> MotionResult:
        plan = planner.plan(engine.best.genome)
        if plan is None:
            raise RunFailed(
                "no motion was found: the arm is too weak, or its limits too narrow, for any path "
                f"that was tried (best objective {engine.best.objective:g})"
            )
        line = straight_line(task)
        write_motion(folder.path, task, plan, line)
        result = motion_result(common, timing, task, plan, line)
        if not result.verified and options.method == "wang-zalzala":
            result = replace(result, failures=[*result.failures, ONE_POSTURE])
        if options.servo_ms is None:
            return result
        settings = ServoSettings(period=options.servo_ms / 1000)
        return replace(result, servo=servo_result(folder.path, task, plan, settings))

    return Experiment(
        name=NAME,
        method=options.method,
        case=options.case,
        seed=options.seed,
        population_size=planner.algorithm.population_size,
        generations=planner.generations,
        setup=planner.setup,
        engine=engine,
        document=msgspec.to_builtins(options),
        paper=options.paper,
        conclude=conclude,
    )


def restore(document: Mapping[str, object]) -> Experiment:
    """Prepare the run that a ``run.toml`` describes again.

    Raises:
        InvalidOption: The file does not say what tramnet wrote.
    """
    try:
        return prepare(msgspec.convert(document[NAME], Puma560Options, strict=True))
    except (KeyError, msgspec.ValidationError) as error:
        raise InvalidOption(
            "run.toml", str(error), f"the table {NAME} that tramnet wrote"
        ) from error


def _smooth(task: MotionTask, options: Puma560Options) -> Planner:
    problem = SmoothMotion(task)
    generations = options.generations or smooth.GENERATIONS
    algorithm = smooth.SmoothEvolution(
        options.seed,
        options.population or smooth.POPULATION_SIZE,
        generations,
        problem.lower,
        problem.upper,
        _settings(options.method, options.settings, smooth.SmoothSettings),
    )
    return Planner(Setup(problem.name, problem.parameters()), algorithm, generations, problem.plan)


def _wang_zalzala(task: MotionTask, options: Puma560Options) -> Planner:
    decoding = {
        name: value
        for name, value in options.settings.items()
        if name in DecodingSettings.__struct_fields__
    }
    breeding = {k: v for k, v in options.settings.items() if k not in decoding}
    problem = GridMotion(task, _settings(options.method, decoding, DecodingSettings))
    algorithm = wang_zalzala.WangZalzala(
        options.seed,
        options.population or wang_zalzala.POPULATION_SIZE,
        problem.grid,
        _settings(options.method, breeding, wang_zalzala.WangZalzalaSettings),
    )
    return Planner(
        Setup(problem.name, problem.parameters()),
        algorithm,
        options.generations or wang_zalzala.GENERATIONS,
        problem.plan,
    )


def _settings(method: str, settings: dict[str, object], kind: type[Settings]) -> Settings:
    try:
        return msgspec.convert(settings, kind, strict=True)
    except msgspec.ValidationError as error:
        known = ", ".join(kind.__struct_fields__)
        raise InvalidOption("--set", str(error), f"settings of {method}: {known}") from error


METHODS: Mapping[str, Callable[[MotionTask, Puma560Options], Planner]] = {
    "wang-zalzala": _wang_zalzala,
    "smooth": _smooth,
}
