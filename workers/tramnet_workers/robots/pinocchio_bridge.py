"""Between our arms and Pinocchio: models, URDF files, reference dynamics and forward simulation.

The only module that imports Pinocchio. What it computes is the oracle for the kernels; nothing here
is called in a hot loop.
"""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tramnet_workers.robots.arm import STANDARD_GRAVITY, InvalidArm, SerialArm

Array = NDArray[np.float64]
Model = Any  # Pinocchio has no types
TorqueFunction = Callable[[float], Array]

TOOL_FRAME = "tool"


class UnsupportedArm(InvalidArm):
    """A URDF file describes something else than a serial arm of revolute joints.

    Attributes:
        joint: Name of the offending joint, or of the file if there is none.
        found: What was found there.
        expected: What would have worked.
    """

    def __init__(self, joint: str, found: str, expected: str) -> None:
        self.joint, self.found, self.expected = joint, found, expected
        super().__init__(f"{joint}: found {found}, expected {expected}")


class Motion(NamedTuple):
    """What an arm did.

    Attributes:
        times: Instants, of shape (k,) [s].
        q: Joint angles, of shape (k, n) [rad].
        qd: Joint velocities, of shape (k, n) [rad/s].
    """

    times: Array
    q: Array
    qd: Array


def build_model(arm: SerialArm) -> Model:
    """Build Pinocchio's model of an arm, armature, limits and tool frame included."""
    model = pin.Model()
    model.name = arm.name
    model.gravity.linear = arm.gravity
    joint = 0
    for i, name in enumerate(arm.joint_names):
        placement = pin.SE3(arm.rotation[i], arm.translation[i])
        joint = model.addJoint(joint, pin.JointModelRZ(), placement, name)
        model.addJointFrame(joint)
        body = pin.Inertia(float(arm.mass[i]), arm.com[i], arm.inertia[i])
        model.appendBodyToJoint(joint, body, pin.SE3.Identity())
    model.armature[:] = arm.armature
    model.lowerPositionLimit[:] = arm.position_lower
    model.upperPositionLimit[:] = arm.position_upper
    model.velocityLimit[:] = arm.velocity_limits
    model.upperEffortLimit[:] = arm.torque_limits
    model.lowerEffortLimit[:] = -arm.torque_limits
    tool = pin.SE3(arm.tool[:3, :3], arm.tool[:3, 3])
    model.addFrame(pin.Frame(TOOL_FRAME, joint, tool, pin.FrameType.OP_FRAME))
    return model


def arm_from_urdf(path: str | Path, tool: str | None = None) -> SerialArm:
    """Read a serial arm of revolute joints from a URDF file.

    Fixed joints are merged into the links that they join. The axis of each joint, whatever it is,
    becomes the z axis of a turned link frame; angles, masses and the tool's place stay as they are.
    Continuous joints are revolute joints without limits of their angle.

    Args:
        path: The URDF file.
        tool: Name of the URDF link that is the tool; without it, the last link of the file.

    Raises:
        UnsupportedArm: If a joint is not revolute, the joints do not form one chain, or the tool
            is no link that moves with the last joint.
        InvalidArm: If the numbers make no arm, such as a missing effort limit.
    """
    model = _read_urdf(Path(path))
    _check_is_serial(model)
    n = model.njoints - 1
    turns = [np.eye(3), *(_turn_z_to(_axis(model, j)) for j in range(1, n + 1))]
    placements = [model.jointPlacements[j] for j in range(1, n + 1)]
    bodies = [model.inertias[j] for j in range(1, n + 1)]
    last = pin.SE3(turns[-1], np.zeros(3)).inverse() * _tool_placement(model, tool)
    return SerialArm(
        name=model.name,
        joint_names=tuple(model.names[1:]),
        rotation=np.array([turns[i].T @ placements[i].rotation @ turns[i + 1] for i in range(n)]),
        translation=np.array([turns[i].T @ placements[i].translation for i in range(n)]),
        mass=np.array([body.mass for body in bodies]),
        com=np.array([turns[i + 1].T @ bodies[i].lever for i in range(n)]),
        inertia=np.array([turns[i + 1].T @ bodies[i].inertia @ turns[i + 1] for i in range(n)]),
        armature=model.armature,
        position_lower=_position_limits(model, model.lowerPositionLimit, -np.inf),
        position_upper=_position_limits(model, model.upperPositionLimit, np.inf),
        torque_limits=model.upperEffortLimit,
        velocity_limits=model.velocityLimit,
        gravity=np.array(STANDARD_GRAVITY),
        tool=last.homogeneous,
    )


def rnea(arm: SerialArm, q: Array, qd: Array, qdd: Array) -> Array:
    """Compute the joint torques of many states with Pinocchio.

    Args:
        arm: The arm.
        q: Joint angles, of shape (k, n) [rad].
        qd: Joint velocities, of shape (k, n) [rad/s].
        qdd: Joint accelerations, of shape (k, n) [rad/s²].

    Returns:
        Joint torques, of shape (k, n) [N m].
    """
    model = build_model(arm)
    data = model.createData()
    states = zip(q, qd, qdd, strict=True)
    return np.array([pin.rnea(model, data, *state) for state in states]).reshape(q.shape)


def mass_matrix(arm: SerialArm, q: Array) -> Array:
    """Compute the mass matrix M(q), armature included, of shape (n, n) [kg m²]."""
    model = build_model(arm)
    upper = np.triu(pin.crba(model, model.createData(), q))  # all that crba promises to fill
    return np.asarray(upper + np.triu(upper, 1).T, dtype=np.float64)


def tool_position(arm: SerialArm, q: Array) -> Array:
    """Compute where the tool frame is in the base frame, of shape (3,) [m]."""
    model = build_model(arm)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return np.array(data.oMf[model.getFrameId(TOOL_FRAME)].translation, dtype=np.float64)


def forward_simulate(
    arm: SerialArm, torque: TorqueFunction | Array, q0: Array, qd0: Array, times: Array
) -> Motion:
    """Let torques drive an arm, open loop: articulated-body algorithm and classical Runge-Kutta.

    One step of order four goes from each instant to the next. Where the torque jumps, put an
    instant there: a function of time is then asked for its left limit at the end of the step before
    and for its value at the beginning of the step after.

    Args:
        arm: The arm.
        torque: Function of time [s] that gives the joint torques, of shape (n,) [N m]; or torques
            at the given instants, of shape (k, n), between which they change linearly.
        q0: Joint angles at the first instant, of shape (n,) [rad].
        qd0: Joint velocities at the first instant, of shape (n,) [rad/s].
        times: Instants, increasing, of shape (k,) [s].

    Returns:
        The motion at the given instants.
    """
    model = build_model(arm)
    data = model.createData()
    drive = torque if callable(torque) else _interpolated(times, np.asarray(torque))

    def slope(t: float, state: Array) -> Array:
        q, qd = state
        return np.array([qd, pin.aba(model, data, q, qd, drive(t))])

    states = [np.array([q0, qd0], dtype=np.float64)]
    for start, end in pairwise(times):
        states.append(_runge_kutta_step(slope, float(start), float(end), states[-1]))
    motion = np.array(states)
    return Motion(times=np.array(times, dtype=np.float64), q=motion[:, 0], qd=motion[:, 1])


def _runge_kutta_step(
    slope: Callable[[float, Array], Array], start: float, end: float, state: Array
) -> Array:
    h = end - start
    k1 = slope(start, state)
    k2 = slope(start + h / 2, state + h / 2 * k1)
    k3 = slope(start + h / 2, state + h / 2 * k2)
    k4 = slope(float(np.nextafter(end, start)), state + h * k3)
    return state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def _interpolated(times: Array, torques: Array) -> TorqueFunction:
    if torques.shape[:1] != times.shape:
        raise ValueError(
            f"{len(torques)} samples of the torque for {len(times)} instants: give one per instant"
        )

    def drive(t: float) -> Array:
        return np.array([np.interp(t, times, column) for column in torques.T])

    return drive


def _read_urdf(path: Path) -> Model:
    if not path.is_file():
        raise FileNotFoundError(f"there is no URDF file {path}")
    try:
        return pin.buildModelFromUrdf(str(path))
    except ValueError as error:
        raise UnsupportedArm(str(path), "no valid URDF model", "a URDF file") from error


def _check_is_serial(model: Model) -> None:
    if model.njoints < 2:
        raise UnsupportedArm(model.name, "no moving joint", "at least one revolute joint")
    for j in range(1, model.njoints):
        name, kind, parent = model.names[j], model.joints[j].shortname(), model.parents[j]
        if model.joints[j].nv != 1 or not kind.startswith("JointModelR"):
            raise UnsupportedArm(name, f"a joint of Pinocchio's kind {kind}", "a revolute joint")
        if parent != j - 1:
            raise UnsupportedArm(
                name,
                f"that it hangs on {model.names[parent]!r}, like {model.names[parent + 1]!r}",
                f"a serial arm, in which it hangs on {model.names[j - 1]!r}",
            )


def _axis(model: Model, joint: int) -> Array:
    """Return the axis of a revolute joint in its own frame, of shape (3,) and length 1."""
    return np.array(model.createData().joints[joint].S, dtype=np.float64).reshape(6)[3:]


def _turn_z_to(axis: Array) -> Array:
    """Return a rotation that turns z to a given axis; exact for the coordinate axes."""
    z = axis / np.linalg.norm(axis)
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _position_limits(model: Model, limits: Array, unlimited: float) -> Array:
    """Return one limit per joint; Pinocchio keeps two numbers for a continuous one."""
    joints = [model.joints[j] for j in range(1, model.njoints)]
    return np.array([limits[j.idx_q] if j.nq == 1 else unlimited for j in joints])


def _tool_placement(model: Model, tool: str | None) -> Any:
    last = model.njoints - 1
    links = [f for f in model.frames if f.type == pin.FrameType.BODY and f.parentJoint == last]
    for link in reversed(links):
        if tool is None or link.name == tool:
            return link.placement
    names = ", ".join(link.name for link in links)
    raise UnsupportedArm(
        model.names[last], f"that no link {tool!r} moves with it", f"one of {names}"
    )
