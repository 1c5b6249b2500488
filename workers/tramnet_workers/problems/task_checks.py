"""Checks of what a user gives: each failure names the field, what was found and what was expected."""

from numbers import Real

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidTask
from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.robots.arm import SerialArm

Array = NDArray[np.float64]

#: Joints that start and end closer than this stand still [rad].
_STILL = 1e-12


def number(field: str, value: object) -> float:
    """Return a number as a float.

    Raises:
        InvalidTask: It is no number, or NaN.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InvalidTask(field, repr(value), "a number")
    if np.isnan(float(value)):
        raise InvalidTask(field, "nan", "a number")
    return float(value)


def whole_number(field: str, value: object, least: int, most: int) -> int:
    """Return a whole number within a range.

    Raises:
        InvalidTask: It is none, or out of range.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise InvalidTask(field, repr(value), f"a whole number from {least} to {most}")
    if not least <= value <= most:
        raise InvalidTask(field, f"{value}", f"a whole number from {least} to {most}")
    return int(value)


def column(field: str, values: object, arm: SerialArm) -> Array:
    """Return one number for each joint of an arm, as a read-only array of shape (n_joints,).

    Raises:
        InvalidTask: They are not that many, or one is no number or NaN.
    """
    expected = f"{arm.n_joints} numbers, one for each joint of {arm.name}"
    if isinstance(values, str) or not np.iterable(values):
        raise InvalidTask(field, repr(values), expected)
    elements = list(values)
    if len(elements) != arm.n_joints:
        raise InvalidTask(field, f"{len(elements)} numbers", expected)
    array = np.array([number(f"{field}[{i}]", value) for i, value in enumerate(elements)])
    array.setflags(write=False)
    return array


def check_limits(torque: Array, velocity: Array, lower: Array, upper: Array) -> None:
    """Check the limits of a task, each of shape (n_joints,).

    Raises:
        InvalidTask: A limit leaves a joint nothing to move with or in.
    """
    for i in range(len(torque)):
        if not 0.0 < torque[i] < np.inf:
            raise InvalidTask(f"torque_limits[{i}]", f"{torque[i]}", "a finite number above 0")
        if not velocity[i] > 0.0:
            raise InvalidTask(f"velocity_limits[{i}]", f"{velocity[i]}", "a number above 0, or inf")
        if not lower[i] < upper[i]:
            expected = f"less than position_upper[{i}] = {upper[i]}"
            raise InvalidTask(f"position_lower[{i}]", f"{lower[i]}", expected)


def check_ends(start: Array, goal: Array, lower: Array, upper: Array) -> None:
    """Check that start and goal are two places within the limits, each of shape (n_joints,).

    Raises:
        InvalidTask: One is outside, infinite, or both are the same.
    """
    for field, position in (("start", start), ("goal", goal)):
        for i, angle in enumerate(position):
            if not (np.isfinite(angle) and lower[i] <= angle <= upper[i]):
                expected = f"an angle in the joint's range [{lower[i]}, {upper[i]}] rad"
                raise InvalidTask(f"{field}[{i}]", f"{angle}", expected)
    if np.abs(goal - start).max() <= _STILL:
        raise InvalidTask("goal", "the start in all joints", "another position in one at least")


def check_strength(arm: SerialArm, field: str, position: Array, torque_limits: Array) -> None:
    """Check that an arm can be held at rest in a position.

    Args:
        arm: The arm.
        field: What the position is called.
        position: Joint angles, of shape (n_joints,) [rad].
        torque_limits: Largest torques in either direction, of shape (n_joints,) [N m].

    Raises:
        InvalidTask: A joint is too weak for gravity there.
    """
    still = np.zeros((1, arm.n_joints))
    needed = inverse_dynamics_batch(arm.table, arm.gravity, position[None], still, still)[0]
    for i in range(arm.n_joints):
        if abs(needed[i]) > torque_limits[i]:
            expected = (
                f"at least {abs(needed[i]):.6g} N m, which holds the arm still at the {field}"
            )
            raise InvalidTask(f"torque_limits[{i}]", f"{torque_limits[i]}", expected)
