"""What keys do in the live view of ``tramnet inspect``: a pure function from one state of the view to the next."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from tramnet_master.errors import InvalidOption
from tramnet_master.traffic.columns import COLUMNS
from tramnet_master.traffic.selection import EVERYTHING, Selection, parse_filter

PAGE = 10
"""Rows that a page key scrolls."""

HELP = "q quit  tab tables  s/S sort  r reverse  / filter  c clear  ↑↓ scroll  p pause"


@dataclass(frozen=True)
class View:
    """What the live view shows of a network.

    Attributes:
        tables: Names of the tables shown.
        selection: Which rows, in which order.
        filtered: The filter in words.
        choices: What the tab key goes through.
        offset: Rows scrolled past.
        paused: Whether it stands still.
        typing: The filter being typed, or None.
        complaint: What was wrong with the last key.
        ended: Whether to end.
    """

    tables: tuple[str, ...]
    selection: Selection = EVERYTHING
    filtered: str = ""
    choices: tuple[tuple[str, ...], ...] = ()
    offset: int = 0
    paused: bool = False
    typing: str | None = None
    complaint: str = ""
    ended: bool = False

    @property
    def sortable(self) -> list[str]:
        """Columns that a table shown can be sorted by."""
        return list(
            dict.fromkeys(column.field for table in self.tables for column in COLUMNS[table])
        )


def press(view: View, key: str) -> View:
    """Return the view after a key was pressed; a key without a meaning changes nothing."""
    if view.typing is not None:
        return _type(replace(view, complaint=""), view.typing, key)
    change = _KEYS.get(key)
    return change(replace(view, complaint="")) if change else view


def _type(view: View, typed: str, key: str) -> View:
    if key == "enter":
        try:
            terms = parse_filter(typed)
        except InvalidOption as error:
            return replace(view, typing=None, complaint=f"no such filter: {error}")
        selection = replace(view.selection, terms=terms)
        return replace(view, typing=None, filtered=typed, selection=selection, offset=0)
    if key == "escape":
        return replace(view, typing=None)
    if key == "backspace":
        return replace(view, typing=typed[:-1])
    return replace(view, typing=typed + key) if len(key) == 1 and key.isprintable() else view


def _sort(view: View, step: int) -> View:
    order = ["", *view.sortable]
    here = order.index(view.selection.sort) if view.selection.sort in order else 0
    sort = order[(here + step) % len(order)]
    return replace(view, selection=replace(view.selection, sort=sort, reverse=False))


def _reverse(view: View) -> View:
    return replace(view, selection=replace(view.selection, reverse=not view.selection.reverse))


def _next_tables(view: View) -> View:
    here = view.choices.index(view.tables) if view.tables in view.choices else -1
    return replace(view, tables=view.choices[(here + 1) % len(view.choices)], offset=0)


def _scroll(view: View, rows: int) -> View:
    return replace(view, offset=max(0, view.offset + rows))


_KEYS: Mapping[str, Callable[[View], View]] = {
    "q": lambda view: replace(view, ended=True),
    "tab": _next_tables,
    "s": lambda view: _sort(view, 1),
    "S": lambda view: _sort(view, -1),
    "r": _reverse,
    "/": lambda view: replace(view, typing=view.filtered),
    "c": lambda view: replace(
        view, filtered="", selection=replace(view.selection, terms=()), offset=0
    ),
    "p": lambda view: replace(view, paused=not view.paused),
    "up": lambda view: _scroll(view, -1),
    "down": lambda view: _scroll(view, 1),
    "page up": lambda view: _scroll(view, -PAGE),
    "page down": lambda view: _scroll(view, PAGE),
    "home": lambda view: replace(view, offset=0),
}
