"""Inverse dynamics of serial arms of revolute joints, many states at once.

Recursive Newton-Euler algorithm of Luh, Walker & Paul (1980), in link frames as in Craig,
Introduction to Robotics, eqs 6.45-6.53. States stand side by side in *lane blocks*: arrays of shape
``(n, LANES)``, so that one instruction works on several states, and every state sees the same
instructions wherever it stands. The frames of link i lie at joint i; joints turn about their own z.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.transforms import sincos
from tramnet_workers.kernels.vectors import (
    Matrix,
    Vector,
    add,
    cross,
    into_joint,
    out_of_joint,
    rotation_rates,
    scale,
    times,
)

Array = NDArray[np.float64]

LANES = 16

# Columns of an arm's table, one row per joint: placement of the joint in its parent link (rotation
# parent <- joint at q = 0, row by row, and translation), then mass, centre of mass and inertia
# about it (xx, xy, xz, yy, yz, zz) in the link's frame, and the motor's inertia at the joint.
ROTATION = 0
TRANSLATION = 9
MASS = 12
CENTRE = 13
INERTIA = 16
ARMATURE = 22
ARM_COLUMNS = 23

# Rows of the scratch array: first what travels along the chain, then what each link keeps.
_OMEGA = 0
_OMEGA_DOT = 3
_ACCELERATION = 6
_FORCE_FROM_TIP = 9
_MOMENT_FROM_TIP = 12
_LINKS = 15
_LINK_ROWS = 8  # sine, cosine, force (3), moment (3)


@kernel
def dynamics_workspace(n: int) -> Array:
    """Return scratch space for ``inverse_dynamics`` of an arm of n joints."""
    return np.empty((_LINKS + _LINK_ROWS * n, LANES))


@kernel
def inverse_dynamics(
    arm: Array, gravity: Array, q: Array, qd: Array, qdd: Array, tau: Array, work: Array
) -> None:
    """Compute the joint torques of a block of states.

    tau = M(q) qdd + C(q, qd) qd + g(q), with the motors' inertia in the diagonal of M.

    Args:
        arm: Table of the arm, of shape (n, ARM_COLUMNS) [m, kg, kg m²].
        gravity: Acceleration of gravity in the base frame, of shape (3,) [m/s²].
        q: Joint angles, of shape (n, LANES) [rad].
        qd: Joint velocities, of shape (n, LANES) [rad/s].
        qdd: Joint accelerations, of shape (n, LANES) [rad/s²].
        tau: Receives the joint torques, of shape (n, LANES) [N m].
        work: Scratch space from ``dynamics_workspace``.
    """
    n = arm.shape[0]
    chain, links = work[:_LINKS].reshape(-1), work[_LINKS:].reshape(n, -1)
    _start_at_base(gravity, chain)
    for i in range(n):
        _step_outward(arm[i], q[i], qd[i], qdd[i], chain, links[i])
    for i in range(n - 1, -1, -1):
        _step_inward(arm[i], qdd[i], chain, links[i], tau[i])


@kernel
def inverse_dynamics_batch(arm: Array, gravity: Array, q: Array, qd: Array, qdd: Array) -> Array:
    """Compute the joint torques of any number of states.

    Args:
        arm: Table of the arm, of shape (n, ARM_COLUMNS).
        gravity: Acceleration of gravity in the base frame, of shape (3,) [m/s²].
        q: Joint angles, of shape (k, n) [rad].
        qd: Joint velocities, of shape (k, n) [rad/s].
        qdd: Joint accelerations, of shape (k, n) [rad/s²].

    Returns:
        Joint torques, of shape (k, n) [N m].
    """
    k, n = q.shape
    torques = np.empty((k, n))
    block = np.empty((4, n, LANES))
    work = dynamics_workspace(n)
    for first in range(0, k, LANES):
        count = min(LANES, k - first)
        _gather(q, first, count, block[0])
        _gather(qd, first, count, block[1])
        _gather(qdd, first, count, block[2])
        inverse_dynamics(arm, gravity, block[0], block[1], block[2], block[3], work)
        for lane in range(count):
            for i in range(n):
                torques[first + lane, i] = block[3, i, lane]
    return torques


@kernel
def _gather(states: Array, first: int, count: int, block: Array) -> None:
    """Lay ``count`` states from ``first`` on side by side; the lanes left over get zeros."""
    block[:] = 0.0
    for lane in range(count):
        for i in range(block.shape[0]):
            block[i, lane] = states[first + lane, i]


@device
def _start_at_base(gravity: Array, chain: Array) -> None:
    """Set the base at rest, accelerated against gravity, and the tip free of load."""
    chain[:] = 0.0
    for axis in range(3):
        for lane in range(LANES):
            chain[(_ACCELERATION + axis) * LANES + lane] = -gravity[axis]


@device
def _step_outward(joint: Array, q: Array, qd: Array, qdd: Array, chain: Array, link: Array) -> None:
    """Carry the motion from a link to the next and find the wrench which that motion takes."""
    placement = _matrix(joint, ROTATION)
    offset = _vector(joint, TRANSLATION)
    mass = joint[MASS]
    centre = _vector(joint, CENTRE)
    inertia = _symmetric(joint, INERTIA)
    for lane in range(LANES):
        s, c = sincos(q[lane])
        rate = qd[lane]
        omega_parent = _lane(chain, _OMEGA, lane)
        omega_dot_parent = _lane(chain, _OMEGA_DOT, lane)
        origin = add(
            _lane(chain, _ACCELERATION, lane),
            times(rotation_rates(omega_parent, omega_dot_parent), offset),
        )
        turned = into_joint(placement, s, c, omega_parent)
        omega = Vector(turned.x, turned.y, turned.z + rate)
        carried = into_joint(placement, s, c, omega_dot_parent)
        omega_dot = Vector(
            carried.x + turned.y * rate, carried.y - turned.x * rate, carried.z + qdd[lane]
        )
        acceleration = into_joint(placement, s, c, origin)
        force = scale(mass, add(acceleration, times(rotation_rates(omega, omega_dot), centre)))
        moment = add(
            add(times(inertia, omega_dot), cross(omega, times(inertia, omega))),
            cross(centre, force),
        )
        link[lane] = s
        link[LANES + lane] = c
        _store(link, 2, lane, force)
        _store(link, 5, lane, moment)
        _store(chain, _OMEGA, lane, omega)
        _store(chain, _OMEGA_DOT, lane, omega_dot)
        _store(chain, _ACCELERATION, lane, acceleration)


@device
def _step_inward(joint: Array, qdd: Array, chain: Array, link: Array, tau: Array) -> None:
    """Add up the wrench on a link, take the joint's torque from it and pass it to the parent."""
    placement = _matrix(joint, ROTATION)
    offset = _vector(joint, TRANSLATION)
    armature = joint[ARMATURE]
    for lane in range(LANES):
        s = link[lane]
        c = link[LANES + lane]
        force = add(_lane(link, 2, lane), _lane(chain, _FORCE_FROM_TIP, lane))
        moment = add(_lane(link, 5, lane), _lane(chain, _MOMENT_FROM_TIP, lane))
        tau[lane] = moment.z + armature * qdd[lane]
        force_parent = out_of_joint(placement, s, c, force)
        moment_parent = add(out_of_joint(placement, s, c, moment), cross(offset, force_parent))
        _store(chain, _FORCE_FROM_TIP, lane, force_parent)
        _store(chain, _MOMENT_FROM_TIP, lane, moment_parent)


@device
def _lane(rows: Array, row: int, lane: int) -> Vector:
    """Read a vector of one lane from three rows that lie end to end."""
    k = row * LANES + lane
    return Vector(rows[k], rows[k + LANES], rows[k + 2 * LANES])


@device
def _store(rows: Array, row: int, lane: int, v: Vector) -> None:
    k = row * LANES + lane
    rows[k] = v.x
    rows[k + LANES] = v.y
    rows[k + 2 * LANES] = v.z


@device
def _vector(joint: Array, k: int) -> Vector:
    return Vector(joint[k], joint[k + 1], joint[k + 2])


@device
def _matrix(joint: Array, k: int) -> Matrix:
    return Matrix(
        joint[k], joint[k + 1], joint[k + 2],
        joint[k + 3], joint[k + 4], joint[k + 5],
        joint[k + 6], joint[k + 7], joint[k + 8],
    )  # fmt: skip


@device
def _symmetric(joint: Array, k: int) -> Matrix:
    return Matrix(
        joint[k], joint[k + 1], joint[k + 2],
        joint[k + 1], joint[k + 3], joint[k + 4],
        joint[k + 2], joint[k + 4], joint[k + 5],
    )  # fmt: skip
