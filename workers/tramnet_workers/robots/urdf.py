"""Serial arms as URDF text, the format that simulators and planners read.

Geometry and limits only: a designed arm has no masses yet. URDF asks for effort and velocity limits all
the same; those written are placeholders.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, pi
from xml.etree import ElementTree as Xml

_EFFORT, _VELOCITY = 100.0, pi  # placeholders [N m, rad/s]
_RADIUS = 0.02  # of the cylinders that show the links [m]

Triple = tuple[float, float, float]
X: Triple = (1.0, 0.0, 0.0)
Y: Triple = (0.0, 1.0, 0.0)
Z: Triple = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class UrdfJoint:
    """A joint and the link that it moves.

    Attributes:
        name: Name of the joint.
        kind: ``revolute``, ``prismatic`` or ``fixed``.
        offset: Origin in the parent link's frame [m].
        roll: Turn about the parent's x axis [rad].
        lower: Smallest joint value [rad, m].
        upper: Largest joint value [rad, m].
        axis: Unit vector that it turns about or moves along.
    """

    name: str
    kind: str
    offset: Triple
    roll: float = 0.0
    lower: float = 0.0
    upper: float = 0.0
    axis: Triple = Z


def chain_urdf(name: str, joints: Sequence[UrdfJoint]) -> str:
    """Return a chain of joints from link ``base`` to link ``tip`` as URDF text."""
    robot = Xml.Element("robot", name=name)
    links = ["base", *(f"link_{joint.name}" for joint in joints[:-1]), "tip"]
    for i, link in enumerate(links):
        element = Xml.SubElement(robot, "link", name=link)
        if i < len(joints):
            _show(element, joints[i].offset)
    for joint, parent, child in zip(joints, links[:-1], links[1:], strict=True):
        _add_joint(robot, joint, parent, child)
    Xml.indent(robot)
    return '<?xml version="1.0"?>\n' + Xml.tostring(robot, encoding="unicode") + "\n"


def _add_joint(robot: Xml.Element, joint: UrdfJoint, parent: str, child: str) -> None:
    element = Xml.SubElement(robot, "joint", name=joint.name, type=joint.kind)
    Xml.SubElement(element, "parent", link=parent)
    Xml.SubElement(element, "child", link=child)
    Xml.SubElement(element, "origin", xyz=_text(*joint.offset), rpy=_text(joint.roll, 0.0, 0.0))
    if joint.kind != "fixed":
        Xml.SubElement(element, "axis", xyz=_text(*joint.axis))
        Xml.SubElement(
            element,
            "limit",
            lower=_text(joint.lower),
            upper=_text(joint.upper),
            effort=_text(_EFFORT),
            velocity=_text(_VELOCITY),
        )


def _show(link: Xml.Element, end: Triple) -> None:
    """Add a cylinder from a link's origin to where the next joint stands."""
    x, y, z = end
    length = hypot(x, y, z)
    if length < _RADIUS:
        return
    visual = Xml.SubElement(link, "visual")
    turn = _text(0.0, atan2(hypot(x, y), z), atan2(y, x))
    Xml.SubElement(visual, "origin", xyz=_text(x / 2, y / 2, z / 2), rpy=turn)
    geometry = Xml.SubElement(visual, "geometry")
    Xml.SubElement(geometry, "cylinder", radius=_text(_RADIUS), length=_text(length))


def _text(*numbers: float) -> str:
    return " ".join(repr(float(number)) for number in numbers)
