"""CSV files that a user's task file names: read as text, or as columns of numbers."""

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from tramnet_master.errors import InvalidFile
from tramnet_master.wording import spell

LARGEST_FILE = 1 << 24  # 100,000 points with all their digits [B]


def read_beside(task_file: Path, field: str, name: str) -> tuple[Path, str]:
    """Path and text of a file that a task file names, relative to its own folder.

    Args:
        task_file: The task file.
        field: Field that names the other one, for complaints.
        name: What stands there.

    Raises:
        InvalidFile: The file is missing, unreadable, too large or no text.
    """
    path = task_file.parent / name
    try:
        size = path.stat().st_size
        content = path.read_bytes() if size <= LARGEST_FILE else b""
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        found, hint = f"{spell(name)}: {reason.lower()}", f"looked for {path}"
        raise InvalidFile(task_file, field, found, "a CSV file that can be read", hint) from error
    if size > LARGEST_FILE:
        found = f"{spell(name)} of {size} bytes"
        raise InvalidFile(task_file, field, found, f"a file of at most {LARGEST_FILE}")
    try:
        return path, content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        found = f"{spell(name)}, no text ({error})"
        raise InvalidFile(task_file, field, found, "UTF-8") from error


def read_columns(path: Path, text: str, names: Sequence[str]) -> list[tuple[float, ...]]:
    """Rows of the named columns of a CSV text; other columns are left alone.

    Raises:
        InvalidFile: A column is missing, or a cell is no finite number.
    """
    reader = csv.DictReader(text.splitlines())
    try:
        found = reader.fieldnames or ()
        missing = [name for name in names if name not in found]
        if missing:
            columns = f"columns {', '.join(found)}" if found else "no line of column names"
            raise InvalidFile(path, "", columns, f"columns {', '.join(names)}")
        return [tuple(_number(path, reader.line_num, name, row[name]) for name in names)
                for row in reader]  # fmt: skip
    except csv.Error as error:
        raise InvalidFile(path, f"line {reader.line_num}", str(error), "CSV") from error


def _number(path: Path, line: int, name: str, cell: str | None) -> float:
    try:
        value = float(cell or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        found = "nothing" if not (cell or "").strip() else spell(cell)
        raise InvalidFile(path, f"line {line}, {name}", found, "a finite number")
    return value
