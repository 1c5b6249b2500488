"""The arm with eight joints of Lin, Chen & Yu (2017), its line and its obstacle.

Lengths here are in metres, as in all arms; the paper writes "(mm)" once, but its numbers only make
sense as centimetres. Two departures from print, without which the forward kinematics misses the
printed r(0) = (17.0, 57.6, 30.5) by a metre: q5(0) is +50 instead of -50 degrees, and the tool has
no length beyond d8 (the printed r_s = (0, 0, 20, 1) goes unused). A search over 2e8 readings of
table 2 found no other one with a single change of sign.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.dh_rows import DhRow, arm_from_dh_rows

#: Table 2: theta [deg], d [m], a [m], alpha [deg]; row 0 is the column, without a joint.
DH_ROWS: tuple[DhRow, ...] = (
    (0.0, 0.28, 0.0, 0.0),
    (0.0, 0.15, 0.0, -76.0),
    (0.0, 0.275, 0.0, 90.0),
    (0.0, 0.0, 0.0, -90.0),
    (0.0, 0.40, 0.0, -90.0),
    (0.0, 0.17, 0.0, -90.0),
    (0.0, 0.34, 0.0, 90.0),
    (0.0, 0.0, 0.0, -90.0),
    (0.0, 0.24, 0.0, 0.0),
)
FIXED_ROWS = (0,)

#: Table 3, with the sign of q5 as the printed r(0) demands it [deg].
START_DEGREES = (0.0, -90.0, -50.0, 0.0, 50.0, 0.0, -25.0, 0.0)

#: Departure and destination, table 3 [cm].
LINE = ((17.0, 57.6, 30.5), (11.0, 110.0, 40.0))

#: The printed top plane (lower x, y, z, upper x, y, z) [cm]. The paper gives no height, and a box
#: that reaches lower than 38.2 cm would have the line itself inside.
TOP_PLANE = (5.0, 50.0, 50.0, 15.0, 100.0, 50.0)


@cache
def redundant8(tool: float = 0.0) -> SerialArm:
    """Return the arm.

    Args:
        tool: Length of a tool beyond d8 [m]; the paper prints 0.2 and uses 0.
    """
    theta, d, a, alpha = DH_ROWS[-1]
    return arm_from_dh_rows(
        "redundant8", (*DH_ROWS[:-1], (theta, d + tool, a, alpha)), fixed_rows=FIXED_ROWS
    )


def start_posture() -> NDArray[np.float64]:
    """Return q(0), of shape (8,) [rad]."""
    return np.radians(START_DEGREES)
