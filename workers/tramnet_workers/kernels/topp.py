"""Time-optimal motion along a given path, by reachability (TOPP-RA).

Pham & Pham (2018), "A new approach to time-optimal path parameterization based on reachability
analysis", IEEE T-RO 34(3). Along a path q(s) the joint torques are

    tau = a(s) u + b(s) x + c(s),   x = sd^2,   u = sdd,   dx/ds = 2 u,

and u is constant in each interval of the grid. One pass backwards finds, at each grid point, the
squared speeds x from which the end can still be reached; one pass forwards takes the largest u that
stays among them. Torques are bounded at both ends *and* in the middle of each interval: bounded at
one point only, the result would be faster than the robot (10 % at 100 points, for a search that
learns to exploit it).

Every bound of an interval is a strip ``low + slope x <= u <= high + slope x``. At a given x the
strips leave an interval of u, whose width is concave and piecewise linear in x: Newton's method from
outside finds the ends of the feasible x in a few exact steps, and no linear program is needed.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel

Floats = NDArray[np.float64]

# Torque per path acceleration [N m s^2] that every joint is taken to need: it turns a bound that
# does not depend on u into a (very steep) strip, and is far below what any joint can feel.
_LEAST_INERTIA = 1e-9
_NEWTON_STEPS = 100
_CLOSE = 1e-13  # relative step at which Newton has arrived
_UNLIMITED = 1e12  # squared path speed [1/s^2] beyond which nothing is looked for
_SLOW = 1e-6  # and the one with which the search for a bound begins
_SLOPE, _LOW, _HIGH = 0, 1, 2


@kernel
def time_optimal(
    steps: Floats, a: Floats, b: Floats, c: Floats, limits: Floats, ceiling: Floats, stops: bool
) -> tuple[float, Floats, Floats]:
    """Return the shortest time along a path, from rest, and its speed profile.

    Points of the path are numbered 0..2m: even ones are the ends of the m intervals, odd ones their
    middles.

    Args:
        steps: Lengths of the intervals in s, of shape (m,).
        a: Torques per path acceleration at the points [N m s^2], of shape (2m + 1, n_joints).
        b: Torques per squared path speed [N m s^2], of the same shape.
        c: Torques at rest [N m], of the same shape.
        limits: Symmetric torque bounds of the joints [N m], of shape (n_joints,).
        ceiling: Largest squared path speeds at the points [1/s^2], of shape (2m + 1,); may be inf.
        stops: Whether the motion ends at rest; else its end speed is free.

    Returns:
        The duration [s], or inf where no motion along the path keeps the bounds; the squared path
        speeds at the grid points [1/s^2], of shape (m + 1,); and the path accelerations of the
        intervals [1/s^2], of shape (m,).
    """
    m = len(steps)
    x, u = np.zeros(m + 1), np.zeros(m)
    strips = np.empty((m, 3, 3 * len(limits) + 2))
    lowest, highest = np.zeros(m + 1), np.zeros(m + 1)  # squared speeds the end is reached from
    highest[m] = 0.0 if stops else min(ceiling[2 * m], _UNLIMITED)
    for i in range(m - 1, -1, -1):
        _fill_strips(strips[i], steps[i], 2 * i, a, b, c, limits, ceiling)
        _add_target(strips[i], steps[i], lowest[i + 1], highest[i + 1])
        highest[i] = min(_highest(strips[i], highest[i + 1]), ceiling[2 * i])
        lowest[i] = _lowest(strips[i])
        if not lowest[i] <= highest[i]:
            return np.inf, x, u
    if lowest[0] > 0.0:
        return np.inf, x, u
    return _drive(steps, strips, lowest, highest, x, u), x, u


@device
def _fill_strips(
    strip: Floats,
    step: float,
    first: int,
    a: Floats,
    b: Floats,
    c: Floats,
    limits: Floats,
    ceiling: Floats,
) -> None:
    """Write the strips of an interval's torques, and of the speed in its middle."""
    n = len(limits)
    for k in range(3):
        for j in range(n):
            # x has grown by k step u at this point of the interval.
            inertia = a[first + k, j] + k * step * b[first + k, j]
            inverse = 1.0 / (inertia if abs(inertia) > _LEAST_INERTIA else _LEAST_INERTIA)
            strip[_SLOPE, k * n + j] = -b[first + k, j] * inverse
            strip[_LOW, k * n + j] = -c[first + k, j] * inverse - limits[j] * abs(inverse)
            strip[_HIGH, k * n + j] = -c[first + k, j] * inverse + limits[j] * abs(inverse)
    strip[_SLOPE, 3 * n] = -1.0 / step
    strip[_LOW, 3 * n] = 0.0
    strip[_HIGH, 3 * n] = ceiling[first + 1] / step


@device
def _add_target(strip: Floats, step: float, low: float, high: float) -> None:
    """Write the strip of those u that lead to a squared speed in [low, high] at the next point."""
    last = strip.shape[1] - 1
    strip[_SLOPE, last] = -0.5 / step
    strip[_LOW, last] = 0.5 * low / step
    strip[_HIGH, last] = 0.5 * high / step


@device
def _between(strip: Floats, x: float) -> tuple[float, float, float]:
    """Return the smallest and largest u that a squared speed allows, and how their gap grows."""
    low, high = -np.inf, np.inf
    slope_low, slope_high = 0.0, 0.0
    for k in range(strip.shape[1]):
        slope = strip[_SLOPE, k]
        rise = slope * x
        if strip[_LOW, k] + rise > low:
            low, slope_low = strip[_LOW, k] + rise, slope
        if strip[_HIGH, k] + rise < high:
            high, slope_high = strip[_HIGH, k] + rise, slope
    return low, high, slope_high - slope_low


@kernel
def _highest(strip: Floats, guess: float) -> float:
    """Return the largest squared speed that leaves a feasible u, or -inf."""
    x = guess
    low, high, growth = _between(strip, x)
    # While the gap does not shrink, the feasible speeds end further to the right, if anywhere. One
    # far leap would not do: Newton's rounding is that of the largest speed it has seen.
    while growth >= 0.0 and x < _UNLIMITED:
        x = max(4.0 * x, _SLOW)
        low, high, growth = _between(strip, x)
    for _ in range(_NEWTON_STEPS):
        if growth >= 0.0:
            return x if high >= low else -np.inf
        step = (high - low) / growth
        x -= step
        if abs(step) <= _CLOSE * abs(x):
            break
        low, high, growth = _between(strip, x)
    return x


@kernel
def _lowest(strip: Floats) -> float:
    """Return the smallest squared speed that leaves a feasible u: 0 where the robot can stand."""
    x = 0.0
    for _ in range(_NEWTON_STEPS):
        low, high, growth = _between(strip, x)
        if high >= low:
            break
        if growth <= 0.0:
            return np.inf
        step = (low - high) / growth
        x += step
        if step <= _CLOSE * x:
            break
    return x


@kernel
def _drive(
    steps: Floats, strips: Floats, lowest: Floats, highest: Floats, x: Floats, u: Floats
) -> float:
    """Accelerate as hard as the reachable speeds allow; return the time it takes [s]."""
    duration = 0.0
    for i in range(len(steps)):
        low, high, _ = _between(strips[i], x[i])
        # At an end of the feasible speeds, rounding can leave high a little below low.
        wish = x[i] + 2.0 * steps[i] * (high if high >= low else 0.5 * (low + high))
        x[i + 1] = min(max(wish, lowest[i + 1]), highest[i + 1])
        u[i] = (x[i + 1] - x[i]) / (2.0 * steps[i])
        duration += 2.0 * steps[i] / (np.sqrt(x[i]) + np.sqrt(x[i + 1]))
    return duration
