"""Commands that predict how long a run would take on machines that are not at hand."""

import datetime
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from rich import box
from rich.table import Table
from rich.text import Text

from tramnet_master.commands.launch import RUNS
from tramnet_master.commands.runs import Case, Method, ProblemName, Robot, Settings, read_settings
from tramnet_master.console import people, programs
from tramnet_master.errors import InvalidOption
from tramnet_master.experiments import own_problem
from tramnet_master.experiments import puma560 as puma560_experiment
from tramnet_master.experiments.experiment import Experiment
from tramnet_master.files import write_atomically
from tramnet_master.options import Generations, Population, Task, Topology
from tramnet_master.run_folder import default_folder
from tramnet_master.simulation.machines import T805, carried_over, machine
from tramnet_master.simulation.prediction import (
    MOST_WORKERS,
    Prediction,
    predict,
    usual_counts,
)
from tramnet_master.simulation.workload import Workload, measure
from tramnet_master.topologies import find_shape

app = typer.Typer(
    no_args_is_help=True,
    help="Predict runs on transputers of 1995, or on more of today's machines than are at hand.",
)

PREDICTION = "prediction.json"
FIGURE = "scaling"

Node = Annotated[
    str, typer.Option(envvar="TRAMNET_NODE", help="What computes: t805-25 or today (this machine).")
]
Mbaud = Annotated[
    int, typer.Option(envvar="TRAMNET_MBAUD", help="Speed of the transputers' links: 5, 10 or 20.")
]
Counts = Annotated[
    str | None,
    typer.Option(
        "--workers", help="Numbers of workers such as 1,4,16; up to one an individual if omitted."
    ),
]
EvaluationUs = Annotated[
    float | None,
    typer.Option(min=0.001, help="Time of an evaluation on the node [us]; measured if omitted."),
]
BreedingUs = Annotated[
    float | None,
    typer.Option(min=0.0, help="Time between two generations on the node [us]; measured likewise."),
]
Out = Annotated[
    Path | None,
    typer.Option(envvar="TRAMNET_OUT", help="Folder; a new one under runs/ if omitted."),
]
Json = Annotated[bool, typer.Option("--json", help="The prediction as JSON on standard output.")]

ABOUT_AN_HOUR = (
    "the paper: about one hour for cases 1 to 6, about five days for case 7 (section 5.2), on a "
    "machine that it does not name"
)


@app.command()
def puma560(
    case: Case = None,
    task: Task = None,
    method: Method = "wang-zalzala",
    robot: Robot = "akb",
    settings: Settings = None,
    population: Population = None,
    generations: Generations = None,
    node: Node = T805,
    mbaud: Mbaud = 20,
    topology: Topology = "tree",
    workers: Counts = None,
    evaluation_us: EvaluationUs = None,
    breeding_us: BreedingUs = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Minimum-time motion of the PUMA 560 (Wang & Zalzala 1995), or of your own arm."""
    choice = puma560_experiment.Choice(
        case, task, robot, method, 1, population, generations, read_settings(settings or [])
    )
    experiment = puma560_experiment.prepare(puma560_experiment.options_of(choice))
    workload = _workload(experiment, node, evaluation_us, breeding_us)
    _show(_predict(workload, node, mbaud, topology, workers), out, json)
    if experiment.case is not None and method == "wang-zalzala":
        people.print(ABOUT_AN_HOUR)


@app.command()
def problem(
    name: ProblemName,
    settings: Settings = None,
    population: Population = None,
    generations: Generations = None,
    node: Node = T805,
    mbaud: Mbaud = 20,
    topology: Topology = "tree",
    workers: Counts = None,
    evaluation_us: EvaluationUs = None,
    breeding_us: BreedingUs = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Any installed problem over a box of real numbers."""
    options = own_problem.OwnProblemOptions(
        problem=name,
        parameters=read_settings(settings or []),
        population=population or own_problem.POPULATION,
        generations=generations or own_problem.GENERATIONS,
    )
    workload = _workload(own_problem.prepare(options), node, evaluation_us, breeding_us)
    _show(_predict(workload, node, mbaud, topology, workers), out, json)


@app.command()
def numbers(
    evaluation_us: Annotated[float, typer.Option(min=0.001, help="Time of an evaluation [us].")],
    genome_bytes: Annotated[int, typer.Option(min=1, help="Length of a chromosome.")],
    breeding_us: Annotated[float, typer.Option(min=0.0, help="Time between generations [us].")] = 0,
    population: Annotated[int, typer.Option(min=1, max=10_000_000)] = 100,
    generations: Annotated[int, typer.Option(min=1, max=10_000_000)] = 300,
    node: Node = T805,
    mbaud: Mbaud = 20,
    topology: Topology = "tree",
    workers: Counts = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """A population of which you know the numbers."""
    workload = Workload(
        "given numbers",
        population,
        generations,
        genome_bytes,
        evaluation_us / 1e6,
        breeding_us / 1e6,
    )
    _show(_predict(workload, node, mbaud, topology, workers), out, json)


def _workload(
    experiment: Experiment, node: str, evaluation_us: float | None, breeding_us: float | None
) -> Workload:
    """Measure an experiment here and carry it over to the node; what is given stays as it is given."""
    here = measure(experiment)
    there = carried_over(here, node)
    if evaluation_us is not None:
        there = msgspec.structs.replace(there, evaluation=evaluation_us / 1e6)
    if breeding_us is not None:
        there = msgspec.structs.replace(there, breeding=breeding_us / 1e6)
    people.print(
        f"measured here: {_time(here.evaluation)} an evaluation, {_time(here.breeding)} between "
        f"generations; on {node}: {_time(there.evaluation)} and {_time(there.breeding)}"
    )
    return there


def _predict(
    workload: Workload, node: str, mbaud: int, topology: str, workers: str | None
) -> Prediction:
    shape = find_shape(topology)
    most = min(MOST_WORKERS, shape.max_trams - 1)
    counts = usual_counts(workload.population, most) if workers is None else _counts(workers)
    return predict(workload, machine(node, mbaud), shape, counts)


def _counts(text: str) -> list[int]:
    """Return the numbers of a list such as ``1,4,16``.

    Raises:
        InvalidOption: A word of it is none.
    """
    words = [word.strip() for word in text.split(",")]
    if not all(word.isdigit() for word in words):
        raise InvalidOption("--workers", repr(text), "numbers of workers such as 1,4,16")
    return [int(word) for word in words]


def _show(prediction: Prediction, out: Path | None, json: bool) -> None:
    from tramnet_master.reports.scaling import draw_scaling  # noqa: PLC0415  slow to import
    from tramnet_master.reports.style import one_look, save  # noqa: PLC0415

    today = datetime.datetime.now().astimezone().date()
    folder = out or default_folder(RUNS, "simulate", today)
    folder.mkdir(parents=True, exist_ok=True)
    document = msgspec.json.format(msgspec.json.encode(prediction), indent=2) + b"\n"
    write_atomically(folder / PREDICTION, document)
    with one_look():
        save(draw_scaling(prediction), folder, FIGURE)
    if json:
        programs.print(document.decode().rstrip(), markup=False)
    people.print(_table(prediction))
    people.print(_verdict(prediction))
    people.print(f"prediction and figures in {folder}", markup=False, soft_wrap=True)


def _table(prediction: Prediction) -> Table:
    workload = prediction.workload
    table = Table(
        title=f"{workload.name} on {prediction.machine}, {prediction.topology}: "
        f"{workload.population} individuals of {_time(workload.evaluation)}, "
        f"{workload.generations} generations, {_time(workload.breeding)} between them",
        title_justify="left",
        box=box.SIMPLE_HEAD,
    )
    names = ("workers", "time", "speed-up", "efficiency", "hops", "busiest link", "busy")
    for name in names:
        table.add_column(name, justify="right")
    for point in prediction.points:
        table.add_row(
            f"{point.workers}",
            _time(point.seconds),
            f"{point.speed_up:.2f}",
            f"{point.efficiency:.0%}",
            f"{point.mean_hops:.2f}",
            "{} → {}".format(*point.busiest),
            f"{point.utilisation:.1%}",
            style="bold" if point == prediction.best else "",
        )
    return table


def _verdict(prediction: Prediction) -> Text:
    best = prediction.best
    return Text(
        f"best of these: {best.workers} workers, {_time(best.seconds)}; master-slave optimum "
        f"√(n·Tf/Tc) = {prediction.optimum:.0f} TRAMs, with Tc = {_time(prediction.message_seconds)} "
        "for a chromosome out and its objective back"
    )


def _time(seconds: float) -> str:
    """Return a time in the unit that suits it."""
    if seconds >= 7200.0:
        return f"{seconds / 3600:.2f} h"
    if seconds >= 120.0:
        return f"{seconds / 60:.1f} min"
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.4g} {unit}"
    return f"{seconds * 1e6:.4g} us"
