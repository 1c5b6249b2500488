"""An arm as a chain of points: what kinematics needs to know, and which parts of it can move."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kinematics
from tramnet_workers.robots.arm import SerialArm

Array = NDArray[np.float64]

_CENTIMETRES = 100.0  # per metre
# Rounding leaves 6e-17 where a quarter turn has a zero.
_NOTHING = 1e-14

_TRANSLATION = slice(kinematics.TRANSLATION, kinematics.TRANSLATION + 3)


@dataclass(frozen=True, eq=False)
class LinkChain:
    """The n + 1 points of an arm: the origins of its n joints, and the tip.

    Attributes:
        chain: The arm as kernels see it [cm].
        links: Points at the ends of each link that can move, of shape (n_links, 2).
        inert: Whether a joint moves no point of the arm, of shape (n,).
        arms: Largest distance of each link from each joint before it, of shape (n_links, n), with 0
            for joints behind it [cm].
    """

    chain: kinematics.Chain
    links: NDArray[np.int64]
    inert: NDArray[np.bool_]
    arms: Array

    def __post_init__(self) -> None:
        for array in (*self.chain, self.links, self.inert, self.arms):
            array.setflags(write=False)

    def points(self, q: Array) -> Array:
        """Return the points of postures (k, n) [rad], of shape (k, n + 1, 3) [cm]."""
        return kinematics.chain_points(self.chain, np.ascontiguousarray(q))


@lru_cache(maxsize=64)
def link_chain(arm: SerialArm) -> LinkChain:
    """Return the chain of an arm.

    A link is a stretch between two successive points that are apart. The stretch below the first
    joint, and those along axes that no joint moves, such as a column, are no links: nothing that
    the arm does brings them nearer to an obstacle.
    """
    rows = _rows(arm)
    lengths = np.linalg.norm(_translations(rows), axis=1)
    links = [(i, i + 1) for i in range(arm.n_joints) if lengths[i + 1] > 0.0 and _moves(rows, i)]
    inert = np.array([_is_inert(rows, j) for j in range(arm.n_joints)])
    # The first stretch after a joint does not count where it lies on the joint's own axis.
    first = [j + 1 + _leads_along_axis(rows[j + 1]) for j in range(arm.n_joints)]
    arms = np.array([[lengths[i : end + 1].sum() for i in first] for _, end in links])
    return LinkChain(
        kinematics.Chain(np.array(arm.rotation[0]), rows),
        np.array(links, dtype=np.int64).reshape(-1, 2),
        inert,
        arms.reshape(-1, arm.n_joints),
    )


def _rows(arm: SerialArm) -> Array:
    """Split each placement R into Rz(phi) Rx(twist) Rz(psi), and merge phi and psi with the joints.

    The frame in which a translation is given turns with phi as well.
    """
    rows = np.zeros((arm.n_joints + 1, kinematics.CHAIN_COLUMNS))
    rows[0, kinematics.TWIST_COSINE] = 1.0  # the base's rotation is kept whole
    rows[0, _TRANSLATION] = arm.translation[0] * _CENTIMETRES
    rotations = [*arm.rotation[1:], arm.tool[:3, :3]]
    translations = [*arm.translation[1:], arm.tool[:3, 3]]
    for i, (rotation, translation) in enumerate(zip(rotations, translations, strict=True), start=1):
        phi, cosine, sine, psi = _euler(rotation)
        rows[i, : kinematics.TRANSLATION] = cosine, sine
        rows[i, _TRANSLATION] = _about_z(-phi) @ translation * _CENTIMETRES
        rows[i, kinematics.OFFSET] = psi
        rows[i - 1, kinematics.OFFSET] += phi
    rows[np.abs(rows) < _NOTHING] = 0.0
    return rows


def _euler(rotation: Array) -> tuple[float, float, float, float]:
    """Return phi, cosine and sine of the twist, and psi, with phi in [-pi/2, pi/2]."""
    phi = 0.0
    if np.hypot(rotation[0, 2], rotation[1, 2]) > _NOTHING:
        # A quarter turn backwards has phi = 0 and a negative sine, not phi = pi.
        side = -1.0 if rotation[1, 2] > 0.0 else 1.0
        phi = float(np.arctan2(side * rotation[0, 2], -side * rotation[1, 2]))
    # What is left is Rx(twist) Rz(psi), also where the twist is so small that phi is arbitrary.
    left = _about_z(-phi) @ rotation
    return phi, float(left[2, 2]), float(-left[1, 2]), float(np.arctan2(-left[0, 1], left[0, 0]))


def _about_z(angle: float) -> Array:
    s, c = np.sin(angle), np.cos(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _translations(rows: Array) -> Array:
    return rows[:, _TRANSLATION]


def _leads_along_axis(row: Array) -> bool:
    """Tell whether a row's translation lies on the axis of the joint before it."""
    along: bool = not row[kinematics.TRANSLATION : kinematics.TRANSLATION + 2].any()
    return along


def _moves(rows: Array, i: int) -> bool:
    """Tell whether any joint moves the link from point i to point i + 1."""
    column = all(row[kinematics.TWIST_SINE] == 0.0 for row in rows[1 : i + 1])
    return not (column and all(_leads_along_axis(row) for row in rows[1 : i + 2]))


def _is_inert(rows: Array, j: int) -> bool:
    """Tell whether joint j moves no point: all points after it lie on its axis, whatever follows."""
    for i in range(j + 1, len(rows)):
        if not _leads_along_axis(rows[i]):
            return False
        if not _translations(rows[i + 1 :]).any():
            return True
        if rows[i, kinematics.TWIST_SINE] != 0.0:
            return False
    return True
