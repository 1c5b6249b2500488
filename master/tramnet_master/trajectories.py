"""A motion with its joint torques, sampled in time, and its files in the run folder."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tramnet_master.csv_tables import Column, read_table, write_table
from tramnet_master.errors import DamagedFile

Array = NDArray[np.float64]

_PATTERNS = {
    "q": "q{}_rad",
    "qd": "qd{}_rad_s",
    "qdd": "qdd{}_rad_s2",
    "tau": "tau{}_nm",
    "ratio": "ratio{}",
}


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Motion and torques of an arm of n joints at k times; read-only.

    Attributes:
        t: Times, of shape (k,) [s].
        q: Joint angles, of shape (k, n) [rad].
        qd: Joint velocities, of shape (k, n) [rad/s].
        qdd: Joint accelerations, of shape (k, n) [rad/s²].
        tau: Joint torques, of shape (k, n) [N m].
        ratio: Absolute torques over their limits, of shape (k, n).
    """

    t: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array
    ratio: Array

    def __post_init__(self) -> None:
        for field in fields(self):
            getattr(self, field.name).setflags(write=False)

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    def write(self, path: Path) -> None:
        """Write the file, whole or not at all.

        Raises:
            CannotWrite: The disk refuses.
        """
        columns: dict[str, Column] = {"t_s": self.t}
        for name, pattern in _PATTERNS.items():
            columns |= numbered(pattern, getattr(self, name))
        write_table(path, columns)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read the file.

        Raises:
            DamagedFile: Columns are missing or a line is torn.
        """
        table = read_table(path)
        arrays = {name: joined(table, pattern, path) for name, pattern in _PATTERNS.items()}
        return cls(t=times(table, path), **arrays)


def write_nodes(path: Path, t: Array, q: Array, qd: Array) -> None:
    """Write a plan's nodes: where its acceleration changes, or where its grid has them.

    Args:
        path: The file.
        t: Their times, of shape (nodes,) [s].
        q: Joint angles there, of shape (nodes, n) [rad].
        qd: Joint velocities there, of shape (nodes, n) [rad/s].

    Raises:
        CannotWrite: The disk refuses.
    """
    columns: dict[str, Column] = {"node": np.arange(len(t)), "t_s": t}
    write_table(path, columns | numbered("q{}_rad", q) | numbered("qd{}_rad_s", qd))


def numbered(pattern: str, array: Array) -> dict[str, Column]:
    """The columns of an array of shape (k, n) by name, numbered from 1."""
    return {pattern.format(i + 1): array[:, i] for i in range(array.shape[1])}


def joined(table: Mapping[str, Array], pattern: str, path: Path) -> Array:
    """The numbered columns of a table as an array of shape (k, n).

    Args:
        table: Columns of shape (k,) by name.
        pattern: Their names, with ``{}`` for the number.
        path: Where the table comes from, for messages.

    Raises:
        DamagedFile: There is not one of them.
    """
    assert "{}" in pattern, "names without a number never end"
    names = itertools.takewhile(table.__contains__, map(pattern.format, itertools.count(1)))
    columns = [table[name] for name in names]
    if not columns:
        raise DamagedFile(path, f"the columns {', '.join(table)}", pattern.format(1))
    return np.column_stack(columns)


def times(table: Mapping[str, Array], path: Path) -> Array:
    """The column of times of a table, of shape (k,) [s].

    Raises:
        DamagedFile: There is none.
    """
    if "t_s" not in table:
        raise DamagedFile(path, f"the columns {', '.join(table)}", "t_s")
    return table["t_s"]
