"""Tracking tasks as kernels see them, and what a step costs.

Lin, Chen & Yu (2017): at point k of the path, an individual is a change dq of the joint angles with
|dq_j| <= M_j. Its cost is c = w1 Phi1 + w2 Phi2 with Phi1 = e²/2 (eq. 10) of the distance e of the
tip from the point and Phi2 = 1/d² (eq. 12) of the clearance d between arm and boxes. An individual
with e > rho, outside the *permissible zone* (eq. 16), ranks after every one inside, by e alone.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device
from tramnet_workers.kernels.kinematics import Chain

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Clearance below which Phi2 no longer grows [cm].
LEAST_CLEARANCE = 1e-3

# Cost per centimetre outside the zone.
_VIOLATION = 1e3

# Two errors nearer to each other than this may have the same cost after rounding.
_SAME = 1.0 + 1e-9


class Objective(NamedTuple):
    """What a step is to achieve.

    Attributes:
        radius: Radius of all links [cm].
        zone: Radius rho of the permissible zone [cm].
        error_weight: w1 [1/cm²].
        clearance_weight: w2 [cm²].
    """

    radius: float
    zone: float
    error_weight: float
    clearance_weight: float


class Scene(NamedTuple):
    """A tracking task, as kernels see it.

    Attributes:
        chain: The arm.
        links: Points at the ends of each link, of shape (n_links, 2).
        swings: Longest way of any point of a link in one step, of shape (n_links,) [cm].
        boxes: Boxes (lower x, y, z, upper x, y, z), of shape (n_boxes, 6) [cm].
        targets: Points of the path, the start first, of shape (n_steps + 1, 3) [cm].
        step: Largest change M of each joint in a step, of shape (n,) [rad].
        lower: Smallest joint angles, of shape (n,) [rad].
        upper: Largest joint angles, of shape (n,) [rad].
        n_moving: Number of joints, from the base, that can move a point of the arm.
        objective: What each step is to achieve.
    """

    chain: Chain
    links: Indices
    swings: Array
    boxes: Array
    targets: Array
    step: Array
    lower: Array
    upper: Array
    n_moving: int
    objective: Objective


@device
def step_cost(objective: Objective, squared_error: float, squared_distance: float) -> float:
    """Return the cost of a candidate.

    Args:
        objective: What a step is to achieve.
        squared_error: e² [cm²].
        squared_distance: Squared distance of the links' axes from the boxes [cm²].
    """
    clearance = max(np.sqrt(squared_distance) - objective.radius, LEAST_CLEARANCE)
    inside = 0.5 * objective.error_weight * squared_error + objective.clearance_weight / (
        clearance * clearance
    )
    outside = worst_inside(objective) + _VIOLATION * (np.sqrt(squared_error) - objective.zone)
    return float(inside if squared_error <= objective.zone * objective.zone else outside)


@device
def error_limit(objective: Objective, cost: float) -> float:
    """Return a squared error beyond which a candidate costs more than this, rounding included."""
    beyond = (cost - worst_inside(objective)) / _VIOLATION
    reach = objective.zone + max(beyond, 0.0)
    return reach * reach * _SAME if beyond >= 0.0 else objective.zone * objective.zone


@device
def worst_inside(objective: Objective) -> float:
    """Return a cost that none within the zone exceeds: that of the zone's rim, in collision."""
    zone, least = objective.zone * objective.zone, LEAST_CLEARANCE * LEAST_CLEARANCE
    return 0.5 * objective.error_weight * zone + objective.clearance_weight / least
