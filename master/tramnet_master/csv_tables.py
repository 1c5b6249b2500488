"""Tables as CSV files: one line of column names, then one line a row, floats in full.

Every float is written with the fewest digits that read back as the same float. A column may have gaps: cells that
are empty in the file and NaN in memory.
"""

import csv
import io
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tramnet_master.errors import DamagedFile
from tramnet_master.files import write_atomically

Column = NDArray[np.float64] | NDArray[np.int64]


def write_table(path: Path, columns: Mapping[str, Column], gaps: Collection[str] = ()) -> None:
    """Write columns of equal length under their names, whole or not at all.

    Args:
        path: The file.
        columns: Columns of shape (rows,), in the order of the file.
        gaps: Names of those in which a NaN is an empty cell.

    Raises:
        CannotWrite: The disk refuses.
    """
    lines = [",".join(columns)]
    cells = [_cells(column, name in gaps) for name, column in columns.items()]
    lines += [",".join(row) for row in zip(*cells, strict=True)]
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


def read_table(path: Path, gaps: Collection[str] = ()) -> dict[str, NDArray[np.float64]]:
    """The columns of a table by name, each of shape (rows,), read-only.

    A last line without its end, as a killed process leaves it, is left out.

    Args:
        path: The file.
        gaps: Names of the columns in which an empty cell is a NaN.

    Raises:
        DamagedFile: A line has another number of values than the first, or one is no number.
    """
    lines = complete_lines(path.read_text())
    if not lines:
        raise DamagedFile(path, "an empty file", "a line of column names")
    names = lines[0].split(",")
    try:
        rows = [_numbers(line, names, gaps) for line in lines[1:]]
        table = np.array(rows, dtype=np.float64).reshape(-1, len(names))
    except ValueError as error:
        raise DamagedFile(path, str(error), f"{len(names)} numbers on every line") from error
    if len(table) != len(rows):
        raise DamagedFile(path, "lines of other lengths", f"{len(names)} numbers on every line")
    table.setflags(write=False)
    return dict(zip(names, table.T, strict=True))


def _cells(column: Column, has_gaps: bool) -> list[str]:
    values = column.tolist()
    return ["" if has_gaps and math.isnan(value) else repr(value) for value in values]


def _numbers(line: str, names: list[str], gaps: Collection[str]) -> list[float]:
    cells = line.split(",")
    if not gaps or len(cells) != len(names):
        return [float(cell) for cell in cells]
    gap = ["nan" if name in gaps else "" for name in names]
    return [float(cell or empty) for cell, empty in zip(cells, gap, strict=True)]


def complete_lines(text: str) -> list[str]:
    """The lines of ``text`` that have their end."""
    return text.split("\n")[:-1]
