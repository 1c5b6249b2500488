"""Tables as CSV files: one line of column names, then one line a row, floats in full.

Every float is written with the fewest digits that read back as the same float.
"""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tramnet_master.errors import DamagedFile
from tramnet_master.files import write_atomically

Column = NDArray[np.float64] | NDArray[np.int64]


def write_table(path: Path, columns: Mapping[str, Column]) -> None:
    """Write columns of equal length under their names, whole or not at all.

    Args:
        path: The file.
        columns: Columns of shape (rows,), in the order of the file.

    Raises:
        CannotWrite: The disk refuses.
    """
    lines = [",".join(columns)]
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines += [",".join(map(repr, row)) for row in rows]
    write_atomically(path, ("\n".join(lines) + "\n").encode())


def write_rows(path: Path, names: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write rows of words and numbers under the names of their columns, whole or not at all.

    Args:
        path: The file.
        names: Names of the columns.
        rows: The rows, each with a value for every name.

    Raises:
        CannotWrite: The disk refuses.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    for row in rows:
        assert len(row) == len(names)
        writer.writerow(row)
    write_atomically(path, text.getvalue().encode())


def read_table(path: Path) -> dict[str, NDArray[np.float64]]:
    """The columns of a table by name, each of shape (rows,), read-only.

    A last line without its end, as a killed process leaves it, is left out.

    Raises:
        DamagedFile: A line has another number of values than the first, or one is no number.
    """
    lines = complete_lines(path.read_text())
    if not lines:
        raise DamagedFile(path, "an empty file", "a line of column names")
    names = lines[0].split(",")
    try:
        rows = [[float(value) for value in line.split(",")] for line in lines[1:]]
        table = np.array(rows, dtype=np.float64).reshape(-1, len(names))
    except ValueError as error:
        raise DamagedFile(path, str(error), f"{len(names)} numbers on every line") from error
    if len(table) != len(rows):
        raise DamagedFile(path, "lines of other lengths", f"{len(names)} numbers on every line")
    table.setflags(write=False)
    return dict(zip(names, table.T, strict=True))


def complete_lines(text: str) -> list[str]:
    """The lines of ``text`` that have their end."""
    return text.split("\n")[:-1]
