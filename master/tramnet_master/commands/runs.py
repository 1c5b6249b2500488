"""Commands that make a run, or go on with one."""

import functools
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from tramnet_master.commands.launch import Presentation, go_on
from tramnet_master.commands.making_runs import Settings, makes_a_run, read_settings
from tramnet_master.errors import InvalidFile
from tramnet_master.experiments.experiment import Experiment
from tramnet_master.experiments.run_options import read_options
from tramnet_master.options import Generations, Pictures, Population, Progress, Seed, Task
from tramnet_master.run_folder import RUN, RunFolder

app = typer.Typer(no_args_is_help=True, help="Launch a root and local workers, and make a run.")

# Named, not imported: a run loads the kernels of its own job only.
EXPERIMENTS: Mapping[str, str] = {
    "crank": "tramnet_master.experiments.crank",
    "problem": "tramnet_master.experiments.own_problem",
    "puma560": "tramnet_master.experiments.puma560",
    "redundant8": "tramnet_master.experiments.redundant8",
}
"""Modules of the experiments, by name; each has a function ``restore``."""

Case = Annotated[
    int | None,
    typer.Option(min=1, max=7, envvar="TRAMNET_CASE", help="Case of the paper; 1 if omitted."),
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
Subpopulations = Annotated[
    int,
    typer.Option(
        min=1, max=4096, envvar="TRAMNET_SUBPOPULATIONS",
        help="Sub-populations that work on each point at once; the population is split evenly.",
    ),
]  # fmt: skip
Scenes = Annotated[
    Path | None,
    typer.Option(
        envvar="TRAMNET_SCENES",
        help="A TOML file of paths, boxes or weights, to be followed all at once.",
    ),
]
SettingsName = Annotated[
    str,
    typer.Option(
        "--settings", envvar="TRAMNET_SETTINGS",
        help="literal (the paper's, with our choices where it is silent) or recommended (ours).",
    ),
]  # fmt: skip
Variant = Annotated[
    str | None,
    typer.Option(
        envvar="TRAMNET_VARIANT",
        help="path-placement, mobile-base, prismatic, workspace or spatial.",
    ),
]
PrintedHc = Annotated[
    bool,
    typer.Option(
        "--printed-hc",
        envvar="TRAMNET_PRINTED_HC",
        help="Give eq (7) its printed sign, which makes degenerate arms.",
    ),
]
ProblemName = Annotated[str, typer.Argument(metavar="PROBLEM", help="See `tramnet problems`.")]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")]


def _method(text: str) -> object:
    return typer.Option(envvar="TRAMNET_METHOD", help=text)


@app.command()
@makes_a_run
def puma560(
    case: Case = None,
    task: Task = None,
    method: Annotated[
        str, _method("wang-zalzala (the paper's) or smooth (better).")
    ] = "wang-zalzala",
    robot: Robot = "akb",
    settings: Settings = None,
    servo: Servo = None,
    seed: Seed = 1,
    population: Population = None,
    generations: Generations = None,
) -> Experiment:
    """Minimum-time motion of the PUMA 560 (Wang & Zalzala 1995), or of your own arm."""
    from tramnet_master.experiments import puma560 as job  # noqa: PLC0415  loads its kernels

    own = read_settings(settings)
    choice = job.Choice(case, task, robot, method, seed, population, generations, own, servo)
    return job.prepare(job.options_of(choice))


@app.command()
@makes_a_run
def redundant8(
    task: Task = None,
    scenes: Scenes = None,
    method: Annotated[
        str, _method("eamp (the paper's), memetic (better), perturbation or resolved-rate.")
    ] = "eamp",
    settings_name: SettingsName = "literal",
    settings: Settings = None,
    subpopulations: Subpopulations = 1,
    seed: Seed = 1,
    population: Population = None,
    generations: Generations = None,
) -> Experiment:
    """An arm with eight joints follows a line past an obstacle (Lin, Chen & Yu 2017), or yours does."""
    from tramnet_master.experiments import redundant8 as job  # noqa: PLC0415  loads its kernels

    choice = job.Choice(
        task, scenes, method, settings_name, read_settings(settings), subpopulations, seed,
        population, generations,
    )  # fmt: skip
    return job.prepare(job.options_of(choice))


@app.command()
@makes_a_run
def crank(
    task: Task = None,
    variant: Variant = None,
    method: Annotated[
        str, _method("mpga (the paper's), single-ga or bilevel-cma (what it is compared with).")
    ] = "mpga",
    settings_name: Annotated[
        str,
        typer.Option(
            "--settings",
            envvar="TRAMNET_SETTINGS",
            help="literal (as printed), recommended, or polished (with a local search of the links).",
        ),
    ] = "recommended",
    settings: Settings = None,
    printed_hc: PrintedHc = False,
    seed: Seed = 1,
    population: Population = None,
    generations: Generations = None,
) -> Experiment:
    """Design of an arm that turns a crank (Kim & Khosla 1992), or of any arm for your task points."""
    from tramnet_master.experiments import crank as job  # noqa: PLC0415  loads its kernels

    choice = job.Choice(
        task, variant, method, settings_name, read_settings(settings), printed_hc, seed,
        population, generations,
    )  # fmt: skip
    return job.prepare(job.options_of(choice))


@app.command()
@makes_a_run
def problem(
    name: ProblemName,
    settings: Settings = None,
    seed: Seed = 1,
    population: Population = None,
    generations: Generations = None,
) -> Experiment:
    """Minimise any installed problem over a box of real numbers."""
    from tramnet_master.experiments import own_problem  # noqa: PLC0415  loads its kernels

    options = own_problem.OwnProblemOptions(
        problem=name,
        parameters=read_settings(settings),
        seed=seed,
        population=population or own_problem.POPULATION,
        generations=generations or own_problem.GENERATIONS,
    )
    return own_problem.prepare(options)


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
    if not isinstance(name, str) or name not in EXPERIMENTS:
        known = ", ".join(EXPERIMENTS)
        raise InvalidFile(folder / RUN, "experiment", repr(name), f"one of {known}")
    restore: Callable[[Mapping[str, object]], Experiment]
    restore = import_module(EXPERIMENTS[name]).restore
    presentation = Presentation(folder, overwrite=False, pictures=pictures, progress=progress)
    options = read_options(folder / RUN, document, workers)
    go_on(functools.partial(restore, document), options, folder, presentation)
