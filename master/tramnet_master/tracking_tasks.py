"""Tracking tasks from the tables of a file, with complaints that name fields as they stand in it."""

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tramnet_master.errors import InvalidFile
from tramnet_master.tracking_tables import TaskTables, build_arm, build_path
from tramnet_workers.errors import InvalidTask
from tramnet_workers.problems.start_posture import find_start
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.redundant8 import START_DEGREES, TOP_PLANE

Array = NDArray[np.float64]

# Names in a TrackingTask, with those in the file.
_FIELDS = {
    "start": "start_deg",
    "boxes": "box",
    "step": "limits.step_deg",
    "zone": "limits.zone_cm",
    "radius": "arm.radius_cm",
    "error_weight": "weights.error",
    "clearance_weight": "weights.clearance",
}

_PAPER_STEP = 0.5  # [deg]
_BENT = 20.0  # of each joint, where a search for a start begins: straight arms are singular [deg]
_PLACES = 3  # decimals of a start that is proposed; 0.01 mm at the tip of a long arm

_NUMBER = r"-?(?:inf|\d[\d.]*(?:e[-+]?\d+)?)"
_ANGLE = re.compile(rf"({_NUMBER}) rad|\[({_NUMBER}), ({_NUMBER})\] rad")
_POINT = re.compile(r"path\[(\d+)\]")


@dataclass(frozen=True)
class Names:
    """What fields are called where they stand in the file.

    Attributes:
        prefix: What stands before the names of a scene's own fields, ``scene[2].`` for one.
        own: Dotted names of the fields that the scene has itself; the others are those of all.
    """

    prefix: str = ""
    own: frozenset[str] = frozenset()

    def __call__(self, field: str) -> str:
        """Name of a field in the file."""
        return f"{self.prefix if field in self.own else ''}{field}"


@dataclass(frozen=True)
class TaskBuilder:
    """A task in the making; what the tables leave out is the paper's.

    Attributes:
        file: Where the tables come from.
        tables: The tables.
        names: What fields are called there.
    """

    file: Path
    tables: TaskTables
    names: Names = Names()

    def build(self) -> TrackingTask:
        """The task.

        Raises:
            InvalidFile: With the field that is wrong, what was found and what was expected.
        """
        limits, weights = self.tables.limits, self.tables.weights
        with self._named_as_in_the_file():
            return TrackingTask.for_arm(
                self.arm,
                np.radians(self.start),
                self.path,
                boxes=self.boxes,
                step=np.radians(_PAPER_STEP if limits.step_deg is None else limits.step_deg),
                zone=0.1 if limits.zone_cm is None else limits.zone_cm,
                radius=self.tables.arm.radius_cm or 0.0,
                error_weight=1.0 if weights.error is None else weights.error,
                clearance_weight=weights.clearance,
            )

    @cached_property
    def arm(self) -> SerialArm:
        """The arm."""
        return build_arm(self.file, self.tables.arm)

    @cached_property
    def path(self) -> Array:
        """The points, of shape (steps + 1, 3) [cm]."""
        return build_path(self.file, self.tables.path, self._path_field.rpartition(".")[0])

    @cached_property
    def boxes(self) -> Array:
        """The boxes, of shape (n, 6) [cm]."""
        if self.tables.box is None:
            return np.array([TOP_PLANE])
        rows = [(*box.lower_cm, *box.upper_cm) for box in self.tables.box]
        return np.array(rows, dtype=np.float64).reshape(-1, 6)

    @property
    def start(self) -> list[float]:
        """Joint angles at the start [deg]."""
        if self.tables.start_deg is not None:
            return self.tables.start_deg
        n = self.arm.n_joints
        if n == len(START_DEGREES):
            return list(START_DEGREES)
        expected = f"{n} angles, one for each joint [deg]"
        near = np.full(n, _BENT)
        raise InvalidFile(self.file, "start_deg", "nothing", expected, self._proposal(near))

    @property
    def _path_field(self) -> str:
        given = (
            k for k in ("csv", "points_cm", "steps") if getattr(self.tables.path, k) is not None
        )
        return self.names(f"path.{next(given, 'points_cm')}")

    @contextmanager
    def _named_as_in_the_file(self) -> Iterator[None]:
        try:
            yield
        except InvalidTask as error:
            found, expected = _in_degrees(error.found), _in_degrees(error.expected)
            point = _POINT.fullmatch(error.field)
            if point:
                found = f"point {point[1]} of {len(self.path) - 1} at {found}"
            field = self._field(error.field)
            raise InvalidFile(self.file, field, found, expected, self._hint(error)) from error

    def _field(self, name: str) -> str:
        """A name of a TrackingTask, perhaps with indices, in that of the file."""
        root, bracket, index = name.partition("[")
        if root == "arm":
            return "arm.dh" if self.tables.arm.urdf is None else "arm.urdf"
        if root in ("path", "points"):
            return self._path_field
        if root == "step" and not isinstance(self.tables.limits.step_deg, list):
            return self.names(_FIELDS[root])  # one for all joints
        return f"{self.names(_FIELDS[root])}{bracket}{index}"

    def _hint(self, error: InvalidTask) -> str:
        """What would work in place of a start that does not."""
        if error.field != "start":
            return ""
        if len(self.start) == self.arm.n_joints:
            return self._proposal(np.array(self.start))
        fixed = self.tables.arm.fixed_rows
        if self.tables.arm.dh is not None and fixed is None:
            return "row 0 of arm.dh is taken for one without a joint unless fixed_rows = []"
        return ""

    def _proposal(self, near: Array) -> str:
        """A start that would do, near some joint angles [deg], in words."""
        found = find_start(self.arm, np.radians(near), self.path[0], self.boxes)
        if found is None:
            return "no posture was found with the tip there: is it within reach?"
        angles = np.round(np.degrees(found), _PLACES) + 0.0
        return f"start_deg = {angles.tolist()} puts the tip there"


def _in_degrees(text: str) -> str:
    """A complaint with its radians in degrees."""

    def converted(found: re.Match[str]) -> str:
        angle, lower, upper = (
            number and f"{math.degrees(float(number)):.6g}" for number in found.groups()
        )
        return f"{angle} deg" if angle else f"[{lower}, {upper}] deg"

    return _ANGLE.sub(converted, text)
