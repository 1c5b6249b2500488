"""Planar arms as a design ends with them: lengths, base and limits, as D-H table and as URDF."""

from dataclasses import dataclass
from typing import NamedTuple

from tramnet_workers.robots.urdf import UrdfJoint, X, Y, chain_urdf


class DhRow(NamedTuple):
    """A row of a standard Denavit-Hartenberg table; theta is the joint variable.

    Attributes:
        joint: Name of the joint.
        d: Offset along z [m].
        a: Offset along x, without stroke [m].
        alpha: Twist about x [rad].
        stroke: By how much a prismatic joint can lengthen a [m].
    """

    joint: str
    d: float
    a: float
    alpha: float
    stroke: float


@dataclass(frozen=True)
class PlanarArm:
    """A planar arm of revolute joints, some of whose links prismatic joints may extend.

    Attributes:
        name: What files call the arm.
        lengths: Link lengths without strokes [m].
        base: Position of the first joint, and of a mobile base at rest [m].
        lower: Smallest joint angles [rad].
        upper: Largest joint angles [rad].
        strokes: Longest extension of each link; 0 where there is none [m].
        reach: How far a mobile base moves at most along x and y, either way; 0 for a fixed one [m].
    """

    name: str
    lengths: tuple[float, ...]
    base: tuple[float, float]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    strokes: tuple[float, ...]
    reach: tuple[float, float] = (0.0, 0.0)

    def dh_rows(self) -> list[DhRow]:
        """Return the Denavit-Hartenberg table, from the base on."""
        return [
            DhRow(f"joint{i + 1}", 0.0, length, 0.0, stroke)
            for i, (length, stroke) in enumerate(zip(self.lengths, self.strokes, strict=True))
        ]

    def urdf(self) -> str:
        """Return URDF text: joints ``joint1``, ``stroke1``, ... in the order of the chain.

        A mobile base is two joints before them, ``base_x`` and ``base_y``, zero where it rests.
        """
        joints: list[UrdfJoint] = []
        offset = (self.base[0], self.base[1], 0.0)
        if max(self.reach) > 0.0:
            for name, axis, most in zip(("base_x", "base_y"), (X, Y), self.reach, strict=True):
                joints.append(
                    UrdfJoint(name, "prismatic", offset, lower=-most, upper=most, axis=axis)
                )
                offset = (0.0, 0.0, 0.0)
        for i, length in enumerate(self.lengths):
            joint = UrdfJoint(
                f"joint{i + 1}", "revolute", offset, lower=self.lower[i], upper=self.upper[i]
            )
            joints.append(joint)
            offset = (length, 0.0, 0.0)
            if self.strokes[i] > 0.0:
                joints.append(
                    UrdfJoint(f"stroke{i + 1}", "prismatic", offset, upper=self.strokes[i], axis=X)
                )
                offset = (0.0, 0.0, 0.0)
        return chain_urdf(self.name, [*joints, UrdfJoint("mount", "fixed", offset)])
