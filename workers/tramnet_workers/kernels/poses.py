"""The most dexterous pose of a planar three-link arm at a point, by exact search.

With given link lengths the arm has one degree of freedom left at a point: where joint 2 stands, and
on which side the elbow is. The dexterity along it is smooth but has several maxima, so it is sampled
all around and the best sample of each elbow is refined by golden section (Kiefer 1953).
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.transforms import atan2, sincos

Floats = NDArray[np.float64]

_GOLDEN = 0.6180339887498949
_UNREACHABLE = -1.0


@kernel
def best_poses(
    lengths: Floats,
    points: Floats,
    lower: Floats,
    upper: Floats,
    samples: int,
    steps: int,
    poses: Floats,
    dexterity: Floats,
) -> None:
    """Find the most dexterous poses within joint limits.

    One point costs 2 (samples + steps + 2) evaluations of the dexterity.

    Args:
        lengths: Link lengths, of shape (3,) [m].
        points: Points relative to the base, of shape (t, 2) [m].
        lower: Smallest joint angles, of shape (3,) [rad].
        upper: Largest joint angles, of shape (3,) [rad].
        samples: Number of samples of the first angle.
        steps: Steps of golden section, each of which shrinks the range by 0.618.
        poses: Receives the joint angles, of shape (t, 3) [rad].
        dexterity: Receives DM, of shape (t,); -1 where the arm does not reach.
    """
    trial, limits = np.empty(3), np.empty((2, 3))
    limits[0], limits[1] = lower, upper
    sector = 2.0 * np.pi / samples
    for i in range(len(points)):
        dexterity[i] = _UNREACHABLE
        poses[i] = 0.0
        for side in range(2):
            elbow = 1.0 - 2.0 * side
            best, centre = _UNREACHABLE, 0.0
            for k in range(samples):
                angle = -np.pi + sector * k
                found = _dexterity(lengths, points[i], limits, elbow, angle, trial)
                if found > best:
                    best, centre = found, angle
            if best > _UNREACHABLE:
                angle = _refine(lengths, points[i], limits, elbow, centre, sector, steps, trial)
                refined = _dexterity(lengths, points[i], limits, elbow, angle, trial)
                if refined < best:
                    refined = _dexterity(lengths, points[i], limits, elbow, centre, trial)
                if refined > dexterity[i]:
                    dexterity[i] = refined
                    poses[i] = trial


@kernel
def _refine(
    lengths: Floats,
    point: Floats,
    limits: Floats,
    elbow: float,
    centre: float,
    half: float,
    steps: int,
    trial: Floats,
) -> float:
    """Return the best first angle within half a range of a centre."""
    low, high = centre - half, centre + half
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_a = _dexterity(lengths, point, limits, elbow, a, trial)
    at_b = _dexterity(lengths, point, limits, elbow, b, trial)
    for _ in range(steps - 1):
        if at_a >= at_b:
            high, b, at_b = b, a, at_a
            a = high - _GOLDEN * (high - low)
            at_a = _dexterity(lengths, point, limits, elbow, a, trial)
        else:
            low, a, at_a = a, b, at_b
            b = low + _GOLDEN * (high - low)
            at_b = _dexterity(lengths, point, limits, elbow, b, trial)
    return 0.5 * (low + high)


@kernel
def _dexterity(
    lengths: Floats, point: Floats, limits: Floats, elbow: float, angle: float, pose: Floats
) -> float:
    """Return DM with joint 1 at an angle and set the pose; -1 if the point or a limit forbids it."""
    s, c = sincos(angle)
    x, y = point[0] - lengths[0] * c, point[1] - lengths[0] * s  # from joint 2 to the point
    square = x * x + y * y
    distance = np.sqrt(square)
    if not abs(lengths[1] - lengths[2]) <= distance <= lengths[1] + lengths[2] or distance == 0.0:
        return _UNREACHABLE
    along = (lengths[1] * lengths[1] - lengths[2] * lengths[2] + square) / (2.0 * distance)
    aside = elbow * np.sqrt(max(0.0, lengths[1] * lengths[1] - along * along))
    u, v = (along * x + aside * y) / distance, (along * y - aside * x) / distance  # link 2
    p, q = x - u, y - v  # link 3, the lever of joint 3
    pose[0] = atan2(s, c)
    pose[1] = atan2(c * v - s * u, c * u + s * v)
    pose[2] = atan2(u * q - v * p, u * p + v * q)
    for k in range(3):
        if not limits[0, k] <= pose[k] <= limits[1, k]:
            return _UNREACHABLE
    first = point[0] * y - point[1] * x
    second = point[0] * q - point[1] * p
    third = x * q - y * p
    total = lengths[0] + lengths[1] + lengths[2]
    return float(np.sqrt(first * first + second * second + third * third) / (total * total))  # eq 5
