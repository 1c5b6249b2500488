"""Parts of the inverse dynamics: at rest, and of accelerations alone.

The torque of a segment needs three parts of tau = H(q) qdd + C(q, qd) qd + g(q) at one posture. Three
calls of ``inverse_dynamics`` would give them, but they share sines and cosines, and two of them
do without velocities: together these two functions take about half the time. Same conventions, same
recursion; see ``kernels.dynamics``.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.book import ANGLE, COSINE, RATE, SINE, STEP, A, B, Book, C
from tramnet_workers.kernels.dynamics import (
    ARMATURE,
    CENTRE,
    INERTIA,
    LANES,
    MASS,
    ROTATION,
    TRANSLATION,
    _lane,
    _store,
)
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

# Rows of the scratch arrays: what travels along the chain, and what each link keeps.
_OMEGA = 0
_OMEGA_DOT = 3
_ACCELERATION = 6
_GRAVITY = 9
_FORCE = 12
_MOMENT = 15
_WEIGHT = 18
_TILT = 21
_CHAIN_ROWS = 24

_KEPT_FORCE = 0
_KEPT_MOMENT = 3
_KEPT_WEIGHT = 6
_KEPT_TILT = 9
_LINK_ROWS = 12


@kernel
def new_chain() -> Array:
    """Return room for what travels along the chain."""
    return np.zeros(_CHAIN_ROWS * LANES)


@kernel
def new_links(n: int) -> Array:
    """Return room for what each of n links keeps."""
    return np.zeros((n, _LINK_ROWS * LANES))


@device
def resting_torques(
    arm: Array,
    gravity: Array,
    j: int,
    first: int,
    share: float,
    book: Book,
    chain: Array,
    links: Array,
) -> None:
    """Compute what no velocity changes: sines, cosines, g, and A = 2 H D + share^2 C(D, D).

    Args:
        arm: Table of the arm, of shape (n_joints, ARM_COLUMNS).
        gravity: Acceleration of gravity in the base frame, of shape (3,) [m/s²].
        j: Index of the segment.
        first: First row of the posture.
        share: Part of the mean velocity that the joints have at this posture.
        book: Holds ANGLE and STEP; receives SINE, COSINE, A and, with g, C.
        chain: Scratch from ``new_chain``.
        links: Scratch from ``new_links``.
    """
    for k in range(_CHAIN_ROWS * LANES):
        chain[k] = 0.0
    for axis in range(3):
        for lane in range(LANES):
            chain[(_GRAVITY + axis) * LANES + lane] = -gravity[axis]
    for i in range(arm.shape[0]):
        _rest_outward(arm, i, j, first + i, share, book, chain, links)
    for i in range(arm.shape[0] - 1, -1, -1):
        _rest_inward(arm, i, j, first + i, book, chain, links)


@device
def _rest_outward(
    arm: Array, i: int, j: int, row: int, share: float, book: Book, chain: Array, links: Array
) -> None:
    placement = _matrix(arm, i, ROTATION)
    offset = _vector(arm, i, TRANSLATION)
    mass = arm[i, MASS]
    centre = _vector(arm, i, CENTRE)
    inertia = _symmetric(arm, i, INERTIA)
    for lane in range(LANES):
        s, c = sincos(book[j, row, ANGLE + lane])
        rate, rate_dot = share * book[j, row, STEP + lane], 2.0 * book[j, row, STEP + lane]
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
            carried.x + turned.y * rate, carried.y - turned.x * rate, carried.z + rate_dot
        )
        acceleration = into_joint(placement, s, c, origin)
        force = scale(mass, add(acceleration, times(rotation_rates(omega, omega_dot), centre)))
        moment = add(
            add(times(inertia, omega_dot), cross(omega, times(inertia, omega))),
            cross(centre, force),
        )
        lift = into_joint(placement, s, c, _lane(chain, _GRAVITY, lane))
        weight = scale(mass, lift)
        book[j, row, SINE + lane] = s
        book[j, row, COSINE + lane] = c
        _store_link(links, i, _KEPT_FORCE, lane, force)
        _store_link(links, i, _KEPT_MOMENT, lane, moment)
        _store_link(links, i, _KEPT_WEIGHT, lane, weight)
        _store_link(links, i, _KEPT_TILT, lane, cross(centre, weight))
        _store(chain, _OMEGA, lane, omega)
        _store(chain, _OMEGA_DOT, lane, omega_dot)
        _store(chain, _ACCELERATION, lane, acceleration)
        _store(chain, _GRAVITY, lane, lift)


@device
def _rest_inward(
    arm: Array, i: int, j: int, row: int, book: Book, chain: Array, links: Array
) -> None:
    placement = _matrix(arm, i, ROTATION)
    offset = _vector(arm, i, TRANSLATION)
    armature = 2.0 * arm[i, ARMATURE]
    for lane in range(LANES):
        s, c = book[j, row, SINE + lane], book[j, row, COSINE + lane]
        force = add(_link_lane(links, i, _KEPT_FORCE, lane), _lane(chain, _FORCE, lane))
        moment = add(_link_lane(links, i, _KEPT_MOMENT, lane), _lane(chain, _MOMENT, lane))
        weight = add(_link_lane(links, i, _KEPT_WEIGHT, lane), _lane(chain, _WEIGHT, lane))
        tilt = add(_link_lane(links, i, _KEPT_TILT, lane), _lane(chain, _TILT, lane))
        book[j, row, A + lane] = moment.z + armature * book[j, row, STEP + lane]
        book[j, row, C + lane] = tilt.z
        force_parent = out_of_joint(placement, s, c, force)
        moment_parent = add(out_of_joint(placement, s, c, moment), cross(offset, force_parent))
        weight_parent = out_of_joint(placement, s, c, weight)
        tilt_parent = add(out_of_joint(placement, s, c, tilt), cross(offset, weight_parent))
        _store(chain, _FORCE, lane, force_parent)
        _store(chain, _MOMENT, lane, moment_parent)
        _store(chain, _WEIGHT, lane, weight_parent)
        _store(chain, _TILT, lane, tilt_parent)


@device
def momentum(arm: Array, j: int, first: int, book: Book, chain: Array, links: Array) -> None:
    """Compute -H v at a posture; H v is what accelerations v alone would take.

    Args:
        arm: Table of the arm, of shape (n_joints, ARM_COLUMNS).
        j: Index of the segment.
        first: First row of the posture.
        book: Holds SINE, COSINE and RATE; receives -H v in B.
        chain: Scratch from ``new_chain``.
        links: Scratch from ``new_links``.
    """
    for k in range(_CHAIN_ROWS * LANES):
        chain[k] = 0.0
    for i in range(arm.shape[0]):
        _momentum_outward(arm, i, j, first + i, book, chain, links)
    for i in range(arm.shape[0] - 1, -1, -1):
        _momentum_inward(arm, i, j, first + i, book, chain, links)


@device
def _momentum_outward(
    arm: Array, i: int, j: int, row: int, book: Book, chain: Array, links: Array
) -> None:
    placement = _matrix(arm, i, ROTATION)
    offset = _vector(arm, i, TRANSLATION)
    mass = arm[i, MASS]
    centre = _vector(arm, i, CENTRE)
    inertia = _symmetric(arm, i, INERTIA)
    for lane in range(LANES):
        s, c = book[j, row, SINE + lane], book[j, row, COSINE + lane]
        omega_dot_parent = _lane(chain, _OMEGA_DOT, lane)
        origin = add(_lane(chain, _ACCELERATION, lane), cross(omega_dot_parent, offset))
        carried = into_joint(placement, s, c, omega_dot_parent)
        omega_dot = Vector(carried.x, carried.y, carried.z + book[j, row, RATE + lane])
        acceleration = into_joint(placement, s, c, origin)
        force = scale(mass, add(acceleration, cross(omega_dot, centre)))
        moment = add(times(inertia, omega_dot), cross(centre, force))
        _store_link(links, i, _KEPT_FORCE, lane, force)
        _store_link(links, i, _KEPT_MOMENT, lane, moment)
        _store(chain, _OMEGA_DOT, lane, omega_dot)
        _store(chain, _ACCELERATION, lane, acceleration)


@device
def _momentum_inward(
    arm: Array, i: int, j: int, row: int, book: Book, chain: Array, links: Array
) -> None:
    placement = _matrix(arm, i, ROTATION)
    offset = _vector(arm, i, TRANSLATION)
    armature = arm[i, ARMATURE]
    for lane in range(LANES):
        s, c = book[j, row, SINE + lane], book[j, row, COSINE + lane]
        force = add(_link_lane(links, i, _KEPT_FORCE, lane), _lane(chain, _FORCE, lane))
        moment = add(_link_lane(links, i, _KEPT_MOMENT, lane), _lane(chain, _MOMENT, lane))
        book[j, row, B + lane] = -(moment.z + armature * book[j, row, RATE + lane])
        force_parent = out_of_joint(placement, s, c, force)
        moment_parent = add(out_of_joint(placement, s, c, moment), cross(offset, force_parent))
        _store(chain, _FORCE, lane, force_parent)
        _store(chain, _MOMENT, lane, moment_parent)


@device
def _vector(arm: Array, i: int, k: int) -> Vector:
    return Vector(arm[i, k], arm[i, k + 1], arm[i, k + 2])


@device
def _matrix(arm: Array, i: int, k: int) -> Matrix:
    return Matrix(
        arm[i, k], arm[i, k + 1], arm[i, k + 2],
        arm[i, k + 3], arm[i, k + 4], arm[i, k + 5],
        arm[i, k + 6], arm[i, k + 7], arm[i, k + 8],
    )  # fmt: skip


@device
def _symmetric(arm: Array, i: int, k: int) -> Matrix:
    return Matrix(
        arm[i, k], arm[i, k + 1], arm[i, k + 2],
        arm[i, k + 1], arm[i, k + 3], arm[i, k + 4],
        arm[i, k + 2], arm[i, k + 4], arm[i, k + 5],
    )  # fmt: skip


@device
def _link_lane(links: Array, i: int, row: int, lane: int) -> Vector:
    k = row * LANES + lane
    return Vector(links[i, k], links[i, k + LANES], links[i, k + 2 * LANES])


@device
def _store_link(links: Array, i: int, row: int, lane: int, v: Vector) -> None:
    k = row * LANES + lane
    links[i, k] = v.x
    links[i, k + LANES] = v.y
    links[i, k + 2 * LANES] = v.z
