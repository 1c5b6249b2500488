"""``tramnet traffic``: the statistics of a recording again, and its figures."""

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from tramnet_master.options import Pictures

File: TypeAlias = Annotated[
    Path, typer.Argument(metavar="FILE", help="A file of `tramnet record`.")
]
Folder: TypeAlias = Annotated[
    Path | None, typer.Option("--out", help="Where the figures go; beside the file if omitted.")
]
Begin: TypeAlias = Annotated[
    float | None,
    typer.Option("--from", min=0.0, help="Second from which the space-time picture goes."),
]
End: TypeAlias = Annotated[
    float | None, typer.Option("--to", min=0.0, help="Second up to which it goes.")
]
Json: TypeAlias = Annotated[bool, typer.Option("--json", help="The statistics as a JSON object.")]


def traffic(
    file: File,
    out: Folder = None,
    begin: Begin = None,
    end: End = None,
    json: Json = False,
    pictures: Pictures = True,
) -> None:
    """Show what passed in a recording, link by link, and draw it: links over time, and what each TRAM did when."""
    from tramnet_master.traffic.showing import show_traffic  # noqa: PLC0415  slow to import

    show_traffic(file, out, (begin, end), json, pictures)
