"""Forward kinematics of serial arms, many postures at once.

An arm is a *chain* of n + 1 rows. Row i leads from joint i - 1 (the base for i = 0) to joint i (the
tip for i = n): a translation in the frame reached so far, a twist about its x axis, and then the
turn of joint i about z. Every arm whose joints turn about their own z axes can be written so: a
constant rotation is Rz(phi) Rx(twist) Rz(psi), and phi and psi are merged with the joints' angles
as offsets; that of the base is kept whole. A Denavit-Hartenberg table is such a chain with offsets
0.

Postures stand side by side in lane blocks, see ``lanes``.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.distances import Vector
from tramnet_workers.kernels.lanes import LANES, new_rows
from tramnet_workers.kernels.transforms import sincos

Array = NDArray[np.float64]

# Columns of a chain: cosine and sine of the twist, translation (3), offset of the joint's angle.
TWIST_COSINE = 0
TWIST_SINE = 1
TRANSLATION = 2
OFFSET = 5
CHAIN_COLUMNS = 6

#: Largest change of a joint's angle that ``turn_from`` accepts [rad].
LARGEST_TURN = np.pi / 4

#: Rows of a turn: sine and cosine of a joint's angle.
TURN_ROWS = 2

#: Rows of a pose: the components of a frame's axes x, y and z, and of its origin.
POSE_ROWS = 12

_ORIGIN = 9 * LANES

_S1 = -1.66666666666666324348e-01
_S2 = 8.33333333332248946124e-03
_S3 = -1.98412698298579493134e-04
_S4 = 2.75573137070700676789e-06
_S5 = -2.50507602534068634195e-08
_S6 = 1.58969099521155010221e-10

_C1 = 4.16666666666666019037e-02
_C2 = -1.38888888888741095749e-03
_C3 = 2.48015872894767294178e-05
_C4 = -2.75573143513906633035e-07
_C5 = 2.08757232129817482790e-09
_C6 = -1.13596475577881948265e-11


class Chain(NamedTuple):
    """An arm, as kernels see it.

    Attributes:
        base: Rotation of the frame before the first joint turns, of shape (3, 3).
        rows: What leads from joint to joint, of shape (n + 1, CHAIN_COLUMNS) [cm].
    """

    base: Array
    rows: Array


@kernel
def directions(chain: Chain, q: Array, sines: Array, cosines: Array) -> None:
    """Compute the sines and cosines of one posture's joints, offsets included.

    Args:
        chain: The arm.
        q: Joint angles, of shape (n,) [rad].
        sines: Receives the sines, of shape (n,).
        cosines: Receives the cosines, of shape (n,).
    """
    for j in range(len(q)):
        sines[j], cosines[j] = sincos(q[j] + chain.rows[j, OFFSET])


@device
def turn_from(sine: float, cosine: float, dq: Array, turn: Array) -> None:
    """Compute the sine and cosine of q + dq from those of q, in all lanes.

    The sum formulas need no range reduction, which is half of the work of ``sincos``.

    Args:
        sine: Sine of q.
        cosine: Cosine of q.
        dq: Changes of the angle, of shape (LANES,), at most ``LARGEST_TURN`` in size [rad].
        turn: Receives the turn, of shape (TURN_ROWS * LANES,).
    """
    for lane in range(LANES):
        s, c = _sine(dq[lane]), _cosine(dq[lane])
        turn[lane] = sine * c + cosine * s
        turn[LANES + lane] = cosine * c - sine * s


@device
def joint_poses(chain: Chain, turns: Array, poses: Array) -> None:
    """Compute the poses of all joints, and of the tip, of a block of postures.

    Args:
        chain: The arm.
        turns: Turns of the joints, of shape (n, TURN_ROWS * LANES).
        poses: Receives, in row i, the axes before joint i turns and its origin, of shape
            (n + 1, POSE_ROWS * LANES) [cm].
    """
    rows = chain.rows
    start_at_base(chain, poses[0])
    for i in range(len(turns)):
        advance(rows[i], rows[i + 1], turns[i], poses[i], poses[i + 1])


@device
def origin(pose: Array, lane: int) -> Vector:
    """Return the origin of a pose in one lane [cm]."""
    k = _ORIGIN + lane
    return Vector(pose[k], pose[k + LANES], pose[k + 2 * LANES])


@kernel
def chain_points(chain: Chain, q: Array) -> Array:
    """Compute the origins of all joints, and the tip, of any number of postures.

    Args:
        chain: The arm.
        q: Joint angles, of shape (k, n) [rad].

    Returns:
        Points, of shape (k, n + 1, 3) [cm].
    """
    k, n = q.shape
    result = np.empty((k, n + 1, 3))
    turns, poses = new_rows(n, TURN_ROWS), new_rows(n + 1, POSE_ROWS)
    for first in range(0, k, LANES):
        for lane in range(min(LANES, k - first)):
            directions(chain, q[first + lane], turns[:, lane], turns[:, LANES + lane])
        joint_poses(chain, turns, poses)
        for lane in range(min(LANES, k - first)):
            for i in range(n + 1):
                point = origin(poses[i], lane)
                result[first + lane, i] = point
    return result


@kernel
def joint_axes(chain: Chain, q: Array, axes: Array, points: Array) -> None:
    """Compute the axes and origins of all joints, and the tip, of one posture.

    Args:
        chain: The arm.
        q: Joint angles, of shape (n,) [rad].
        axes: Receives the unit vectors along the joints' axes, of shape (n, 3).
        points: Receives the points, of shape (n + 1, 3) [cm].
    """
    n = len(q)
    rows, base = chain.rows, chain.base
    xx, yx, zx = base[0, 0], base[0, 1], base[0, 2]
    xy, yy, zy = base[1, 0], base[1, 1], base[1, 2]
    xz, yz, zz = base[2, 0], base[2, 1], base[2, 2]
    for axis in range(3):
        points[0, axis] = rows[0, TRANSLATION + axis]
    for i in range(n):
        tc, ts = rows[i, TWIST_COSINE], rows[i, TWIST_SINE]
        s, c = sincos(q[i] + rows[i, OFFSET])
        xx, yx, zx = _turned(tc, ts, s, c, xx, yx, zx)
        xy, yy, zy = _turned(tc, ts, s, c, xy, yy, zy)
        xz, yz, zz = _turned(tc, ts, s, c, xz, yz, zz)
        axes[i, 0], axes[i, 1], axes[i, 2] = zx, zy, zz
        tx, ty, tz = (
            rows[i + 1, TRANSLATION],
            rows[i + 1, TRANSLATION + 1],
            rows[i + 1, TRANSLATION + 2],
        )
        points[i + 1, 0] = points[i, 0] + (tx * xx + ty * yx + tz * zx)
        points[i + 1, 1] = points[i, 1] + (tx * xy + ty * yy + tz * zy)
        points[i + 1, 2] = points[i, 2] + (tx * xz + ty * yz + tz * zz)


@device
def start_at_base(chain: Chain, pose: Array) -> None:
    """Set a pose to the axes of the base, and to the point to which the first row leads."""
    for component in range(3):
        for lane in range(LANES):
            for axis in range(3):
                pose[(3 * axis + component) * LANES + lane] = chain.base[component, axis]
            pose[_ORIGIN + component * LANES + lane] = chain.rows[0, TRANSLATION + component]


@device
def advance(row: Array, next_row: Array, turn: Array, pose: Array, next_pose: Array) -> None:
    """Turn a pose by the twist and joint of a row, and go on to the point of the next row.

    Args:
        row: Row of the joint, of shape (CHAIN_COLUMNS,) [cm].
        next_row: The row after it, of the same shape.
        turn: Sines and cosines of the joint's angle, of shape (TURN_ROWS * LANES,).
        pose: Pose before the joint, of shape (POSE_ROWS * LANES,) [cm].
        next_pose: Receives the pose before the next one, in other storage.
    """
    tc, ts = row[TWIST_COSINE], row[TWIST_SINE]
    tx, ty, tz = next_row[TRANSLATION], next_row[TRANSLATION + 1], next_row[TRANSLATION + 2]
    for lane in range(LANES):
        s, c = turn[lane], turn[LANES + lane]
        # Written out: LLVM does not vectorise this loop around an inner one over the axes.
        _advance_component(tc, ts, s, c, tx, ty, tz, pose, next_pose, lane)
        _advance_component(tc, ts, s, c, tx, ty, tz, pose, next_pose, LANES + lane)
        _advance_component(tc, ts, s, c, tx, ty, tz, pose, next_pose, 2 * LANES + lane)


@device
def _advance_component(
    tc: float,
    ts: float,
    s: float,
    c: float,
    tx: float,
    ty: float,
    tz: float,
    pose: Array,
    next_pose: Array,
    k: int,
) -> None:
    """Compute one component of the axes and the origin of the next pose."""
    x, y, z = _turned(tc, ts, s, c, pose[k], pose[3 * LANES + k], pose[6 * LANES + k])
    next_pose[k] = x
    next_pose[3 * LANES + k] = y
    next_pose[6 * LANES + k] = z
    next_pose[_ORIGIN + k] = pose[_ORIGIN + k] + (tx * x + ty * y + tz * z)


@device
def _turned(
    tc: float, ts: float, s: float, c: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Return a component of the axes x, y, z after a twist about x and a turn about z."""
    twisted = tc * y + ts * z
    return c * x + s * twisted, c * twisted - s * x, tc * z - ts * y


@device
def _sine(x: float) -> float:
    """Return sin(x) for |x| <= pi/4, as in ``transforms``."""
    z = x * x
    p = _S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))
    return x + z * x * (_S1 + z * p)


@device
def _cosine(x: float) -> float:
    """Return cos(x) for |x| <= pi/4, as in ``transforms``."""
    z = x * x
    p = z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6)))))
    half_z = 0.5 * z
    w = 1.0 - half_z
    return w + (((1.0 - w) - half_z) + z * p)
