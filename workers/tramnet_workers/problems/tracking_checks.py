"""Checks of a tracking task: each failure names the field, what was found and what was expected."""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidTask
from tramnet_workers.problems import task_checks
from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.link_chain import LinkChain

Array = NDArray[np.float64]


def rows(field: str, values: object, width: int, least: int, most: int) -> Array:
    """Return rows of finite numbers as a read-only array of shape (n_rows, width).

    Raises:
        InvalidTask: They are too few, too many or too long, or one is no finite number.
    """
    expected = f"{least} to {most} rows of {width} numbers"
    if isinstance(values, str) or not np.iterable(values):
        raise InvalidTask(field, repr(values), expected)
    found = [_row(f"{field}[{i}]", row, width) for i, row in enumerate(values)]
    if not least <= len(found) <= most:
        raise InvalidTask(field, f"{len(found)} rows", expected)
    array = np.array(found, dtype=np.float64).reshape(-1, width)
    array.setflags(write=False)
    return array


def _row(field: str, values: object, width: int) -> list[float]:
    if isinstance(values, str) or not np.iterable(values):
        raise InvalidTask(field, repr(values), f"{width} numbers")
    elements = list(values)
    if len(elements) != width:
        raise InvalidTask(field, f"{len(elements)} numbers", f"{width} numbers")
    numbers = [task_checks.number(f"{field}[{i}]", value) for i, value in enumerate(elements)]
    for i, number in enumerate(numbers):
        if not np.isfinite(number):
            raise InvalidTask(f"{field}[{i}]", f"{number}", "a finite number")
    return numbers


def check_arm(arm: SerialArm, chain: LinkChain, most_joints: int) -> None:
    """Check that an arm has no more joints than kernels take, and at least one that moves it."""
    if arm.n_joints > most_joints:
        raise InvalidTask("arm", f"{arm.n_joints} joints", f"{most_joints} joints at most")
    if chain.inert.all() or not len(chain.links):
        raise InvalidTask("arm", "no joint that moves a link", "one such joint at least")


def check_sizes(step: Array, largest_step: float, zone: float, radius: float) -> None:
    """Check the limits of a step, the permissible zone and the links' radius."""
    for j, size in enumerate(step):
        if not 0.0 < size <= largest_step:
            expected = f"above 0 and at most {largest_step:.6g} rad"
            raise InvalidTask(f"step[{j}]", f"{size} rad", expected)
    if not 0.0 < zone < np.inf:
        raise InvalidTask("zone", f"{zone} cm", "a finite number above 0")
    if not 0.0 <= radius < np.inf:
        raise InvalidTask("radius", f"{radius} cm", "a finite number, at least 0")


def check_weights(error_weight: float, clearance_weight: float | None) -> None:
    """Check the weights of the cost."""
    weights = {"error_weight": error_weight, "clearance_weight": clearance_weight}
    for name, weight in weights.items():
        if weight is not None and not 0.0 <= weight < np.inf:
            raise InvalidTask(name, f"{weight}", "a finite number, at least 0")
    if error_weight == 0.0 and clearance_weight == 0.0:
        raise InvalidTask("error_weight", "0, as the clearance's", "a positive weight for either")


def check_boxes(boxes: Array) -> None:
    """Check that no box is inside out."""
    for i, box in enumerate(boxes):
        for axis in range(3):
            if box[axis] > box[3 + axis]:
                found = f"lower {'xyz'[axis]} = {box[axis]:g} cm above upper {box[3 + axis]:g} cm"
                raise InvalidTask(f"boxes[{i}]", found, "lower at most upper on each axis")


def check_start(
    arm: SerialArm, chain: LinkChain, start: Array, first_point: Array, zone: float
) -> None:
    """Check that the start is within the joints' ranges and the tip in the first point's zone."""
    for j, angle in enumerate(start):
        lower, upper = arm.position_lower[j], arm.position_upper[j]
        if not (np.isfinite(angle) and lower <= angle <= upper):
            expected = f"an angle in the joint's range [{lower}, {upper}] rad"
            raise InvalidTask(f"start[{j}]", f"{angle} rad", expected)
    tip = chain.points(start[None])[0, -1]
    apart = float(np.linalg.norm(tip - first_point))
    if apart > zone:
        raise InvalidTask(
            "start",
            f"the tip at {_place(tip)} cm, {apart:.4g} cm from the path's first point",
            f"at most {zone:g} cm (the zone) from {_place(first_point)} cm",
        )


def check_reach(chain: LinkChain, path: Array, step: Array, zone: float) -> None:
    """Check that the arm can reach each point of the path, and come to it in one step."""
    column = chain.points(np.zeros((1, len(step))))[0, int(chain.links[0, 0])]
    reach = float(chain.arms.max()) + zone
    distances = np.linalg.norm(path - column, axis=1)
    if distances.max() > reach:
        k = int(np.argmax(distances > reach))
        expected = f"at most {reach:.4g} cm, the reach of the arm"
        found = f"{_place(path[k])} cm, {distances[k]:.4g} cm from the first link"
        raise InvalidTask(f"path[{k}]", found, expected)
    longest = float((chain.arms[-1] * step).sum()) + zone
    spacings = np.linalg.norm(np.diff(path, axis=0), axis=1)
    if spacings.max() > longest:
        k = int(np.argmax(spacings > longest)) + 1
        expected = f"at most {longest:.4g} cm, the tip's way in one step; more steps would do"
        raise InvalidTask(f"path[{k}]", f"{spacings[k - 1]:.4g} cm from the one before", expected)


def _place(point: Array) -> str:
    return f"({', '.join(f'{x:.5g}' for x in point)})"
