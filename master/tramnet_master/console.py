"""The terminal: what people read goes to standard error, what programs read to standard output."""

import os
import sys

import typer
from rich.console import Console

people = Console(stderr=True, highlight=False)
programs = Console(highlight=False, soft_wrap=True)


def write(text: str) -> None:
    """Write text for another program, now; end in peace where that program has enough of it, as ``head`` does.

    Raises:
        typer.Exit: Nobody reads on.
    """
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError as error:
        # What is still buffered would raise again when the interpreter ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit from error
