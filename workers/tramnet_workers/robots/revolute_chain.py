"""Serial arms of revolute joints as rows of the standard Denavit-Hartenberg convention.

T = Rz(theta) Tz(d) Tx(a) Rx(alpha). The link lengths of a template may be what a design is to find.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Literal

from tramnet_workers.robots.urdf import UrdfJoint, chain_urdf


@dataclass(frozen=True)
class ChainRow:
    """A joint with the link that follows it.

    Attributes:
        a: Offset along x [m].
        d: Offset along z [m].
        alpha: Twist about x [rad].
        designed: ``"a"`` or ``"d"`` if that length is to be designed, or nothing.
        lower: Smallest joint angle [rad].
        upper: Largest joint angle [rad].
    """

    a: float
    d: float
    alpha: float
    designed: Literal["", "a", "d"] = ""
    lower: float = -pi
    upper: float = pi


def six_joint_template() -> tuple[ChainRow, ...]:
    """Return an arm of the usual build: shoulder, elbow and spherical wrist, two links to be designed.

    The upper arm is a of joint 2, the forearm d of joint 4; the hand is 0.1 m long.
    """
    return (
        ChainRow(0.0, 0.0, -pi / 2),
        ChainRow(0.4, 0.0, 0.0, "a"),
        ChainRow(0.0, 0.0, pi / 2),
        ChainRow(0.0, 0.4, -pi / 2, "d"),
        ChainRow(0.0, 0.0, pi / 2, lower=-2.0, upper=2.0),
        ChainRow(0.0, 0.1, 0.0),
    )


def chain_urdf_of(
    rows: Sequence[ChainRow], lengths: Sequence[float], base: tuple[float, float, float], name: str
) -> str:
    """Return an arm with its designed lengths as URDF text.

    Args:
        rows: Template of the arm.
        lengths: Designed lengths in the order of the rows [m].
        base: Position of the first joint's frame [m].
        name: What the file calls the arm.
    """
    joints: list[UrdfJoint] = []
    offset, roll = base, 0.0
    for i, row in enumerate(with_lengths(rows, lengths)):
        joints.append(UrdfJoint(f"joint{i + 1}", "revolute", offset, roll, row.lower, row.upper))
        offset, roll = (row.a, 0.0, row.d), row.alpha
    return chain_urdf(name, [*joints, UrdfJoint("mount", "fixed", offset, roll)])


def with_lengths(rows: Sequence[ChainRow], lengths: Sequence[float]) -> tuple[ChainRow, ...]:
    """Return the rows of a template with its designed lengths put in."""
    left = list(lengths)
    found = []
    for row in rows:
        if row.designed == "a":
            found.append(replace(row, a=left.pop(0)))
        elif row.designed == "d":
            found.append(replace(row, d=left.pop(0)))
        else:
            found.append(row)
    return tuple(found)
