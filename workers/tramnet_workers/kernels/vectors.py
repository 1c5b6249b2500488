"""Vectors and matrices of three, by their components: they live in registers, one for each lane."""

from typing import NamedTuple

from tramnet_workers.kernels import device


class Vector(NamedTuple):
    """A vector of three components in some link's frame."""

    x: float
    y: float
    z: float


class Matrix(NamedTuple):
    """A matrix of 3 x 3, row by row."""

    xx: float
    xy: float
    xz: float
    yx: float
    yy: float
    yz: float
    zx: float
    zy: float
    zz: float


@device
def rotation_rates(omega: Vector, omega_dot: Vector) -> Matrix:
    """Return the matrix U with U r = omega_dot x r + omega x (omega x r)."""
    xx, yy, zz = omega.x * omega.x, omega.y * omega.y, omega.z * omega.z
    xy, xz, yz = omega.x * omega.y, omega.x * omega.z, omega.y * omega.z
    return Matrix(
        -(yy + zz), xy - omega_dot.z, xz + omega_dot.y,
        xy + omega_dot.z, -(xx + zz), yz - omega_dot.x,
        xz - omega_dot.y, yz + omega_dot.x, -(xx + yy),
    )  # fmt: skip


@device
def into_joint(placement: Matrix, s: float, c: float, v: Vector) -> Vector:
    """Turn a vector from the parent link's frame into that of a link whose joint is at (s, c)."""
    x = placement.xx * v.x + placement.yx * v.y + placement.zx * v.z
    y = placement.xy * v.x + placement.yy * v.y + placement.zy * v.z
    z = placement.xz * v.x + placement.yz * v.y + placement.zz * v.z
    return Vector(c * x + s * y, c * y - s * x, z)


@device
def out_of_joint(placement: Matrix, s: float, c: float, v: Vector) -> Vector:
    """Turn a vector from the frame of a link whose joint is at (s, c) into the parent's."""
    return times(placement, Vector(c * v.x - s * v.y, s * v.x + c * v.y, v.z))


@device
def times(m: Matrix, v: Vector) -> Vector:
    """Return the product of a matrix and a vector."""
    return Vector(
        m.xx * v.x + m.xy * v.y + m.xz * v.z,
        m.yx * v.x + m.yy * v.y + m.yz * v.z,
        m.zx * v.x + m.zy * v.y + m.zz * v.z,
    )


@device
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return Vector(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@device
def add(a: Vector, b: Vector) -> Vector:
    """Return the sum of two vectors."""
    return Vector(a.x + b.x, a.y + b.y, a.z + b.z)


@device
def scale(factor: float, v: Vector) -> Vector:
    """Return a multiple of a vector."""
    return Vector(factor * v.x, factor * v.y, factor * v.z)
