"""Elementary functions of our own: the same bits on every processor, and loops that vectorise.

The C library's versions differ between releases and processors, so kernels call none of them. All
functions here are branch-free, in a fixed order of operations, with an error below one unit in the
last place (ulp) over the stated range. The polynomials are those of FreeBSD's msun (Sun
Microsystems 1993, ``k_sin.c``, ``k_cos.c``, ``s_atan.c``, ``e_log.c``).
"""

from typing import NamedTuple

from tramnet_workers.kernels import device

# Adding and subtracting 1.5 * 2**52 rounds a double of less than 2**51 to the nearest integer.
_ROUNDER = 6755399441055744.0

# pi / 2 in parts of 36, 36 and 53 bits: a product of one of the first two with an integer below
# 2**17 is exact, and the whole is off by 2**-130.
_TWO_OVER_PI = float.fromhex("0x1.45f306dc9c883p-1")
_HALF_PI_1 = float.fromhex("0x1.921fb54440000p+0")
_HALF_PI_2 = float.fromhex("0x1.68c234c4c0000p-39")
_HALF_PI_3 = float.fromhex("0x1.98a2e03707345p-77")

_S1 = -1.66666666666666324348e-01
_S2 = 8.33333333332248946124e-03
_S3 = -1.98412698298579493134e-04
_S4 = 2.75573137070700676789e-06
_S5 = -2.50507602534068634195e-08
_S6 = 1.58969099521155010221e-10

_C1 = 4.16666666666666019037e-02
_C2 = -1.38888888888741095749e-03
_C3 = 2.48015872894767294178e-05
_C4 = -2.75573143513906633035e-07
_C5 = 2.08757232129817482790e-09
_C6 = -1.13596475577881948265e-11


class SineCosine(NamedTuple):
    """Sine and cosine of one angle."""

    sine: float
    cosine: float


@device
def sincos(x: float) -> SineCosine:
    """Return the sine and the cosine of an angle.

    Args:
        x: Angle in [-1e5, 1e5] [rad]; beyond it the error grows.

    Returns:
        Both, each less than 1 ulp from the exact value.
    """
    # x = n pi/2 + r + tail. No double of the range is nearer to a multiple than 2**-60.5 (found by
    # trying all n), so the 2**-130 n that is lost does not show.
    n = (x * _TWO_OVER_PI + _ROUNDER) - _ROUNDER
    r1 = x - n * _HALF_PI_1
    part = n * _HALF_PI_2
    r2 = r1 - part
    rest = n * _HALF_PI_3 - ((r1 - r2) - part)
    r = r2 - rest
    tail = (r2 - r) - rest

    s = _sine_near_zero(r, tail)
    c = _cosine_near_zero(r, tail)

    # Quadrants 0, 1, 2, 3 give (s, c), (c, -s), (-s, -c), (-c, s).
    swapped = n != 2.0 * _half(n)
    sign_s = _alternating(_half(n))
    sign_c = _alternating(_half(n + 1.0))
    return SineCosine(sign_s * (c if swapped else s), sign_c * (s if swapped else c))


@device
def _half(n: float) -> float:
    """Return half of a whole number, rounded down."""
    return (0.5 * n - 0.25 + _ROUNDER) - _ROUNDER


@device
def _alternating(n: float) -> float:
    """Return 1 for even and -1 for odd whole numbers."""
    return 1.0 - 2.0 * (n - 2.0 * _half(n))


@device
def _sine_near_zero(x: float, tail: float) -> float:
    """Return sin(x + tail) for |x| <= pi/4."""
    z = x * x
    v = z * x
    p = _S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))
    return x - ((z * (0.5 * tail - v * p) - tail) - v * _S1)


@device
def _cosine_near_zero(x: float, tail: float) -> float:
    """Return cos(x + tail) for |x| <= pi/4."""
    z = x * x
    p = z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6)))))
    half_z = 0.5 * z
    w = 1.0 - half_z
    return w + (((1.0 - w) - half_z) + (z * p - x * tail))
