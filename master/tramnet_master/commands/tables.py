"""Commands that measure what a paper's table has, and print it beside ours."""

import datetime
from pathlib import Path
from typing import Annotated

import typer

from tramnet_master.commands.launch import RUNS, make_run
from tramnet_master.console import people
from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.paper_cases import paper_cases
from tramnet_master.experiments.puma560 import NAME, Choice, options_of, prepare
from tramnet_master.experiments.runner import RunOptions
from tramnet_master.options import Overwrite, Workers
from tramnet_master.reports.paper_table import CaseOutcome, paper_table
from tramnet_master.results import MotionResult

app = typer.Typer(no_args_is_help=True, help="Print a paper's table beside ours.")

VARIANTS: dict[int, dict[str, dict[str, object]]] = {
    7: {"literal": {"switch": "literal"}, "continuous": {"switch": "continuous"}}
}
"""Cases that are run more than once, with the settings that set the runs apart."""

Seeds = Annotated[int, typer.Option(min=1, max=1000, help="Seeds 1, 2, ... for each case.")]
Cases = Annotated[str, typer.Option(help="Cases to run, such as 1,3 or 1-6.")]
Robot = Annotated[str, typer.Option(help="akb or p560.")]
Out = Annotated[
    Path | None, typer.Option(help="Folder of the runs' folders; a new one if omitted.")
]


@app.command()
def puma560(
    seeds: Seeds = 1,
    cases: Cases = "1-7",
    robot: Robot = "akb",
    workers: Workers = 2,
    out: Out = None,
    overwrite: Overwrite = False,
) -> None:
    """Motion times of Wang & Zalzala (1995), table 2: runs each case on local workers."""
    now = datetime.datetime.now().astimezone()
    folder = out or RUNS / f"table-{NAME}-{now:%Y-%m-%d-%H%M%S}"
    outcomes = []
    for number in _numbers(cases):
        for variant, settings in VARIANTS.get(number, {"": {}}).items():
            results = []
            for seed in range(1, seeds + 1):
                path = folder / f"case-{number}{f'-{variant}' if variant else ''}-seed-{seed}"
                choice = Choice(number, None, robot, "wang-zalzala", seed, None, None, settings)
                prepared = prepare(options_of(choice))
                people.print(f"case {number} {variant} seed {seed}".replace("  ", " "))
                result = make_run(prepared, RunOptions(workers), path, overwrite)
                assert isinstance(result, MotionResult), "puma560 plans motions"
                results.append(result)
            outcomes.append(_outcome(number, variant, results))
    people.print(paper_table(outcomes))


@app.command()
def redundant8() -> None:
    """Times of a step of Lin, Chen & Yu (2017), table 4: follows its line by each method, in this process."""
    from tramnet_master.reports.time_table import (  # noqa: PLC0415  slow to import
        quality_table,
        reading,
        time_table,
    )
    from tramnet_master.tracking_times import measure_methods  # noqa: PLC0415
    from tramnet_workers.problems.tracking_task import TrackingTask  # noqa: PLC0415

    found = measure_methods(TrackingTask.of_paper(), lambda name: people.print(f"measuring {name}"))
    for part in (time_table(found), quality_table(found), reading(found)):
        people.print(part)


def _outcome(number: int, variant: str, results: list[MotionResult]) -> CaseOutcome:
    return CaseOutcome(
        number,
        variant,
        tuple(result.motion_time_s for result in results),
        tuple(result.end_velocity_rad_s for result in results),
        tuple(result.best.generation for result in results),
    )


def _numbers(text: str) -> list[int]:
    """Return the numbers that words like ``1,3-5`` name.

    Raises:
        InvalidOption: A word names none, or no case of the paper.
    """
    known = [case.number for case in paper_cases().cases]
    expected = f"cases between {known[0]} and {known[-1]}, such as 1,3 or 1-6"
    numbers: list[int] = []
    for word in text.split(","):
        first, _, last = word.partition("-")
        if not (first.strip().isdigit() and (last or first).strip().isdigit()):
            raise InvalidOption("--cases", repr(text), expected)
        numbers += range(int(first), int(last or first) + 1)
    if not numbers or not set(numbers) <= set(known):
        raise InvalidOption("--cases", repr(text), expected)
    return numbers
