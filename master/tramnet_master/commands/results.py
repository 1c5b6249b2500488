"""Commands that show what was found."""

from pathlib import Path
from typing import Annotated

import typer

from tramnet_master.console import programs
from tramnet_workers.problems.registry import problem_names

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a finished run.")]


def report(folder: Folder) -> None:
    """Make the figures and the summary of a finished run again, from its files alone."""
    from tramnet_master.reports.figures import write_figures  # noqa: PLC0415  slow to import
    from tramnet_master.reports.summary import print_summary  # noqa: PLC0415

    for path in write_figures(folder):
        programs.print(str(path), markup=False)
    print_summary(folder)


def problems() -> None:
    """List the installed problems: this package's and those of others."""
    for name in problem_names():
        programs.print(name)
