"""A stock of link modules, from which the prototype of a designed arm is built.

Kim & Khosla (1992), section 6: links are chosen from the stock of the RMMS "based on the result of the
first step". The stock that is shipped, ``stock.csv``, has modules of 0.10 to 0.80 m in steps of 0.05 m.
"""

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidTask

Floats = NDArray[np.float64]

#: As many modules as anybody needs.
UNLIMITED = 1_000_000

_CANDIDATES = 5  # nearest lengths tried for each link


@dataclass(frozen=True)
class Stock:
    """Link modules.

    Attributes:
        lengths: Lengths in stock, ascending [m].
        quantities: How many there are of each; UNLIMITED for as many as are needed.
    """

    lengths: tuple[float, ...]
    quantities: tuple[int, ...]

    def __post_init__(self) -> None:
        if not self.lengths:
            raise InvalidTask("stock", "no length", "one length at least")
        if len(self.quantities) != len(self.lengths):
            found = f"{len(self.quantities)} quantities for {len(self.lengths)} lengths"
            raise InvalidTask("stock", found, "as many quantities as lengths")
        for i, (length, quantity) in enumerate(zip(self.lengths, self.quantities, strict=True)):
            if not 0.0 < length < np.inf:
                raise InvalidTask(f"stock.lengths[{i}]", f"{length}", "a finite length above 0 m")
            if i and not length > self.lengths[i - 1]:
                expected = "lengths in ascending order, each once"
                raise InvalidTask(f"stock.lengths[{i}]", f"{length}", expected)
            if quantity < 0:
                raise InvalidTask(f"stock.quantities[{i}]", f"{quantity}", "0 or more")

    @classmethod
    def of_lengths(cls, lengths: Iterable[float]) -> "Stock":
        """Return a stock with as many modules of each length as are needed."""
        ordered = tuple(sorted({float(length) for length in lengths}))
        return cls(ordered, (UNLIMITED,) * len(ordered))

    @classmethod
    def from_csv(cls, text: str, name: str) -> "Stock":
        """Read a stock from the text of a CSV file.

        Args:
            text: Columns ``length_m`` and, if it has one, ``quantity``, left empty for any number.
            name: Name of the file, for complaints.

        Raises:
            InvalidTask: A column is missing or a cell is not what it should be.
        """
        reader = csv.DictReader(text.splitlines())
        if "length_m" not in (reader.fieldnames or ()):
            found = f"columns {', '.join(reader.fieldnames or ['none'])} in {name}"
            raise InvalidTask("stock.csv", found, "a column length_m, and quantity if you like")
        rows = [_read_row(f"stock.csv line {i}", row) for i, row in enumerate(reader, start=2)]
        rows.sort(key=lambda row: row[0])
        return cls(tuple(row[0] for row in rows), tuple(row[1] for row in rows))

    def choose(
        self, wanted: Floats, *, ordered: bool, reaches: Floats, strokes: Floats | None = None
    ) -> Floats:
        """Return the modules nearest to wanted lengths, of shape (n,) [m].

        Nearest is the least sum of differences among the combinations that do not exceed the
        quantities, keep inner links at least as long as outer ones if that is ``ordered``, and reach
        as near and far as needed. Where none does, the reach is given up first.

        Args:
            wanted: Wanted lengths, of shape (n,) [m].
            ordered: Whether a link may not be longer than the one before.
            reaches: Distances from the base that are to be reached, of shape (t,) [m].
            strokes: Longest extension of each link by prismatic joints, of shape (n,), None for
                none [m].

        Raises:
            InvalidTask: There are too few modules for so many links.
        """
        lengths, n = np.array(self.lengths), len(wanted)
        strokes = np.zeros(n) if strokes is None else strokes
        nearest = [np.argsort(abs(lengths - x), kind="stable").tolist() for x in wanted]
        for width in (_CANDIDATES, len(lengths)):
            rows = [row for row in product(*(near[:width] for near in nearest)) if self._holds(row)]
            if rows:
                arms = [lengths[list(row)] for row in rows]
                return min(arms, key=lambda arm: _misfit(arm, wanted, ordered, reaches, strokes))
        raise InvalidTask("stock", f"{sum(self.quantities)} modules", f"modules for {n} links")

    def _holds(self, row: tuple[int, ...]) -> bool:
        return all(row.count(i) <= self.quantities[i] for i in set(row))


def shipped_stock() -> Stock:
    """Return the stock that comes with the package."""
    text = files("tramnet_workers.problems").joinpath("stock.csv").read_text("utf-8")
    return Stock.from_csv(text, "stock.csv")


def _read_row(field: str, row: dict[str, str]) -> tuple[float, int]:
    try:
        length = float(row["length_m"])
    except (TypeError, ValueError):
        raise InvalidTask(f"{field}, length_m", repr(row["length_m"]), "a number") from None
    quantity = (row.get("quantity") or "").strip()
    if quantity and not quantity.isdigit():
        raise InvalidTask(f"{field}, quantity", repr(quantity), "a whole number, or nothing")
    return length, int(quantity) if quantity else UNLIMITED


def _misfit(
    arm: Floats, wanted: Floats, ordered: bool, distances: Floats, strokes: Floats
) -> tuple[bool, bool, float, tuple[float, ...]]:
    """Return how badly an arm fits; what is compared first weighs most."""
    unordered = ordered and bool((np.diff(arm) > 0.0).any())
    misses = not _reaches(arm, distances, strokes)
    return unordered, misses, float(abs(arm - wanted).sum()), tuple(arm)


def _reaches(lengths: Floats, distances: Floats, strokes: Floats) -> bool:
    """Return whether an arm with its strokes drawn in or out reaches as far and near as needed."""
    others = lengths.sum() - lengths + strokes.sum() - strokes
    farthest, nearest = lengths.sum() + strokes.sum(), (lengths - others).max()
    return bool(distances.max() <= farthest and distances.min() >= nearest)
