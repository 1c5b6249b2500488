"""Commands that watch a running network, through the root's endpoint for observers."""

import queue
import time
from typing import Annotated

import msgspec
import typer
from rich.console import Group
from rich.live import Live
from rich.table import Table

from tramnet_master.console import people, programs
from tramnet_master.control import ask, locate
from tramnet_master.options import Connect, Network
from tramnet_master.traffic.echo import Echo, full_pattern
from tramnet_master.traffic.inspector import Inspector
from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import ControlRequest
from tramnet_protocol.transport import open_observer

HEARTBEATS = 2.5
"""Time in which every TRAM sends two heartbeats [s]."""

REFRESH = 0.25
"""Period of the live view [s]."""

Json = Annotated[bool, typer.Option("--json", help="One JSON object on standard output, then end.")]
Once = Annotated[bool, typer.Option("--once", help="Show the network once, then end.")]
Key = Annotated[str, typer.Argument(help="Key or pattern: link/**, link/0/1, stats/*, events.")]
EchoCount = Annotated[int, typer.Option("--count", min=0, help="Frames to show; 0 for all.")]
Timeout = Annotated[float, typer.Option(min=0.0, help="Seconds to listen; 0 for ever.")]


def inspect(
    connect: Connect = None, network: Network = None, once: Once = False, json: Json = False
) -> None:
    """Show the TRAMs and links of a running network, live."""
    live = locate(connect, network)
    inspector = Inspector()
    status = ask(live, ControlRequest("status")).status
    with open_observer(live.observers) as channel:
        channel.subscribe(Keys(live.network).all_stats, lambda _, payload: inspector.take(payload))
        if once or json:
            _listen(inspector, status)
            status = ask(live, ControlRequest("status")).status
            if json:
                programs.print(_document(status, inspector))
            else:
                programs.print(_view(status, inspector))
            return
        with Live(console=people, refresh_per_second=4, screen=False) as screen:
            while True:
                screen.update(_view(status, inspector))
                time.sleep(REFRESH)
                status = ask(live, ControlRequest("status")).status


def echo(
    key: Key,
    connect: Connect = None,
    network: Network = None,
    count: EchoCount = 0,
    timeout: Timeout = 0.0,
) -> None:
    """Print frames as they pass, decoded, one JSON object a line; arrays are cut short."""
    live = locate(connect, network)
    shown, echoes = 0, Echo()
    arrived: queue.Queue[tuple[str, bytes]] = queue.Queue(maxsize=10_000)

    def enqueue(found: str, payload: bytes) -> None:
        if not arrived.full():
            arrived.put_nowait((found, payload))

    end = time.monotonic() + timeout if timeout else float("inf")
    with open_observer(live.observers) as channel:
        channel.subscribe(full_pattern(live.network, key), enqueue)
        while time.monotonic() < end and (not count or shown < count):
            try:
                found, payload = arrived.get(timeout=min(0.2, max(0.0, end - time.monotonic())))
            except queue.Empty:
                continue
            line = msgspec.json.encode(echoes.describe(found, payload)).decode()
            programs.print(line, markup=False)
            shown += 1
    if echoes.missed:
        people.print(f"{echoes.missed} frames passed unseen: observers never hold the network up")


def _listen(inspector: Inspector, status: dict[str, object]) -> None:
    """Wait until the rates of all live TRAMs are known."""
    workers = status.get("workers")
    expected = (
        {0}
        | {worker["seat"] for worker in workers if isinstance(worker, dict) and worker.get("live")}
        if isinstance(workers, list)
        else {0}
    )
    end = time.monotonic() + HEARTBEATS
    while time.monotonic() < end:
        if expected <= inspector.seats and inspector.complete:
            return
        time.sleep(0.02)


def _document(status: dict[str, object], inspector: Inspector) -> str:
    document = {**status, "trams": inspector.trams(), "links": inspector.links()}
    return msgspec.json.encode(document).decode()


def _view(status: dict[str, object], inspector: Inspector) -> Group:
    best = status.get("best")
    head = (
        f"[bold]{status.get('network')}[/bold]  {status.get('title')}  "
        f"generation {status.get('generation')}/{status.get('generations')}  "
        f"best {best if best is None else format(best, '.6g')}  "
        f"{status.get('topology')}, epoch {status.get('epoch')}, lost {status.get('lost')}"
    )
    return Group(head, _tram_table(inspector), _link_table(inspector))


def _tram_table(inspector: Inspector) -> Table:
    table = Table(title="TRAMs", title_justify="left")
    for name in (
        "TRAM",
        "host",
        "pid",
        "state",
        "chunks",
        "evaluations",
        "per s",
        "busy",
        "blocked",
    ):
        table.add_column(name, justify="left" if name in ("host", "state") else "right")
    for row in inspector.trams():
        table.add_row(
            f"{row.seat}", row.host, f"{row.pid}", row.state, f"{row.chunks}", f"{row.evaluations}",
            f"{row.evaluations_per_s:,.0f}", f"{row.busy:.0%}", f"{row.blocked:.0%}",
        )  # fmt: skip
    return table


def _link_table(inspector: Inspector) -> Table:
    table = Table(title="Links", title_justify="left")
    for name in ("link", "frames", "frames/s", "kB/s", "mean B", "of 20 Mbaud"):
        table.add_column(name, justify="right")
    for row in inspector.links():
        table.add_row(
            f"{row.source} → {row.destination}", f"{row.frames}", f"{row.frames_per_s:,.0f}",
            f"{row.bytes_per_s / 1e3:,.1f}", f"{row.mean_bytes:,.0f}", f"{row.utilisation:.1%}",
        )  # fmt: skip
    return table
