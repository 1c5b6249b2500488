"""A serial arm of revolute joints: its geometry, masses, motors and limits, as plain arrays.

Frame i is fixed in link i, has its origin on the axis of joint i and z along it; at q = 0 it stands
in frame i - 1 (the base for i = 0) as ``rotation[i]`` and ``translation[i]`` say.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import dynamics

Array = NDArray[np.float64]

STANDARD_GRAVITY = (0.0, 0.0, -9.81)

_MAY_BE_INFINITE = ("position_lower", "position_upper", "torque_limits", "velocity_limits")


class InvalidArm(ValueError):
    """The numbers that describe an arm do not make one."""


@dataclass(frozen=True, eq=False)
class SerialArm:
    """A serial arm whose n joints all turn about the z axis of their own frame.

    All arrays are copied and read-only. Two arms are equal if all their numbers and names are.

    Attributes:
        name: What reports call the arm.
        joint_names: Names of the joints, from base to tip.
        rotation: Rotation link i - 1 <- link i at q = 0, of shape (n, 3, 3).
        translation: Origin of frame i in frame i - 1, of shape (n, 3) [m].
        mass: Masses of the links, of shape (n,) [kg].
        com: Centres of mass in the links' frames, of shape (n, 3) [m].
        inertia: Inertia about the centre of mass, in the link's frame, of shape (n, 3, 3) [kg m²].
        armature: Inertia of motor and gear as felt at the joint, of shape (n,) [kg m²].
        position_lower: Smallest joint angles, of shape (n,) [rad].
        position_upper: Largest joint angles, of shape (n,) [rad].
        torque_limits: Largest torques in either direction, of shape (n,) [N m].
        velocity_limits: Largest speeds in either direction, of shape (n,) [rad/s]; inf where none.
        gravity: Acceleration of gravity in the base frame, of shape (3,) [m/s²].
        tool: Placement of the tool in the last link's frame, of shape (4, 4) [m].
    """

    name: str
    joint_names: tuple[str, ...]
    rotation: Array
    translation: Array
    mass: Array
    com: Array
    inertia: Array
    armature: Array
    position_lower: Array
    position_upper: Array
    torque_limits: Array
    velocity_limits: Array
    gravity: Array
    tool: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "joint_names", tuple(self.joint_names))
        if not self.joint_names:
            raise InvalidArm(f"the arm {self.name!r} has no joints, but needs at least one")
        for name, shape in _shapes(len(self.joint_names)).items():
            object.__setattr__(self, name, _frozen(name, getattr(self, name), shape))
        self._check()

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @cached_property
    def table(self) -> Array:
        """Table for the kernels, of shape (n_joints, ARM_COLUMNS); see ``kernels.dynamics``."""
        table = np.empty((self.n_joints, dynamics.ARM_COLUMNS))
        table[:, dynamics.ROTATION : dynamics.TRANSLATION] = self.rotation.reshape(-1, 9)
        table[:, dynamics.TRANSLATION : dynamics.MASS] = self.translation
        table[:, dynamics.MASS] = self.mass
        table[:, dynamics.CENTRE : dynamics.INERTIA] = self.com
        upper = np.triu_indices(3)
        table[:, dynamics.INERTIA : dynamics.ARMATURE] = self.inertia[:, upper[0], upper[1]]
        table[:, dynamics.ARMATURE] = self.armature
        table.setflags(write=False)
        return table

    def with_payload(self, mass: float, centre: tuple[float, float, float] | Array) -> Self:
        """Return this arm with a point mass fixed to its last link.

        Args:
            mass: Mass of the payload, at least 0 [kg].
            centre: Its place in the last link's frame, of shape (3,) [m].

        Raises:
            InvalidArm: If the mass is negative or the centre is not a point.
        """
        place = _frozen("centre of the payload", centre, (3,))
        if not 0.0 <= mass < np.inf:
            raise InvalidArm(f"the payload's mass is {mass} kg, but must be finite and at least 0")
        if mass == 0.0:
            return self
        total = self.mass[-1] + mass
        new_mass, com, inertia = self.mass.copy(), self.com.copy(), self.inertia.copy()
        new_mass[-1] = total
        com[-1] = (self.mass[-1] * self.com[-1] + mass * place) / total
        # Two point masses about their common centre weigh like one reduced mass at their distance.
        apart = place - self.com[-1]
        inertia[-1] += (
            self.mass[-1] * mass / total * (apart @ apart * np.eye(3) - np.outer(apart, apart))
        )
        return replace(self, mass=new_mass, com=com, inertia=inertia)

    def parameters(self) -> dict[str, object]:
        """Return the arm as names, numbers and lists, for the wire and for run files."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in values.items()} | {
            "joint_names": list(self.joint_names)
        }

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Rebuild an arm from what ``parameters`` returned.

        Raises:
            InvalidArm: If a key is missing or unknown, or a value makes no arm.
        """
        expected = {field.name for field in fields(cls)}
        if set(parameters) != expected:
            raise InvalidArm(
                f"an arm is described by the keys {sorted(expected)}, but "
                f"{sorted(expected - set(parameters))} are missing and "
                f"{sorted(set(parameters) - expected)} are unknown"
            )
        name, joints = parameters["name"], parameters["joint_names"]
        if not isinstance(joints, list | tuple) or not all(
            isinstance(word, str) for word in (name, *joints)
        ):
            raise InvalidArm(f"name and joint_names are {name!r} and {joints!r}, but must be words")
        return cls(**dict(parameters))  # type: ignore[arg-type]  # __post_init__ checks the arrays

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SerialArm) and self.parameters() == other.parameters()

    def __hash__(self) -> int:
        return hash((self.name, self.joint_names, self.table.tobytes()))

    def _check(self) -> None:
        frames = np.concatenate([self.rotation, self.tool[None, :3, :3]])
        ranges = np.column_stack([self.position_lower, self.position_upper])
        checks = (
            ("rotation", frames, _is_orthonormal(frames), "orthonormal"),
            ("mass", self.mass, self.mass >= 0.0, "at least 0 kg"),
            ("inertia", self.inertia, _is_symmetric(self.inertia), "symmetric"),
            ("armature", self.armature, self.armature >= 0.0, "at least 0 kg m²"),
            ("range of angles", ranges, ranges[:, 0] < ranges[:, 1], "increasing"),
            ("torque limit", self.torque_limits, self.torque_limits > 0.0, "above 0 N m"),
            ("velocity limit", self.velocity_limits, self.velocity_limits > 0.0, "above 0 rad/s"),
        )
        for what, values, passed, expected in checks:
            for owner, value, good in zip(
                (*self.joint_names, "tool"), values, passed, strict=False
            ):
                if not good:
                    raise InvalidArm(
                        f"the {what} of {owner} is {value.tolist()}, but must be {expected}"
                    )


def _shapes(n: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of every array of an arm of n joints."""
    per_joint = ("mass", "armature", "position_lower", "position_upper")
    return (
        {"rotation": (n, 3, 3), "translation": (n, 3), "com": (n, 3), "inertia": (n, 3, 3)}
        | dict.fromkeys((*per_joint, "torque_limits", "velocity_limits"), (n,))
        | {"gravity": (3,), "tool": (4, 4)}
    )


def _frozen(name: str, values: object, shape: tuple[int, ...]) -> Array:
    """Return a read-only copy of an array of the expected shape, without NaN."""
    try:
        array = np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InvalidArm(f"{name} must be numbers of shape {shape}: {error}") from error
    if array.shape != shape:
        raise InvalidArm(f"{name} has shape {array.shape}, but must have shape {shape}")
    if np.isnan(array).any() or (name not in _MAY_BE_INFINITE and np.isinf(array).any()):
        raise InvalidArm(f"{name} is {array.tolist()}, but must contain finite numbers only")
    array.setflags(write=False)
    return array


def _is_orthonormal(rotations: Array) -> NDArray[np.bool_]:
    products = rotations.transpose(0, 2, 1) @ rotations
    skewed: Array = np.abs(products - np.eye(3)).max(axis=(1, 2))
    return np.less(skewed, 1e-9)


def _is_symmetric(inertia: Array) -> NDArray[np.bool_]:
    lopsided: Array = np.abs(inertia - inertia.transpose(0, 2, 1)).max(axis=(1, 2))
    scale: Array = np.abs(inertia).max(axis=(1, 2))
    return np.less_equal(lopsided, 1e-9 * scale)  # leave room for rounding
