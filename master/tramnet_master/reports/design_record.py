"""A finished design as the reports see it: the files of its folder, read once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Self

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from tramnet_master.csv_tables import read_table
from tramnet_master.errors import DamagedFile
from tramnet_master.populations import Populations, read_populations
from tramnet_master.reports.findings import Findings
from tramnet_master.run_folder import DESIGN, MOTION, POPULATIONS
from tramnet_master.trajectories import joined

Floats = NDArray[np.float64]

_CIRCLE_POINTS = 181


class DesignPath(Struct, frozen=True):
    """The path of the tip: a circle, or straight lines between vertices."""

    kind: str
    centre_m: list[float] = []
    radius_m: float = 0.0
    vertices_m: list[list[float]] = []
    closed: bool = True

    def line(self) -> Floats:
        """Points along the path, of shape (k, 2) or (k, 3) [m]."""
        if self.kind == "circle":
            turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_POINTS)
            around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
            return np.array(self.centre_m) + self.radius_m * around
        ends = self.vertices_m[:1] if self.closed else []
        return np.array(self.vertices_m + ends)


class MotionToNext(Struct, frozen=True):
    """What was checked on the way from a station to the next one."""

    step_max_rad: float | None
    limit_excess_rad: float | None
    inside_boxes_m: float | None
    tracking_error_m: float | None
    end_error_rad: float | None


class DesignPoint(Struct, frozen=True):
    """The arm at a station; keys as in ``problems.design_report``."""

    station: float
    task_point: bool
    point_m: list[float]
    base_m: list[float]
    pose_rad: list[float]
    dexterity: float | None
    constraints: dict[str, float | None]
    fails: list[str]
    strokes_m: list[float] = []
    to_next: MotionToNext | None = None


class DesignViolation(Struct, frozen=True):
    """A limit that is not kept."""

    constraint: str
    stations: list[float]
    found: float | None
    limit: float


class DesignFile(Struct, frozen=True):
    """What ``design.json`` says."""

    arm: str
    link_lengths_m: list[float]
    lower_rad: list[float]
    upper_rad: list[float]
    path: DesignPath
    points: list[DesignPoint]
    violations: list[DesignViolation]
    boxes_m: list[list[float]] = []
    prismatic_links: list[int] = []
    rows: list[list[float]] = []

    @property
    def spatial(self) -> bool:
        """Whether the arm is a spatial one."""
        return self.arm == "spatial"

    @property
    def task_points(self) -> list[DesignPoint]:
        """The stations that are task points."""
        return [point for point in self.points if point.task_point]


@dataclass(frozen=True, eq=False)
class Motion:
    """Joint motion along the path; each interval begins where its station is.

    Attributes:
        intervals: Number of the interval of each row, of shape (k,).
        stations: Path parameters, of shape (k,).
        q: Joint angles, of shape (k, n) [rad].
        null: Lengths of steps in the null space, of shape (k,) [rad].
    """

    intervals: Floats
    stations: Floats
    q: Floats
    null: Floats


@dataclass(frozen=True, eq=False)
class DesignRecord:
    """Everything a design's run folder holds that a picture can show.

    Attributes:
        found: What ``result.json`` says.
        design: What ``design.json`` says.
        searches: How populations evolved, search by search; empty for a method without any.
        motion: Motion along the path, None where none was planned.
    """

    found: Findings
    design: DesignFile
    searches: list[Populations]
    motion: Motion | None

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Read a run folder.

        Raises:
            NotARunFolder: There is no finished run in it.
            DamagedFile: A file of it is torn.
        """
        return cls(
            found=Findings.read(folder),
            design=read_design(folder / DESIGN),
            searches=_searches(folder / POPULATIONS),
            motion=_motion(folder / MOTION),
        )

    def last_round(self) -> list[Populations]:
        """The searches since step 1 was last gone back to."""
        most = max((search.returns for search in self.searches), default=0)
        return [search for search in self.searches if search.returns == most]


def read_design(path: Path) -> DesignFile:
    """Read a ``design.json``.

    Raises:
        DamagedFile: It is torn or altered.
    """
    try:
        return msgspec.json.decode(path.read_bytes(), type=DesignFile)
    except msgspec.MsgspecError as error:
        raise DamagedFile(path, str(error), "a design as tramnet wrote it") from error


def _searches(path: Path) -> list[Populations]:
    return read_populations(path) if path.is_file() else []


def _motion(path: Path) -> Motion | None:
    if not path.is_file():
        return None
    table = read_table(path)
    missing = {"interval", "station", "null_rad"} - set(table)
    if missing:
        raise DamagedFile(path, f"no column {min(missing)}", "a motion as tramnet wrote it")
    q = joined(table, "q{}_rad", path)
    return Motion(table["interval"], table["station"], q, table["null_rad"])
