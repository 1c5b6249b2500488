"""Arms from the rows of a Denavit-Hartenberg table, as papers print them, some without a joint."""

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.robots.arm import STANDARD_GRAVITY, SerialArm

Array = NDArray[np.float64]

DhRow = tuple[float, float, float, float]

_QUARTERS = ((0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0))


def arm_from_dh_rows(
    name: str, rows: Sequence[DhRow], fixed_rows: Collection[int] = ()
) -> SerialArm:
    """Build an arm without masses from a standard (distal) Denavit-Hartenberg table.

    Row i is the transform Rz(theta + q) Tz(d) Tx(a) Rx(alpha), with q left out in a fixed row, such
    as the column on which an arm stands. The tool frame is that of the last row.

    Args:
        name: What reports call the arm.
        rows: (theta [deg], d [m], a [m], alpha [deg]) of each row, from the base.
        fixed_rows: Indices of the rows without a joint.

    Returns:
        An arm with a joint in every other row, no limits and no mass.
    """
    placements: list[Array] = []
    rest = np.eye(4)  # what lies between the last joint and the next one
    for i, row in enumerate(rows):
        if i not in fixed_rows:
            placements.append(rest)
            rest = np.eye(4)
        rest = rest @ _fixed_part(row)
    return _massless(name, np.array(placements).reshape(-1, 4, 4), tool=rest)


def _fixed_part(row: DhRow) -> Array:
    theta, d, a, alpha = row
    turned = np.eye(4)
    s, c = _sine_cosine(theta)
    turned[:2, :2] = [[c, -s], [s, c]]
    twisted = np.eye(4)
    s, c = _sine_cosine(alpha)
    twisted[1:3, 1:3] = [[c, -s], [s, c]]
    twisted[:3, 3] = (a, 0.0, d)
    return turned @ twisted


def _sine_cosine(degrees: float) -> tuple[float, float]:
    """Return sine and cosine, exact for whole quarter turns."""
    quarters = degrees / 90.0
    if quarters == round(quarters):
        return _QUARTERS[round(quarters) % 4]
    return float(np.sin(np.radians(degrees))), float(np.cos(np.radians(degrees)))


def _massless(name: str, placements: Array, *, tool: Array) -> SerialArm:
    n = len(placements)
    return SerialArm(
        name=name,
        joint_names=tuple(f"joint{i + 1}" for i in range(n)),
        rotation=placements[:, :3, :3],
        translation=placements[:, :3, 3],
        mass=np.zeros(n),
        com=np.zeros((n, 3)),
        inertia=np.zeros((n, 3, 3)),
        armature=np.zeros(n),
        position_lower=np.full(n, -np.inf),
        position_upper=np.full(n, np.inf),
        torque_limits=np.full(n, np.inf),
        velocity_limits=np.full(n, np.inf),
        gravity=np.array(STANDARD_GRAVITY),
        tool=tool,
    )
