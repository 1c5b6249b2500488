"""``history.csv``: one row a generation, the time column last.

Rows are buffered, since a run may make a thousand a second, and forced to the disk before each checkpoint. So the
file of a killed run reaches at least as far as its last checkpoint, and a resume cuts it back to there: whatever
happens, a finished run's history is that of an undisturbed one, but for its time column.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from tramnet_master.csv_tables import complete_lines
from tramnet_master.engines.engine import GenerationRow
from tramnet_master.errors import DamagedFile
from tramnet_master.files import write_atomically, writing

COLUMNS = (*GenerationRow._fields, "elapsed_s")

_BUFFER = 1 << 16
_HEAD = (",".join(COLUMNS) + "\n").encode()


class History:
    """The open ``history.csv`` of a run that is under way.

    Attributes:
        path: The file.
    """

    def __init__(self, path: Path, generation: int = 0) -> None:
        """Begin a history, or go on with the one that is there.

        Args:
            path: The file.
            generation: Generations already done; later rows are cut off.

        Raises:
            CannotWrite: The disk refuses.
            DamagedFile: The file does not reach as far as ``generation``.
        """
        self.path = path
        if generation == 0:
            write_atomically(path, _HEAD)
        else:
            cut_back(path, generation)
        with writing(path):
            self._file = path.open("a", buffering=_BUFFER, encoding="ascii", newline="")

    def append(self, rows: Sequence[GenerationRow], elapsed: float) -> None:
        """Add the rows of generations that were completed at once.

        Args:
            rows: The next generations.
            elapsed: Since the run began, the time before a resume included [s].
        """
        end = f",{float(elapsed):.6f}\n"
        with writing(self.path):
            self._file.write("".join([_line(row) + end for row in rows]))

    def flush(self) -> None:
        """Force all rows to the disk; done before a checkpoint is written."""
        with writing(self.path):
            self._file.flush()
            os.fsync(self._file.fileno())

    def go_back(self, generation: int) -> None:
        """Drop the rows after a generation, and go on from there."""
        self.close()
        if generation:
            cut_back(self.path, generation)
        else:
            write_atomically(self.path, _HEAD)
        with writing(self.path):
            self._file = self.path.open("a", buffering=_BUFFER, encoding="ascii", newline="")

    def close(self) -> None:
        """Force all rows to the disk and let go of the file."""
        if self._file.closed:
            return
        with writing(self.path), self._file:
            self.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _line(row: GenerationRow) -> str:
    generation, evaluations, *objectives = row
    return f"{generation},{evaluations},{','.join(map(repr, map(float, objectives)))}"


def cut_back(path: Path, generation: int) -> None:
    """Drop the rows after ``generation``, and a last one that is not whole.

    Raises:
        CannotWrite: The disk refuses.
        DamagedFile: The file is missing, is no history or does not reach that far.
    """
    expected = f"the rows of generations 1 to {generation}"
    if not path.exists():
        raise DamagedFile(path, "no such file", expected)
    head, *rows = complete_lines(path.read_text(encoding="ascii", errors="replace")) or [""]
    if head != ",".join(COLUMNS):
        raise DamagedFile(path, f"the columns {head!r}", ",".join(COLUMNS))
    kept = rows[:generation]
    if [row.partition(",")[0] for row in kept] != [str(g + 1) for g in range(generation)]:
        raise DamagedFile(path, f"{len(kept)} rows", expected)
    write_atomically(path, ("\n".join([head, *kept]) + "\n").encode())
