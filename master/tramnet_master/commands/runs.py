"""Commands that make a run, or go on with one."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from tramnet_master.commands.launch import Presentation, go_on, launch
from tramnet_master.errors import InvalidFile, InvalidOption
from tramnet_master.experiments import own_problem
from tramnet_master.experiments import puma560 as puma560_experiment
from tramnet_master.experiments.experiment import Experiment
from tramnet_master.experiments.runner import RunOptions, read_options
from tramnet_master.options import (
    AllowMixed,
    CheckpointSeconds,
    FirstDeadline,
    Generations,
    Listen,
    Network,
    OnFailure,
    Out,
    Overwrite,
    Pictures,
    Population,
    Progress,
    Seed,
    Task,
    Topology,
    Workers,
)
from tramnet_master.run_folder import RUN, RunFolder

app = typer.Typer(no_args_is_help=True, help="Launch a root and local workers, and make a run.")

RESTORE: Mapping[str, Callable[[Mapping[str, object]], Experiment]] = {
    own_problem.NAME: own_problem.restore,
    puma560_experiment.NAME: puma560_experiment.restore,
}

Case = Annotated[
    int | None,
    typer.Option(min=1, max=7, envvar="TRAMNET_CASE", help="Case of the paper; 1 if omitted."),
]
Method = Annotated[
    str,
    typer.Option(envvar="TRAMNET_METHOD", help="wang-zalzala (the paper's) or smooth (better)."),
]
Robot = Annotated[
    str, typer.Option(envvar="TRAMNET_ROBOT", help="Arm of a case: akb or p560, after its source.")
]
Servo = Annotated[
    float | None,
    typer.Option(
        envvar="TRAMNET_SERVO",
        help="Replay the plan with set-points every 28, 7, 1.75 or 0.875 ms (the paper's section 6).",
    ),
]
ProblemName = Annotated[str, typer.Argument(metavar="PROBLEM", help="See `tramnet problems`.")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="NAME=VALUE", help="A setting of the method or problem; may be repeated."
    ),
]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")]


@app.command()
def puma560(
    case: Case = None,
    task: Task = None,
    method: Method = "wang-zalzala",
    robot: Robot = "akb",
    settings: Settings = None,
    servo: Servo = None,
    seed: Seed = 1,
    population: Population = None,
    generations: Generations = None,
    workers: Workers = 2,
    topology: Topology = "star",
    network: Network = None,
    listen: Listen = "tcp/127.0.0.1:0",
    first_deadline: FirstDeadline = 60.0,
    on_failure: OnFailure = "penalise",
    allow_mixed: AllowMixed = False,
    out: Out = None,
    overwrite: Overwrite = False,
    pictures: Pictures = True,
    progress: Progress = "auto",
    checkpoint_seconds: CheckpointSeconds = 1.0,
) -> None:
    """Minimum-time motion of the PUMA 560 (Wang & Zalzala 1995), or of your own arm."""
    choice = puma560_experiment.Choice(
        case,
        task,
        robot,
        method,
        seed,
        population,
        generations,
        read_settings(settings or []),
        servo,
    )
    farm = RunOptions(
        workers,
        topology,
        network,
        listen,
        first_deadline,
        on_failure,
        allow_mixed,
        checkpoint_seconds,
    )
    experiment = puma560_experiment.prepare(puma560_experiment.options_of(choice))
    launch(experiment, farm, Presentation(out, overwrite, pictures, progress))


@app.command()
def problem(
    name: ProblemName,
    settings: Settings = None,
    seed: Seed = 1,
    population: Population = None,
    generations: Generations = None,
    workers: Workers = 2,
    topology: Topology = "star",
    network: Network = None,
    listen: Listen = "tcp/127.0.0.1:0",
    first_deadline: FirstDeadline = 60.0,
    on_failure: OnFailure = "penalise",
    allow_mixed: AllowMixed = False,
    out: Out = None,
    overwrite: Overwrite = False,
    pictures: Pictures = True,
    progress: Progress = "auto",
    checkpoint_seconds: CheckpointSeconds = 1.0,
) -> None:
    """Minimise any installed problem over a box of real numbers."""
    options = own_problem.OwnProblemOptions(
        problem=name,
        parameters=read_settings(settings or []),
        seed=seed,
        population=population or own_problem.POPULATION,
        generations=generations or own_problem.GENERATIONS,
    )
    farm = RunOptions(
        workers,
        topology,
        network,
        listen,
        first_deadline,
        on_failure,
        allow_mixed,
        checkpoint_seconds,
    )
    launch(own_problem.prepare(options), farm, Presentation(out, overwrite, pictures, progress))


def resume(
    folder: Folder,
    workers: Annotated[int | None, typer.Option(min=0, max=4094)] = None,
    pictures: Pictures = True,
    progress: Progress = "auto",
) -> None:
    """Go on with a run that was interrupted or killed, from its last checkpoint."""
    opened = RunFolder(folder)
    document = opened.run()
    name = document.get("experiment")
    if not isinstance(name, str) or name not in RESTORE:
        known = ", ".join(RESTORE)
        raise InvalidFile(folder / RUN, "experiment", repr(name), f"one of {known}")
    presentation = Presentation(folder, overwrite=False, pictures=pictures, progress=progress)
    go_on(
        RESTORE[name](document), read_options(folder / RUN, document, workers), folder, presentation
    )


def read_settings(settings: list[str]) -> dict[str, object]:
    """Return ``NAME=VALUE`` words as plain values: a number, true, false, a JSON list, or else a word.

    Raises:
        InvalidOption: A word has no ``=``.
    """
    values: dict[str, object] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not (name and equals):
            raise InvalidOption("--set", repr(setting), "NAME=VALUE")
        try:
            values[name] = msgspec.json.decode(text)
        except msgspec.DecodeError:
            values[name] = text
    return values
