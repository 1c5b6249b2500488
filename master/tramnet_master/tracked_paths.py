"""A path that was followed, point by point: ``trajectory.csv`` in the run folder.

Of several scenes each has a file of its own, ``trajectory-<name>.csv``. Where there is no box, the cells of
``clearance_cm`` are empty, and ``nearest_link`` and ``nearest_box`` are 0.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tramnet_master.csv_tables import Column, read_table, write_table
from tramnet_master.errors import DamagedFile
from tramnet_master.run_folder import trajectory_file
from tramnet_master.trajectories import joined, numbered
from tramnet_workers.problems.tracking_report import report_points
from tramnet_workers.problems.tracking_task import TrackingTask

Array = NDArray[np.float64]

_ANGLES = "q{}_deg"
_PLACE = ("x_cm", "y_cm", "z_cm")
_CLEARANCE = "clearance_cm"


@dataclass(frozen=True, eq=False)
class TrackedPath:
    """What an arm did at each point of a path, the start included; N is the number of steps.

    Attributes:
        q: Joint angles, of shape (N + 1, n_joints) [deg].
        position: Where the tip was, of shape (N + 1, 3) [cm].
        error: Distance of the tip from the point, of shape (N + 1,) [cm].
        clearance: Distance between arm and boxes, of shape (N + 1,); NaN where there is no box [cm].
        nearest_link: Number of the link nearest to a box, of shape (N + 1,); 0 where there is none.
        nearest_box: Number of the box nearest to the arm, of shape (N + 1,); 0 where there is none.
        step: Largest change of a joint's angle since the point before, of shape (N + 1,) [deg].
    """

    q: Array
    position: Array
    error: Array
    clearance: Array
    nearest_link: NDArray[np.int64]
    nearest_box: NDArray[np.int64]
    step: Array

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return len(self.q) - 1

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read the file.

        Raises:
            DamagedFile: Columns are missing or a line is torn.
        """
        table = read_table(path, gaps=(_CLEARANCE,))
        needed = (*_PLACE, "error_cm", _CLEARANCE, "nearest_link", "nearest_box", "step_deg")
        for name in needed:
            if name not in table:
                raise DamagedFile(path, f"the columns {', '.join(table)}", name)
        return cls(
            q=joined(table, _ANGLES, path),
            position=np.column_stack([table[name] for name in _PLACE]),
            error=table["error_cm"],
            clearance=table[_CLEARANCE],
            nearest_link=table["nearest_link"].astype(np.int64),
            nearest_box=table["nearest_box"].astype(np.int64),
            step=table["step_deg"],
        )


def write_tracking(folder: Path, name: str, task: TrackingTask, path: Array) -> None:
    """Write what an arm did along a path.

    Args:
        folder: The run folder.
        name: Name of the scene, empty for the only one of a run.
        task: The task.
        path: Joint angles along it, of shape (n_steps + 1, n_joints) [rad].

    Raises:
        CannotWrite: The disk refuses.
    """
    found = report_points(task, path)
    columns: dict[str, Column] = {"k": np.arange(len(path))}
    columns |= numbered(_ANGLES, np.degrees(path))
    columns |= dict(zip(_PLACE, found.position.T, strict=True))
    columns["error_cm"] = found.error
    columns[_CLEARANCE] = np.where(np.isfinite(found.clearance), found.clearance, np.nan)
    columns["nearest_link"], columns["nearest_box"] = found.nearest_link, found.nearest_box
    columns["step_deg"] = np.degrees(found.step)
    write_table(folder / trajectory_file(name), columns, gaps=(_CLEARANCE,))
