"""A user's own task for ``puma560``, read once, here; what passes can be relied on everywhere else.

    robot = "akb"                                  # or "p560", or a URDF file beside this one
    start_rad = [-0.3, 0.4, -0.18, 0.0, -0.05, 0.05]
    goal_rad = [0.51, -0.42, 0.58, 0.87, 0.64, 0.84]

    [limits]                                       # the robot's own where a key is left out
    torque_nm = [97.6, 186.4, 89.4, 24.2, 20.1, 21.3]
    velocity_rad_s = [1.92, 1.51, 2.4, 5.34, 5.09, inf]
    position_lower_rad = [-2.7, -3.9, -0.7, -1.9, -1.7, -4.6]
    position_upper_rad = [2.7, 0.7, 3.9, 2.9, 1.7, 4.6]

    [payload]
    mass_kg = 1.5
    centre_m = [0.0, 0.0, 0.1]                     # in the frame of the last link

    [objective]                                    # weights
    time = 1.0
    torque = 0.0
    end_velocity = 0.1

    [grid]
    segments = 16
    margin_levels = 2

Everything but start and goal may be left out; ``start`` and ``goal`` are taken for ``start_rad`` and ``goal_rad``.
"""

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, TypeAlias

from msgspec import Meta, Struct

from tramnet_master.errors import InvalidFile
from tramnet_master.strict_toml import read_strictly
from tramnet_master.wording import closest, spell
from tramnet_workers.errors import InvalidTask
from tramnet_workers.problems.motion_task import MotionTask, ObjectiveWeights
from tramnet_workers.robots.arm import InvalidArm, SerialArm
from tramnet_workers.robots.puma560 import akb, p560

ROBOTS = {"akb": akb, "p560": p560}

_Angles: TypeAlias = Annotated[list[float], Meta(description="one angle for each joint [rad]")]
_Torques: TypeAlias = Annotated[list[float], Meta(description="one torque for each joint [N m]")]
_Speeds: TypeAlias = Annotated[
    list[float], Meta(description="one speed for each joint [rad/s], inf for none")
]
_Mass: TypeAlias = Annotated[float, Meta(ge=0, description="a mass, at least 0 [kg]")]
_Point: TypeAlias = Annotated[
    tuple[float, float, float], Meta(description="3 numbers, a point in the last link's frame [m]")
]
_Weight: TypeAlias = Annotated[float, Meta(ge=0, description="a weight, at least 0")]
_Robot: TypeAlias = Annotated[str, Meta(description='"akb", "p560" or the path of a URDF file')]


class _Limits(Struct, frozen=True):
    torque_nm: _Torques | None = None
    velocity_rad_s: _Speeds | None = None
    position_lower_rad: _Angles | None = None
    position_upper_rad: _Angles | None = None


class _Payload(Struct, frozen=True):
    mass_kg: _Mass = 0.0
    centre_m: _Point = (0.0, 0.0, 0.0)


class _Objective(Struct, frozen=True):
    time: _Weight = 1.0
    torque: _Weight = 0.0
    end_velocity: _Weight = 0.1


class _Grid(Struct, frozen=True):
    segments: int = 16
    margin_levels: int = 0


class _TaskFile(Struct, frozen=True):
    start_rad: _Angles
    goal_rad: _Angles
    robot: _Robot = "akb"
    limits: _Limits = _Limits()
    payload: _Payload = _Payload()
    objective: _Objective = _Objective()
    grid: _Grid = _Grid()


# Names in a MotionTask, with those in the file.
_FIELDS = {
    "start": "start_rad",
    "goal": "goal_rad",
    "torque_limits": "limits.torque_nm",
    "velocity_limits": "limits.velocity_rad_s",
    "position_lower": "limits.position_lower_rad",
    "position_upper": "limits.position_upper_rad",
    "weights": "objective",
    "segments": "grid.segments",
    "margin_levels": "grid.margin_levels",
}
_NAMES_IN_PROSE = r"\b[a-z]+_[a-z]+\b"  # those of one word are words as well
_UNBOUNDED = ("limits.velocity_rad_s", "limits.position_lower_rad", "limits.position_upper_rad")


def read_motion_task(path: Path) -> MotionTask:
    """Read a task file of ``puma560``.

    Raises:
        InvalidFile: With the field that is wrong, what was found and what was expected.
    """
    aliases = {"start": "start_rad", "goal": "goal_rad"}
    file = read_strictly(path, _TaskFile, aliases, _UNBOUNDED)
    with _named_as_in(path):
        arm = _robot(path, file).with_payload(file.payload.mass_kg, file.payload.centre_m)
        return MotionTask.for_arm(
            arm,
            file.start_rad,
            file.goal_rad,
            torque_limits=file.limits.torque_nm,
            velocity_limits=file.limits.velocity_rad_s,
            position_lower=file.limits.position_lower_rad,
            position_upper=file.limits.position_upper_rad,
            weights=ObjectiveWeights(
                file.objective.time, file.objective.torque, file.objective.end_velocity
            ),
            segments=file.grid.segments,
            margin_levels=file.grid.margin_levels,
        )


def _robot(path: Path, file: _TaskFile) -> SerialArm:
    """The arm named, or that of a URDF file beside the task file."""
    if file.robot in ROBOTS:
        return ROBOTS[file.robot]()
    urdf = path.parent / file.robot
    if not urdf.is_file():
        meant = closest(file.robot, ROBOTS)
        hint = f'did you mean "{meant}"?' if meant else f"there is no file {urdf}"
        raise InvalidFile(path, "robot", spell(file.robot), '"akb", "p560" or a URDF file', hint)
    from tramnet_workers.robots.pinocchio_bridge import arm_from_urdf  # noqa: PLC0415  slow

    try:
        return arm_from_urdf(urdf)
    except InvalidArm as error:
        found = f"{spell(file.robot)}, which cannot be used ({error})"
        raise InvalidFile(path, "robot", found, "a serial arm of revolute joints") from error


@contextmanager
def _named_as_in(path: Path) -> Iterator[None]:
    """Give a task's complaint the names of the file."""
    try:
        yield
    except InvalidTask as error:
        field, expected = _renamed(error.field), _renamed(error.expected, _NAMES_IN_PROSE)
        raise InvalidFile(path, field, error.found, expected, _hint(error)) from error


def _renamed(text: str, names: str = r"^\w+") -> str:
    return re.sub(names, lambda name: _FIELDS.get(name[0], name[0]), text)


def _hint(error: InvalidTask) -> str:
    """Advice for the commonest mistake: angles in degrees."""
    if not error.field.startswith(("start[", "goal[")):
        return ""
    angle = float(error.found)
    if not 2 * math.pi < abs(angle) <= 720:
        return ""
    return f"angles are in radians: {angle:g} degrees are {math.radians(angle):.6g} rad"
