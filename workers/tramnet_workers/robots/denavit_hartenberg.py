"""Serial arms from Denavit-Hartenberg tables, in both conventions that are in use.

*Standard* (Denavit & Hartenberg 1955; Paul 1981): frame i sits at the far end of link i,
T_i = Rz(q) Tz(d) Tx(a) Rx(alpha). *Modified* (Craig 1986): frame i sits at joint i,
T_i = Rx(alpha) Tx(a) Rz(q) Tz(d), with the alpha and a of link i - 1. The link's mass data are given
in that frame i, whichever it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.robots.arm import STANDARD_GRAVITY, SerialArm

Array = NDArray[np.float64]
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class DhLink:
    """One link of a Denavit-Hartenberg table, with its joint.

    Attributes:
        alpha: Twist about x [rad].
        a: Offset along x [m].
        d: Offset along z [m].
        mass: Mass [kg].
        centre: Centre of mass in frame i [m].
        inertia: Moments of inertia xx, yy, zz about the centre of mass, in frame i [kg m²].
        armature: Inertia of motor and gear as felt at the joint [kg m²].
        lower: Smallest joint angle [rad].
        upper: Largest joint angle [rad].
        torque: Largest torque in either direction [N m].
        velocity: Largest speed in either direction [rad/s].
    """

    alpha: float
    a: float
    d: float
    mass: float
    centre: Triple
    inertia: Triple
    armature: float
    lower: float
    upper: float
    torque: float
    velocity: float = np.inf


def standard_dh_arm(name: str, links: Sequence[DhLink]) -> SerialArm:
    """Build an arm from a standard table; its tool frame is frame n of the table."""
    turns = [_about_x(link.alpha) for link in links]
    offsets = [np.array([link.a, 0.0, link.d]) for link in links]
    com = [R @ link.centre + p for R, p, link in zip(turns, offsets, links, strict=True)]
    inertia = [R @ np.diag(link.inertia) @ R.T for R, link in zip(turns, links, strict=True)]
    return _assemble(
        name,
        links,
        rotation=[np.eye(3), *turns[:-1]],
        translation=[np.zeros(3), *offsets[:-1]],
        com=com,
        inertia=inertia,
        tool=_placement(turns[-1], offsets[-1]),
    )


def modified_dh_arm(name: str, links: Sequence[DhLink]) -> SerialArm:
    """Build an arm from a modified table; its tool frame is that of the last link."""
    turns = [_about_x(link.alpha) for link in links]
    offsets = [
        np.array([link.a, 0.0, 0.0]) + R @ [0.0, 0.0, link.d]
        for R, link in zip(turns, links, strict=True)
    ]
    return _assemble(
        name,
        links,
        rotation=turns,
        translation=offsets,
        com=[np.array(link.centre) for link in links],
        inertia=[np.diag(link.inertia) for link in links],
        tool=np.eye(4),
    )


def _assemble(
    name: str,
    links: Sequence[DhLink],
    *,
    rotation: list[Array],
    translation: list[Array],
    com: list[Array],
    inertia: list[Array],
    tool: Array,
) -> SerialArm:
    return SerialArm(
        name=name,
        joint_names=tuple(f"joint{i + 1}" for i in range(len(links))),
        rotation=np.array(rotation),
        translation=np.array(translation),
        mass=np.array([link.mass for link in links]),
        com=np.array(com),
        inertia=np.array(inertia),
        armature=np.array([link.armature for link in links]),
        position_lower=np.array([link.lower for link in links]),
        position_upper=np.array([link.upper for link in links]),
        torque_limits=np.array([link.torque for link in links]),
        velocity_limits=np.array([link.velocity for link in links]),
        gravity=np.array(STANDARD_GRAVITY),
        tool=tool,
    )


def _about_x(alpha: float) -> Array:
    """Return the rotation about x by an angle, exact for whole quarter turns."""
    quarters = alpha / (np.pi / 2)
    if quarters == round(quarters):
        s, c = ((0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0))[round(quarters) % 4]
    else:
        s, c = np.sin(alpha), np.cos(alpha)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _placement(rotation: Array, translation: Array) -> Array:
    placement = np.eye(4)
    placement[:3, :3] = rotation
    placement[:3, 3] = translation
    return placement
