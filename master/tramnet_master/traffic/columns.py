"""How the tables of ``tramnet inspect`` look in a terminal: fixed widths, so that nothing jumps every second.

Colours are the terminal's own, and none that fades on white or on black; a bar or a word says the same again.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rich.text import Text

from tramnet_master.traffic.rows import TramRow
from tramnet_master.traffic.words import printable

GAP = 2
"""Blanks between two columns."""

BUSY, BLOCKED, IDLE, ALARM, ACCENT = "green", "magenta", "dim", "bold red", "cyan"

_BAR = 12
_STATES = {"busy": BUSY, "idle": IDLE, "silent": ALARM, "waiting": BLOCKED, "building": BLOCKED}


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        field: Field of the row, to sort by.
        title: Its head.
        width: Its width.
        show: Its cell in a row.
        spare: Which columns give way first where there is little room: 0 never, 1 last.
        left: Whether its cells stand on the left.
    """

    field: str
    title: str
    width: int
    show: Callable[[Any], Text]
    spare: int = 0
    left: bool = False


def fitting(columns: tuple[Column, ...], width: int) -> list[Column]:
    """Return the columns that have room in a width."""
    kept = list(columns)
    while sum(column.width + GAP for column in kept) - GAP > width:
        first = max(kept, key=lambda column: column.spare)
        if not first.spare:
            break
        kept.remove(first)
    return kept


def count(value: float) -> Text:
    """A number with its thousands apart; zero is dim."""
    return Text(f"{value:,.0f}", style="" if value else IDLE)


def short(value: float) -> Text:
    """A rate in few digits; zero is dim."""
    digits = 0 if value >= 100 else 1
    return Text(f"{value:,.{digits}f}", style="" if value else IDLE)


def alarm(value: int) -> Text:
    """A number that should be zero."""
    return Text(f"{value:,}", style=ALARM if value else IDLE)


def name(value: str) -> Text:
    """A name from elsewhere."""
    return Text(printable(value))


def share(value: float, style: str = "") -> Text:
    """A share in percent."""
    return Text(f"{value:.0%}", style=style if value >= 0.005 else IDLE)


def _kilo(value: float) -> Text:
    return short(value / 1e3)


def _field(named: str, show: Callable[[Any], Text]) -> Callable[[Any], Text]:
    return lambda row: show(getattr(row, named))


def _state(row: TramRow) -> Text:
    return Text(printable(row.state), style=_STATES.get(row.state, ""))


def _activity(row: TramRow) -> Text:
    busy, blocked = round(row.busy * _BAR), round(row.blocked * _BAR)
    bar = Text("█" * busy, style=BUSY)
    bar.append("▒" * min(blocked, _BAR - busy), style=BLOCKED)
    return bar.append("·" * (_BAR - len(bar)), style=IDLE)


def _load(row: Any) -> Text:
    filled = min(_BAR, round(row.utilisation * _BAR))
    style = ALARM if row.utilisation > 1 else ACCENT
    return Text("█" * filled, style=style).append("·" * (_BAR - filled), style=IDLE)


def _plain(
    field: str,
    title: str,
    width: int,
    show: Callable[[Any], Text] = count,
    spare: int = 0,
    left: bool = False,
) -> Column:
    return Column(field, title, width, _field(field, show), spare, left)


_TRAFFIC = (
    _plain("frames", "frames", 10),
    _plain("frames_per_s", "frames/s", 9, short),
    _plain("bytes_per_s", "kB/s", 8, _kilo),
    _plain("mean_bytes", "mean B", 8),
)
_OF_LINK = (
    Column(
        "utilisation", "of 20 Mbd", 10, lambda row: Text(f"{row.utilisation:.1%}", style=ACCENT)
    ),
    Column("utilisation", "", _BAR, _load, spare=3, left=True),
)

TRAMS = (
    _plain("seat", "TRAM", 5),
    Column("state", "state", 8, _state, left=True),
    _plain("chunks", "chunks", 8),
    _plain("evaluations", "evaluated", 11),
    _plain("evaluations_per_s", "eval/s", 7, short),
    _plain("busy", "busy", 5, lambda value: share(value, BUSY)),
    _plain("idle", "idle", 5, lambda value: share(value, IDLE)),
    _plain("blocked", "blocked", 8, lambda value: share(value, BLOCKED)),
    _plain("queued", "queue", 6),
    Column("busy", "", _BAR, _activity, spare=3, left=True),
    _plain("pid", "pid", 7, lambda value: Text(f"{value}"), spare=4),
    _plain("host", "host", 14, name, spare=5, left=True),
)
LINKS = (
    _plain("link", "link", 14, name, left=True),
    *_TRAFFIC,
    *_OF_LINK,
    _plain("queued", "queue", 6),
    _plain("gaps", "gaps", 6, alarm, spare=1),
    _plain("dropped", "dropped", 8, alarm, spare=2),
)
TAGS = (
    _plain("tag", "message", 19, name, left=True),
    _plain("way", "way", 9, name, left=True),
    _plain("frames_per_generation", "per gen.", 8, lambda value: Text(f"{value:,.2f}")),
    _plain("frames", "frames", 9),
    _plain("frames_per_s", "frames/s", 9, short),
    _plain("bytes_per_s", "kB/s", 7, _kilo),
    _plain("mean_bytes", "mean B", 7, spare=1),
)
TOPICS = (
    _plain("link", "sniffed link", 14, name, left=True),
    *_TRAFFIC,
    *_OF_LINK,
    _plain("least_bytes", "least B", 8, spare=2),
    _plain("most_bytes", "most B", 8, spare=1),
    _plain("missed", "missed", 7, alarm),
)

COLUMNS = {"trams": TRAMS, "links": LINKS, "tags": TAGS, "topics": TOPICS}
