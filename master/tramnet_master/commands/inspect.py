"""``tramnet inspect``: TRAMs, links and messages of a running network, live, once, or for programs."""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeAlias

import typer
from rich.console import Console
from rich.live import Live

from tramnet_master.commands.watching import watching
from tramnet_master.console import write
from tramnet_master.errors import InvalidOption
from tramnet_master.options import Attach, Network, Tls
from tramnet_master.traffic.controls import View, press
from tramnet_master.traffic.inspector import Inspector
from tramnet_master.traffic.keyboard import open_keyboard
from tramnet_master.traffic.observing import Observation, StatusPoll
from tramnet_master.traffic.picture import write_picture
from tramnet_master.traffic.rows import TABLES
from tramnet_master.traffic.selection import Selection, parse_filter, parse_sort
from tramnet_master.traffic.snapshot import Snapshot, csv_lines, document, take
from tramnet_master.traffic.sniffer import WINDOW, Sniffer
from tramnet_master.traffic.view import render
from tramnet_master.traffic.words import json_line
from tramnet_protocol.errors import NoAnswer
from tramnet_protocol.messages import ROOT

HEARTBEATS = 3.5
"""Longest wait for two heartbeats of every TRAM, which come once a second [s]."""

REFRESH = 1.0
"""Longest time between two pictures of the live view [s]."""

PERIOD = 1.0
"""Time between two outputs of --follow: heartbeats come once a second [s]."""

SILENT = 3.0
"""Silence of the root that is shown [s]."""

_OUTPUT = "Output"
_ROWS = "Rows"

Once: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--once",
        envvar="TRAMNET_ONCE",
        rich_help_panel=_OUTPUT,
        help="Show the network once, then end.",
    ),
]
Json: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--json", envvar="TRAMNET_JSON", rich_help_panel=_OUTPUT, help="One JSON object, then end."
    ),
]
Csv: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--csv",
        envvar="TRAMNET_CSV",
        rich_help_panel=_OUTPUT,
        help="One table (--show) as CSV, then end.",
    ),
]
Follow: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--follow",
        envvar="TRAMNET_FOLLOW",
        rich_help_panel=_OUTPUT,
        help="Go on once a second: JSON objects a line, or rows of CSV with their time.",
    ),
]
Svg: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--svg",
        envvar="TRAMNET_SVG",
        rich_help_panel=_OUTPUT,
        help="Draw the view into this file, then end.",
    ),
]
Width: TypeAlias = Annotated[
    int | None,
    typer.Option(
        min=40,
        max=400,
        envvar="TRAMNET_WIDTH",
        rich_help_panel=_OUTPUT,
        help="Columns of the view; the terminal's.",
    ),
]
Sniff: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--sniff",
        envvar="TRAMNET_SNIFF",
        help="Count every frame on the link topics: exact rates and sizes, at a cost that is shown.",
    ),
]
Show: TypeAlias = Annotated[
    str | None,
    typer.Option(
        envvar="TRAMNET_SHOW",
        rich_help_panel=_ROWS,
        help="Tables, with commas between: trams, links, tags, topics (of --sniff).",
    ),
]
Sort: TypeAlias = Annotated[
    str,
    typer.Option(
        envvar="TRAMNET_SORT",
        rich_help_panel=_ROWS,
        help="Column of --json to sort by: busy, bytes_per_s, ... Largest numbers first.",
    ),
]
Reverse: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--reverse", envvar="TRAMNET_REVERSE", rich_help_panel=_ROWS, help="Turn the order round."
    ),
]
Filter: TypeAlias = Annotated[
    str,
    typer.Option(
        envvar="TRAMNET_FILTER",
        rich_help_panel=_ROWS,
        help="Rows to show, all words must hold: 'tram=3', 'busy<50%', 'link/0', 'state=idle'.",
    ),
]


def inspect(
    connect: Attach = None,
    network: Network = None,
    tls: Tls = None,
    once: Once = False,
    json: Json = False,
    csv: Csv = False,
    follow: Follow = False,
    svg: Svg = None,
    sniff: Sniff = False,
    show: Show = None,
    sort: Sort = "",
    reverse: Reverse = False,
    filter: Filter = "",
    width: Width = None,
) -> None:
    """Show the TRAMs, links and messages of a running network, live.

    Reads the statistics that every TRAM publishes once a second. Ends with the network, by q or by Ctrl-C (exit
    code 0). In the live view tab changes the tables, s and S the order, / the filter, and p stops the picture.
    """
    selection = Selection(parse_filter(filter), parse_sort(sort), reverse)
    tables = _tables(show, csv, sniff)
    view = View(tables, selection, filter, _choices(tables, sniff))
    with watching(connect, network, tls) as (observation, said):
        watch = Watch(observation, Inspector(), Sniffer() if sniff else None)
        watch.begin()
        if json or csv:
            _print(watch, follow, _programs_text(view, csv))
        elif svg is not None:
            write_picture(svg, render(watch.settle(), view, width or 100), width or 100)
        elif once or not (live := Console(highlight=False)).is_terminal or live.is_dumb_terminal:
            _print(watch, not once, _people_text(view, width))
        else:
            _live(watch, view, live, said)


@dataclass
class Watch:
    """A network and what is collected of it.

    Attributes:
        observation: The network.
        inspector: What the heartbeats tell.
        sniffer: What the frames tell, or None.
    """

    observation: Observation
    inspector: Inspector
    sniffer: Sniffer | None

    def begin(self) -> None:
        """Begin to collect."""
        channel, keys = self.observation.channel, self.observation.keys
        channel.subscribe(keys.all_stats, lambda _, payload: self.inspector.take(payload))
        if self.sniffer is not None:
            channel.subscribe(keys.all_links, self.sniffer.take)

    def settle(self) -> Snapshot:
        """Return the network as soon as the rates of all its TRAMs are known."""
        began = time.monotonic()
        status = self.observation.first_status()
        while not self.observation.over and time.monotonic() < began + HEARTBEATS:
            sniffed = self.sniffer is None or time.monotonic() > began + WINDOW
            if sniffed and _expected(take(status, self.inspector, None)) <= self.inspector.rated:
                break
            self.observation.stopped.wait(0.02)
        return take(self.observation.first_status(), self.inspector, self.sniffer)


def _expected(snapshot: Snapshot) -> frozenset[tuple[int, int]]:
    live = {(w.seat, w.incarnation) for w in snapshot.status.workers if w.live}
    root = {(row.seat, row.incarnation) for row in snapshot.trams if row.seat == ROOT}
    return frozenset(live | (root or {(ROOT, 0)}))


def _print(watch: Watch, follow: bool, text: Callable[[Snapshot, bool], str]) -> None:
    """Print the network once, or once a second until the end."""
    snapshot = watch.settle()
    write(text(snapshot, True))
    if not follow:
        return
    said = snapshot.said
    while not watch.observation.stopped.wait(PERIOD) and not watch.observation.ended:
        with contextlib.suppress(NoAnswer):
            said = watch.observation.status(PERIOD)
        write(text(take(said, watch.inspector, watch.sniffer), False))


def _programs_text(view: View, csv: bool) -> Callable[[Snapshot, bool], str]:
    def text(snapshot: Snapshot, first: bool) -> str:
        if csv:
            name = view.tables[0]
            rows = view.selection.of(snapshot.table(name))
            return csv_lines(rows, TABLES[name], time.time(), first)
        return json_line(document(snapshot, view.selection, time.time())) + "\n"

    return text


def _people_text(view: View, width: int | None) -> Callable[[Snapshot, bool], str]:
    console = Console(highlight=False, width=width)

    def text(snapshot: Snapshot, first: bool) -> str:
        with console.capture() as captured:
            if not first:
                console.print()
            console.print(render(snapshot, view, console.width))
        return captured.get()

    return text


def _live(watch: Watch, view: View, console: Console, said: dict[str, object]) -> None:
    observation = watch.observation
    with contextlib.ExitStack() as stack:
        poll = stack.enter_context(StatusPoll(observation, said))
        keyboard = stack.enter_context(open_keyboard(observation.stopped))
        screen = stack.enter_context(
            Live(console=console, screen=True, auto_refresh=False, redirect_stderr=False)
        )
        snapshot = take(poll.latest, watch.inspector, watch.sniffer)
        while not observation.over and not view.ended:
            if not view.paused:
                snapshot = take(poll.latest, watch.inspector, watch.sniffer)
            silent = poll.silent_for
            note = f"the root has not answered for {silent:.0f} s" if silent > SILENT else ""
            picture = render(snapshot, view, console.width, console.height, note)
            screen.update(picture, refresh=True)
            for key in keyboard.read(REFRESH):
                view = press(view, key)


def _tables(show: str | None, csv: bool, sniff: bool) -> tuple[str, ...]:
    if show is None:
        if csv:
            return ("trams",)
        return ("trams", "topics") if sniff else ("trams", "links")
    tables = tuple(word.strip() for word in show.split(","))
    allowed = [name for name in TABLES if sniff or name != "topics"]
    for name in tables:
        if name not in allowed:
            hint = "topics come with --sniff" if name == "topics" else ""
            raise InvalidOption("--show", repr(name), f"some of {', '.join(allowed)}", hint)
    if csv and len(tables) != 1:
        raise InvalidOption("--show", repr(show), "one table for --csv")
    return tables


def _choices(tables: tuple[str, ...], sniff: bool) -> tuple[tuple[str, ...], ...]:
    known = [name for name in TABLES if sniff or name != "topics"]
    return tuple(dict.fromkeys([tables, *((name,) for name in known), tuple(known)]))
