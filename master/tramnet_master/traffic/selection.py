"""Which rows of the tables are shown, and in which order: ``--filter`` and ``--sort``, in words.

A filter is words with spaces between; a row is shown if all hold. ``COLUMN OP VALUE``, written without spaces,
compares a column: ``busy>50%``, ``state=idle``, ``bytes_per_s>=1e6``, ``link!=link/0/*``. ``tram=3`` holds for
TRAM 3 and the links at either end of it. Any other word is looked for in names: ``link/0``, a host, a tag. Tables
that lack a column are not filtered by it.
"""

import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TypeVar

from tramnet_master.errors import InvalidOption
from tramnet_master.traffic.rows import TABLES, Row

_Row = TypeVar("_Row", bound=Row)

COLUMNS = frozenset(name for table in TABLES.values() for name in table.__struct_fields__)
TRAM = "tram"
_ENDS = ("seat", "source", "destination")

_NAMES_OF_THINGS = frozenset(("seat", "incarnation", "pid", "source", "destination"))
_COMPARE: Mapping[str, Callable[[float, float], bool]] = {
    "<=": operator.le, ">=": operator.ge, "!=": operator.ne,
    "=": operator.eq, "<": operator.lt, ">": operator.gt,
}  # fmt: skip
_TERM = re.compile(r"(?P<column>[a-z_]+)(?P<sign><=|>=|!=|==?|<|>)(?P<value>\S+)")
_SIZES = {"%": 0.01, "k": 1e3, "M": 1e6, "G": 1e9}


@dataclass(frozen=True)
class Term:
    """One word of a filter.

    Attributes:
        column: A column, ``tram``, or an empty string for any name.
        sign: How to compare.
        value: What with.
    """

    column: str
    sign: str
    value: str

    def holds(self, row: Row) -> bool:
        """Return whether a row passes; one that lacks the column does."""
        found = _values_of(row, self.column)
        if not found:
            return bool(self.column)
        if self.sign == "!=":
            return all(self._compare(value) for value in found)
        return any(self._compare(value) for value in found)

    def _compare(self, found: object) -> bool:
        if isinstance(found, str):
            pattern = self.value if self.column else f"*{self.value}*"
            return fnmatchcase(found, pattern) is (self.sign != "!=")
        assert isinstance(found, int | float), "columns are names and numbers"
        number = _number(self.value)
        return number is not None and _COMPARE[self.sign](found, number)


@dataclass(frozen=True)
class Selection:
    """What to show of the tables.

    Attributes:
        terms: Words of the filter.
        sort: Column to sort by, or an empty string for the natural order.
        reverse: Whether to turn the order round: numbers come largest first otherwise, names smallest first.
    """

    terms: tuple[Term, ...] = ()
    sort: str = ""
    reverse: bool = False

    def of(self, rows: Iterable[_Row]) -> list[_Row]:
        """Return the rows to show, in order."""
        kept = [row for row in rows if all(term.holds(row) for term in self.terms)]
        if not kept or self.sort not in kept[0].__struct_fields__:
            return kept
        first = getattr(kept[0], self.sort)
        falling = not isinstance(first, str) and self.sort not in _NAMES_OF_THINGS
        return sorted(
            kept, key=lambda row: getattr(row, self.sort), reverse=falling is not self.reverse
        )


EVERYTHING = Selection()


def parse_filter(text: str) -> tuple[Term, ...]:
    """Take a filter apart.

    Raises:
        InvalidOption: It names a column that no table has, or compares one in a way that cannot be.
    """
    return tuple(_parse_word(word) for word in text.split())


def parse_sort(column: str) -> str:
    """Return a column to sort by.

    Raises:
        InvalidOption: No table has it.
    """
    if column and column not in COLUMNS:
        raise InvalidOption("--sort", repr(column), f"one of {', '.join(sorted(COLUMNS))}")
    return column


def _parse_word(word: str) -> Term:
    match = _TERM.fullmatch(word)
    if match is None:
        return Term("", "=", word)
    column, sign, value = match["column"], match["sign"].replace("==", "="), match["value"]
    if column not in COLUMNS and column != TRAM:
        known = ", ".join(sorted({*COLUMNS, TRAM}))
        raise InvalidOption("--filter", repr(word), f"a comparison of one of {known}")
    if sign not in ("=", "!=") and _number(value) is None:
        raise InvalidOption("--filter", repr(word), "a number to compare with, 12, 50% or 1.5k")
    return Term(column, sign, value)


def _number(text: str) -> float | None:
    size = _SIZES.get(text[-1])
    try:
        return float(text[:-1]) * size if size else float(text)
    except ValueError:
        return None


def _values_of(row: Row, column: str) -> list[object]:
    if column == TRAM:
        return [getattr(row, end) for end in _ENDS if end in row.__struct_fields__]
    if column:
        return [getattr(row, column)] if column in row.__struct_fields__ else []
    return [value for name in row.__struct_fields__ if isinstance(value := getattr(row, name), str)]
