"""Medians of columns of numbers, exactly, without sorting them.

Sorting a hundred numbers takes longer than evaluating a hundred arms. But the first individual, the
elite, often has the median itself, and one pass tells. Else the range of what the median can be is
halved until it is found: doubles keep their order when their bits are read as integers (negative
ones after a flip), and loops over integers that count and take minima vectorise.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel

Floats = NDArray[np.float64]
Keys = NDArray[np.int64]

_TURN = 2.0 * np.pi
_ALL_BUT_SIGN = np.int64(0x7FFFFFFFFFFFFFFF)
_SIGN = np.int64(63)


@device
def wrap(angle: float) -> float:
    """Return an angle of [-pi, pi] that differs by whole turns [rad]."""
    turns: float = np.floor(angle * (1.0 / _TURN) + 0.5)
    return angle - _TURN * turns


@kernel
def lower_median(values: Floats, keys: Keys) -> float:
    """Return the element of rank (m - 1) // 2: a median that some individual really has.

    Args:
        values: Finite numbers, of shape (m,), m >= 1.
        keys: Scratch, of shape (m,).
    """
    rank, guess = (len(values) - 1) // 2, values[0]
    less, not_more = 0, 0
    for j in range(len(values)):
        less += 1 if values[j] < guess else 0
        not_more += 1 if values[j] <= guess else 0
    if less <= rank < not_more:
        return float(guess)
    bits = values.view(np.int64)
    for j in range(len(values)):
        keys[j] = bits[j] ^ ((bits[j] >> _SIGN) & _ALL_BUT_SIGN)
    return _value(_select(keys, rank))


@kernel
def circular_median(angles: Floats, about: float, shifted: Floats, keys: Keys) -> float:
    """Return the median of angles on the circle that is cut open opposite to ``about`` [rad].

    Args:
        angles: Angles, of shape (m,) [rad].
        about: Where the circle is certainly not to be cut [rad].
        shifted: Scratch, of shape (m,).
        keys: Scratch, of shape (m,).
    """
    for j in range(len(angles)):
        shifted[j] = wrap(angles[j] - about)
    return wrap(about + lower_median(shifted, keys))


@kernel
def _select(keys: Keys, rank: int) -> int:
    """Return the element with exactly ``rank`` elements before it in sorted order."""
    low, high = int(keys[0]), int(keys[0])
    for j in range(len(keys)):
        low = min(low, int(keys[j]))
        high = max(high, int(keys[j]))
    while low < high:
        middle = (low & high) + ((low ^ high) >> 1)  # no overflow
        count, below, above = 0, low, high
        for j in range(len(keys)):
            key = int(keys[j])
            small = key <= middle
            count += 1 if small else 0
            below = max(below, key if small else low)
            above = min(above, high if small else key)
        if count > rank:
            high = below
        else:
            low = above
    return low


@kernel
def _value(key: int) -> float:
    scratch = np.empty(1, np.int64)
    scratch[0] = np.int64(key) ^ ((np.int64(key) >> _SIGN) & _ALL_BUT_SIGN)
    return float(scratch.view(np.float64)[0])
