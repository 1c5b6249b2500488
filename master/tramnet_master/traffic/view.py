"""``tramnet inspect`` for people: a head of facts, then the tables, fitted to a terminal."""

import math
from collections.abc import Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tramnet_master.progress import duration, plural
from tramnet_master.traffic.columns import (
    ACCENT,
    ALARM,
    COLUMNS,
    GAP,
    IDLE,
    Column,
    fitting,
)
from tramnet_master.traffic.controls import HELP, View
from tramnet_master.traffic.selection import Selection
from tramnet_master.traffic.snapshot import Snapshot
from tramnet_master.traffic.words import printable

SEPARATOR = "  ·  "
_BAR = 24
_HEAD_STYLE = "bold underline"
_LEAST_ROWS = 3
_FIXED_LINES = 2  # one above the tables, one of keys below them
_LINES_OF_A_TABLE = 2  # its head, and what is not shown of it
_WIDE = 100
_EMPTY = {
    "trams": "no TRAM passes the filter, or none was heard yet",
    "links": "no link passes the filter, or none has carried a frame yet",
    "tags": "no kind of message passes the filter, or none was sent yet",
    "topics": "no frame passed yet that the filter lets through",
}


def render(
    snapshot: Snapshot, view: View, width: int, height: int | None = None, note: str = ""
) -> RenderableType:
    """Return what to show.

    Args:
        snapshot: The network.
        view: What to show of it.
        width: Columns of the terminal.
        height: Its lines, or None for as many as it takes, without the line of keys.
        note: A line to show above the tables, or an empty string.
    """
    head = _head(snapshot, width)
    if note:
        head.append(Text(note, style=ALARM, no_wrap=True, overflow="ellipsis"))
    tables = {name: view.selection.of(snapshot.table(name)) for name in view.tables}
    rooms: dict[str, int | None] = dict.fromkeys(tables)
    parts: list[RenderableType] = [*head]
    if height is not None:
        left = height - len(head) - _FIXED_LINES - _LINES_OF_A_TABLE * len(tables)
        rooms = dict(_share({name: len(rows) for name, rows in tables.items()}, left))
    parts.append(Text())
    for name, rows in tables.items():
        parts += _table(name, rows, view, width, rooms[name])
    if height is not None:
        parts.append(_foot(view))
    return Group(*parts)


def _head(snapshot: Snapshot, width: int) -> list[Text]:
    status = snapshot.status
    live = sum(worker.live for worker in status.workers)
    virtual = " (virtual)" if status.topology == "star" else ""
    first = [
        Text(printable(status.network), style=f"bold {ACCENT}"),
        Text(printable(status.title)),
        Text(f"{printable(status.topology)}{virtual}, epoch {status.epoch}"),
        Text(f"{live} {plural('worker', live)}", style="" if live else ALARM),
        Text(f"{status.lost} lost", style=ALARM if status.lost else IDLE),
        Text(f"up {duration(status.uptime)}"),
    ]
    second = [
        _progress(status.generation, status.generations, _BAR if width >= _WIDE else 0),
        Text(f"best {_objective(status.best)}", style="bold"),
        Text(f"{snapshot.evaluations_per_s:,.0f} evaluations/s"),
    ]
    lines = [*_flow(first, width), *_flow(second, width), *_flow(_counted(snapshot), width)]
    return lines + _flow(_cost(snapshot), width)


def _counted(snapshot: Snapshot) -> list[Text]:
    status = snapshot.status
    late = [f"{printable(reason)} {n:,}" for reason, n in status.dropped.items() if n]
    dropped = sum(status.dropped.values())
    why = f" ({', '.join(late)})" if late else ""
    facts = [
        ("malformed", status.malformed, ""),
        ("foreign", status.foreign, ""),
        ("over credit", status.over_credit, ""),
        ("refused joiners", status.refused, ""),
        ("dropped answers", dropped, why.replace("_", " ")),
    ]
    if not any(n for _, n, _ in facts):
        return [Text("nothing malformed, foreign, over credit, refused or dropped", style=IDLE)]
    return [Text(f"{name} {n:,}{more}", style=ALARM if n else IDLE) for name, n, more in facts]


def _cost(snapshot: Snapshot) -> list[Text]:
    cost = snapshot.cost
    if cost is None:
        return []
    return [
        Text("sniffing takes", style=ACCENT),
        Text(f"{cost.cpu:.1%} of a core here"),
        Text(f"{cost.bytes_per_s / 1e3:,.1f} kB/s more from the root"),
        Text(f"{cost.frames:,} frames seen"),
        Text(f"{cost.missed:,} missed", style=ALARM if cost.missed else IDLE),
    ]


def _progress(done: int, wanted: int, bar: int) -> Text:
    share = min(1.0, done / wanted) if wanted else 0.0
    line = Text(f"generation {done:,}/{wanted:,} ")
    if not bar:
        return line.append(f"({share:.0%})")
    full = math.floor(share * bar)
    return line.append("━" * full, style=ACCENT).append("─" * (bar - full), style=IDLE)


def _objective(best: float | None) -> str:
    return "none yet" if best is None else f"{best:.6g}"


def _flow(facts: Sequence[Text], width: int) -> list[Text]:
    """Put facts on lines, none of them broken in two."""
    lines: list[Text] = []
    for fact in facts:
        if lines and len(lines[-1]) + len(SEPARATOR) + len(fact) <= width:
            lines[-1].append(SEPARATOR, style=IDLE).append_text(fact)
        else:
            lines.append(Text(no_wrap=True, overflow="ellipsis").append_text(fact))
    return lines


def _table(
    name: str, rows: Sequence[Any], view: View, width: int, room: int | None
) -> list[RenderableType]:
    columns = fitting(COLUMNS[name], width)
    table = Table(box=None, padding=(0, GAP, 0, 0), pad_edge=False, header_style=_HEAD_STYLE)
    for column in columns:
        table.add_column(
            _title(column, view.selection),
            justify="left" if column.left else "right",
            width=column.width,
            no_wrap=True,
            overflow="ellipsis",
        )
    offset = 0 if room is None else max(0, min(view.offset, len(rows) - room))
    shown = rows[offset:] if room is None else rows[offset : offset + room]
    for row in shown:
        table.add_row(*(column.show(row) for column in columns))
    if not rows:
        return [table, Text(_EMPTY[name], style=IDLE), Text()]
    hidden = len(rows) - len(shown)
    rest = f"{hidden} more: ↑↓" if hidden else ""
    return [table, Text(rest, style=IDLE)]


def _title(column: Column, selection: Selection) -> Text:
    if not column.title or column.field != selection.sort:
        return Text(column.title)
    mark = "▲" if selection.reverse else "▼"
    return Text(f"{mark}{column.title}"[: column.width], style=ACCENT)


def _share(rows: dict[str, int], room: int) -> list[tuple[str, int]]:
    """Give each table the lines it needs, or a part of them in proportion where they are too few."""
    total = sum(rows.values())
    if total <= room:
        return list(rows.items())
    return [(name, max(_LEAST_ROWS, math.floor(room * n / total))) for name, n in rows.items()]


def _foot(view: View) -> Text:
    if view.typing is not None:
        return Text(f"filter: {view.typing}▏", style="bold", no_wrap=True)
    if view.complaint:
        return Text(view.complaint, style=ALARM, no_wrap=True, overflow="ellipsis")
    facts = [HELP]
    facts += [f"sorted by {view.selection.sort}"] if view.selection.sort else []
    facts += [f"filter {view.filtered}"] if view.filtered else []
    facts += ["PAUSED"] if view.paused else []
    return Text(SEPARATOR.join(reversed(facts)), style=IDLE, no_wrap=True, overflow="ellipsis")
