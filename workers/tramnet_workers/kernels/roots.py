"""Roots that the square root does not give, with the same bits on every processor."""

import numpy as np

from tramnet_workers.kernels import kernel

_THIRD_OF_EXPONENT = np.int64(0x2A9F7893782DA1CE)  # two thirds of the bits of 1.0, less 0.0331


@kernel
def cube_root(x: float) -> float:
    """Return the cube root of a normal number, or of anything below, taken as zero.

    Kahan's first guess divides the exponent by three; Halley's iteration then triples the digits.
    """
    if x < 1e-300:
        return 0.0
    scratch = np.empty(1)
    scratch[0] = x
    bits = scratch.view(np.int64)
    bits[0] = bits[0] // 3 + _THIRD_OF_EXPONENT
    y = scratch[0]
    for _ in range(4):
        cube = y * y * y
        y *= (cube + 2.0 * x) / (2.0 * cube + x)
    return float(y)
