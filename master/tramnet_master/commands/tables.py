"""Commands that measure what a paper's table has, and print it beside ours."""

from pathlib import Path
from typing import Annotated

import typer

from tramnet_master.console import people
from tramnet_master.options import Overwrite, Workers

app = typer.Typer(no_args_is_help=True, help="Print a paper's table beside ours.")

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
    from tramnet_master.commands.case_table import run_cases  # noqa: PLC0415  slow to import

    people.print(run_cases(seeds, cases, robot, workers, out, overwrite))


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


@app.command()
def crank(
    seeds: Annotated[
        int, typer.Option(min=1, max=1000, help="Seeds 1, 2, ... for few points.")
    ] = 2,
    most_points: Annotated[int, typer.Option(min=4, help="Largest number of task points.")] = 32,
) -> None:
    """Methods for Kim & Khosla's (1992) crank at equal evaluations, for more and more task points."""
    from tramnet_master.design_methods import (  # noqa: PLC0415  slow to import
        BUDGET,
        POINTS,
        measure_methods,
    )
    from tramnet_master.reports.method_table import method_table  # noqa: PLC0415

    points = [t for t in POINTS if t <= most_points]
    found = measure_methods(
        points, range(1, seeds + 1), lambda name: people.print(f"measuring {name}")
    )
    people.print(method_table(found, BUDGET))
