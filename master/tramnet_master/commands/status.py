"""``tramnet status``: whether all is well, in a line and an exit code, as a health check wants it."""

from pathlib import Path
from typing import Annotated

import msgspec
import typer

from tramnet_master.console import programs
from tramnet_master.control import ask, locate
from tramnet_master.errors import NoNetwork, NotWell
from tramnet_master.keeping import kept_here
from tramnet_master.options import Attach, Network, Tls
from tramnet_master.traffic.status import Status, read_status
from tramnet_protocol.messages import ControlRequest

KeptHere = Annotated[
    bool,
    typer.Option(
        "--kept",
        envvar="TRAMNET_KEPT",
        help="Of the workers that `tramnet worker` keeps on this machine.",
    ),
]
Json = Annotated[
    bool,
    typer.Option("--json", envvar="TRAMNET_JSON", help="All that the root says, as a JSON object."),
]


def status(
    connect: Attach = None,
    network: Network = None,
    tls: Tls = None,
    kept: KeptHere = False,
    json: Json = False,
) -> None:
    """Say how a running network does; exit code 1 if its root does not answer.

    With --kept: how many of the workers kept here are in a network; exit code 1 if not all of them.
    """
    if kept:
        programs.print(_of_workers())
        return
    said = _ask_root(connect, network, tls)
    programs.print(msgspec.json.encode(said).decode() if json else _line(read_status(said)))


def _ask_root(connect: str | None, network: str | None, tls: Path | None) -> dict[str, object]:
    try:
        live = locate(connect, network)
    except NoNetwork as error:  # bad input to others, and here the answer
        raise NotWell(str(error)) from error
    return ask(live, ControlRequest("status"), tls).status


def _of_workers() -> str:
    kept = kept_here()
    if not kept.wanted:
        raise NotWell("found no `tramnet worker` on this machine, expected one that keeps workers")
    text = f"{kept.connected} of {kept.wanted} workers are in a network"
    if kept.connected < kept.wanted:
        raise NotWell(f"{text}; the others start, look for their root or hang")
    return text


def _line(status: Status) -> str:
    best = "" if status.best is None else f", best {status.best:.6g}"
    live = sum(worker.live for worker in status.workers)
    return (
        f"{status.network}: {status.title}, generation {status.generation} of {status.generations}{best}, "
        f"{live} workers, {status.lost} lost"
    )
