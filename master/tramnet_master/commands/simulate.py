"""Commands that predict how long a run would take on machines that are not at hand."""

import datetime
import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec
import typer
from rich import box
from rich.table import Table
from rich.text import Text

from tramnet_master.commands import runs
from tramnet_master.commands.launch import RUNS
from tramnet_master.console import people, programs
from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.experiment import Experiment
from tramnet_master.files import write_atomically
from tramnet_master.options import Topology
from tramnet_master.run_folder import default_folder
from tramnet_master.simulation.machines import T805, carried_over, machine
from tramnet_master.simulation.measuring import measure
from tramnet_master.simulation.prediction import (
    MOST_WORKERS,
    Prediction,
    predict,
    usual_counts,
)
from tramnet_master.simulation.workload import Workload
from tramnet_master.topologies import find_shape
from tramnet_master.wording import time_span

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


class How(NamedTuple):
    """How a run is simulated.

    Attributes:
        node: What computes.
        mbaud: Speed of the transputers' links [Mbaud].
        topology: Shape of the network.
        workers: Numbers of workers, or None for the usual ones.
        evaluation_us: Time of an evaluation on the node, or None to measure it [us].
        breeding_us: Time between two generations on the node, or None to measure it [us].
        out: Folder for what is found, or None for a new one.
        json: Whether programs read it.
    """

    node: str
    mbaud: int
    topology: str
    workers: str | None
    evaluation_us: float | None
    breeding_us: float | None
    out: Path | None
    json: bool


ABOUT_AN_HOUR = (
    "the paper: about one hour for cases 1 to 6, about five days for case 7 (section 5.2), on a "
    "machine that it does not name"
)


def simulates(prepare: Callable[..., Experiment]) -> Callable[..., None]:
    """Make a command of a function that prepares an experiment.

    Args:
        prepare: Takes the options of its own; its docstring is the command's help.

    Returns:
        A command that takes these and says how to simulate the run.
    """
    own = inspect.signature(prepare, eval_str=True).parameters
    shared = inspect.signature(_how, eval_str=True).parameters

    @functools.wraps(prepare)
    def command(**values: object) -> None:
        how = _how(**{name: values.pop(name) for name in shared})  # type: ignore[arg-type]
        experiment = prepare(**values)
        _show(_predict(_workload(experiment, how), how), how)
        if (experiment.name, experiment.method) == ("puma560", "wang-zalzala"):
            people.print(ABOUT_AN_HOUR)

    parameters = [
        parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for parameter in (*own.values(), *shared.values())
    ]
    signature = inspect.Signature(parameters)
    command.__signature__ = signature  # type: ignore[attr-defined]  # what typer reads
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    return command


def _how(
    node: Node = T805,
    mbaud: Mbaud = 20,
    topology: Topology = "tree",
    workers: Counts = None,
    evaluation_us: EvaluationUs = None,
    breeding_us: BreedingUs = None,
    out: Out = None,
    json: Json = False,
) -> How:
    return How(node, mbaud, topology, workers, evaluation_us, breeding_us, out, json)


for job in runs.app.registered_commands:
    assert job.callback is not None, "a command has its function"
    app.command(job.callback.__name__)(simulates(inspect.unwrap(job.callback)))


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
    how = How(node, mbaud, topology, workers, evaluation_us, breeding_us, out, json)
    seconds = evaluation_us / 1e6, breeding_us / 1e6
    workload = Workload("given numbers", population, generations, genome_bytes, *seconds)
    _show(_predict(workload, how), how)


def _workload(experiment: Experiment, how: How) -> Workload:
    """Measure an experiment here and carry it over to the node; what is given stays as it is given."""
    here = measure(experiment)
    there = carried_over(here, how.node)
    if how.evaluation_us is not None:
        there = msgspec.structs.replace(there, evaluation=how.evaluation_us / 1e6)
    if how.breeding_us is not None:
        there = msgspec.structs.replace(there, breeding=how.breeding_us / 1e6)
    people.print(
        f"measured here: {time_span(here.evaluation)} each, {time_span(here.breeding)} between rounds; "
        f"on {how.node}: {time_span(there.evaluation)} and {time_span(there.breeding)}"
    )
    return there


def _predict(workload: Workload, how: How) -> Prediction:
    shape = find_shape(how.topology)
    most = min(MOST_WORKERS, shape.max_trams - 1)
    counts = (
        usual_counts(workload.population, most) if how.workers is None else _counts(how.workers)
    )
    return predict(workload, machine(how.node, how.mbaud), shape, counts)


def _counts(text: str) -> list[int]:
    """Return the numbers of a list such as ``1,4,16``.

    Raises:
        InvalidOption: A word of it is none.
    """
    words = [word.strip() for word in text.split(",")]
    if not all(word.isdigit() for word in words):
        raise InvalidOption("--workers", repr(text), "numbers of workers such as 1,4,16")
    return [int(word) for word in words]


def _show(prediction: Prediction, how: How) -> None:
    from tramnet_master.reports.scaling import draw_scaling  # noqa: PLC0415  slow to import
    from tramnet_master.reports.style import one_look, save  # noqa: PLC0415

    today = datetime.datetime.now().astimezone().date()
    folder = how.out or default_folder(RUNS, "simulate", today)
    folder.mkdir(parents=True, exist_ok=True)
    document = msgspec.json.format(msgspec.json.encode(prediction), indent=2) + b"\n"
    write_atomically(folder / PREDICTION, document)
    with one_look():
        save(draw_scaling(prediction), folder, FIGURE)
    if how.json:
        programs.print(document.decode().rstrip(), markup=False)
    people.print(_table(prediction))
    people.print(_verdict(prediction))
    people.print(f"prediction and figures in {folder}", markup=False, soft_wrap=True)


def _table(prediction: Prediction) -> Table:
    workload = prediction.workload
    table = Table(
        title=f"{workload.name} on {prediction.machine}, {prediction.topology}: "
        f"{workload.description}, {time_span(workload.breeding)} between rounds",
        title_justify="left",
        box=box.SIMPLE_HEAD,
    )
    names = ("workers", "time", "speed-up", "efficiency", "hops", "busiest link", "busy")
    for name in names:
        table.add_column(name, justify="right")
    for point in prediction.points:
        table.add_row(
            f"{point.workers}",
            time_span(point.seconds),
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
        f"best of these: {best.workers} workers, {time_span(best.seconds)}; master-slave optimum "
        f"√(n·Tf/Tc) = {prediction.optimum:.0f} TRAMs, with Tc = {time_span(prediction.message_seconds)} "
        "for the messages there and back"
    )
