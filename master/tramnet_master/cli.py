"""The command line: ``tramnet``. Commands live in ``commands``; here is their list and what their errors become."""

import contextlib
import io
import os
import sys
from importlib.metadata import version
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from tramnet_master.commands import certificates, network, results, runs, simulate, tables, topology
from tramnet_master.commands.echo import echo
from tramnet_master.commands.inspect import inspect
from tramnet_master.commands.record import record
from tramnet_master.commands.status import status
from tramnet_master.commands.traffic import traffic
from tramnet_master.console import people, programs
from tramnet_master.errors import MasterError
from tramnet_protocol.errors import (
    BadCredentials,
    BadEndpoint,
    BadKey,
    BadLink,
    BadTopology,
    ProtocolError,
)
from tramnet_workers.errors import InvalidParameters, InvalidTask, UnknownProblem, WorkersError

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

_BAD_INPUT = (
    BadCredentials, BadKey, BadEndpoint, BadLink, BadTopology, InvalidTask, InvalidParameters,
    UnknownProblem,
)  # fmt: skip


class _InOrder(TyperGroup):
    """Commands in the order in which people need them, groups among them."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands."""
        names = super().list_commands(ctx)
        return sorted(names, key=lambda name: _ORDER.index(name) if name in _ORDER else len(_ORDER))


_ORDER = (
    "run", "resume", "report", "table", "worker", "scale", "stop", "inspect", "echo", "record", "traffic",
    "simulate", "topology", "problems", "certificates",
)  # fmt: skip

app = typer.Typer(
    name="tramnet",
    help="Evolve robot motions and robot designs on a network of processes that mirrors a transputer machine.",
    cls=_InOrder,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(runs.app, name="run")
app.add_typer(tables.app, name="table")
app.add_typer(simulate.app, name="simulate")
app.command()(runs.resume)
app.command()(network.worker)
app.command()(network.scale)
app.command()(network.stop)
app.command()(status)
app.command()(topology.topology)
app.command()(inspect)
app.command()(echo)
app.command()(record)
app.command()(traffic)
app.command()(certificates.certificates)
app.command()(results.report)
app.command()(results.problems)


def _show_version(wanted: bool) -> None:
    if wanted:
        programs.print(f"tramnet {version('tramnet')}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line; the exit codes are 0 done, 1 failed, 2 bad input, 130 interrupted."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal that has no such letter shows another
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code."""
    try:
        app(arguments)
    except SystemExit as end:  # after --help, or after a wrong word was told of
        return end.code if isinstance(end.code, int) else DONE
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:  # `tramnet echo ... | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (MasterError, ProtocolError, WorkersError) as error:
        with contextlib.suppress(OSError):  # nobody may be left to read it
            people.print("[red]error:[/red] ", end="")
            people.print(f"{error}", markup=False, soft_wrap=True)
        return exit_code(error)
    return DONE


def exit_code(error: MasterError | ProtocolError | WorkersError) -> int:
    """Return what the command line returns for an error."""
    if isinstance(error, MasterError):
        return error.exit_code
    return BAD_INPUT if isinstance(error, _BAD_INPUT) else FAILED
