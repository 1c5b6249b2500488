"""A finished run as the reports see it: the files of its folder, read once."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tramnet_master.csv_tables import read_table
from tramnet_master.reports.findings import Findings
from tramnet_master.run_folder import HISTORY, NODES, STRAIGHT_LINE, TRAJECTORY
from tramnet_master.trajectories import Trajectory, joined, times

Array = NDArray[np.float64]

_SERVO = re.compile(r"servo-(?P<period>[\d.]+)ms\.csv")


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes of a plan.

    Attributes:
        t: Their times, of shape (k,) [s].
        q: Joint angles there, of shape (k, n) [rad].
    """

    t: Array
    q: Array


@dataclass(frozen=True, eq=False)
class RunRecord:
    """Everything a run folder holds that a picture can show; what a run lacks is None or empty.

    Attributes:
        folder: The folder.
        found: What ``result.json`` says.
        history: Columns of ``history.csv``.
        plan: The plan that was found.
        straight_line: The straight line, timed optimally.
        nodes: The plan's nodes.
        servos: Files of replays through a servo, by period of the set-points [ms].
    """

    folder: Path
    found: Findings
    history: dict[str, Array]
    plan: Trajectory | None
    straight_line: Trajectory | None
    nodes: Nodes | None
    servos: dict[float, Path]

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Read a run folder.

        Raises:
            NotARunFolder: There is no finished run in it.
            DamagedFile: A file of it is torn.
        """
        return cls(
            folder=folder,
            found=Findings.read(folder),
            history=read_table(folder / HISTORY),
            plan=_trajectory(folder / TRAJECTORY),
            straight_line=_trajectory(folder / STRAIGHT_LINE),
            nodes=_nodes(folder / NODES),
            servos=_servos(folder),
        )


def _trajectory(path: Path) -> Trajectory | None:
    return Trajectory.read(path) if path.is_file() else None


def _nodes(path: Path) -> Nodes | None:
    if not path.is_file():
        return None
    table = read_table(path)
    return Nodes(times(table, path), joined(table, "q{}_rad", path))


def _servos(folder: Path) -> dict[float, Path]:
    names = ((path, _SERVO.fullmatch(path.name)) for path in sorted(folder.glob("servo-*ms.csv")))
    return {float(name["period"]): path for path, name in names if name}
