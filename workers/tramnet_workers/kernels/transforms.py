"""Elementary functions of our own: the same bits on every processor, and loops that vectorise.

The C library's versions differ between releases and processors, so kernels call none of them. All
functions here are branch-free, in a fixed order of operations, with an error below one unit in the
last place (ulp) over the stated range. The polynomials are those of FreeBSD's msun (Sun
Microsystems 1993, ``k_sin.c``, ``k_cos.c``, ``s_atan.c``, ``e_log.c``).
"""

from typing import NamedTuple

import numpy as np

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

# atan(1/2), pi/4, pi/2 and pi, with what a double leaves over.
_ATAN_HALF, _ATAN_HALF_REST = 4.63647609000806093515e-01, 2.26987774529616870924e-17
_QUARTER_PI, _QUARTER_PI_REST = 7.85398163397448278999e-01, 3.06161699786838301793e-17
_HALF_PI, _HALF_PI_REST = 1.57079632679489655800e00, 6.12323399573676603587e-17
_PI, _PI_REST = 3.14159265358979311600e00, 1.22464679914735320717e-16

_A0 = 3.33333333333329318027e-01
_A1 = -1.99999999998764832476e-01
_A2 = 1.42857142725034663711e-01
_A3 = -1.11111104054623557880e-01
_A4 = 9.09088713343650656196e-02
_A5 = -7.69187620504482999495e-02
_A6 = 6.66107313738753120669e-02
_A7 = -5.83357013379057348645e-02
_A8 = 4.97687799461593236017e-02
_A9 = -3.65315727442169155270e-02
_A10 = 1.62858201153657823623e-02

# ln 2 in parts of 32 and 53 bits: a product of the first with an exponent is exact.
_LN_2_HIGH, _LN_2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10

_L1 = 6.666666666666735130e-01
_L2 = 3.999999999940941908e-01
_L3 = 2.857142874366239149e-01
_L4 = 2.222219843214978396e-01
_L5 = 1.818357216161805012e-01
_L6 = 1.531383769920937332e-01
_L7 = 1.479819860511658591e-01

_FRACTION_BITS = 52
_FRACTION_MASK = 0xFFFFFFFFFFFFF
_EXPONENT_BIAS = 1023
_BITS_OF_ONE = 0x3FF0000000000000
_SQRT_2 = 1.4142135623730951

# Multiplying by 2**27 + 1 splits a double into halves whose products are exact (Dekker 1971).
_SPLITTER = 134217729.0


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
def atan2(y: float, x: float) -> float:
    """Return the angle of the point (x, y), in [-pi, pi] [rad].

    Zeros have no sign here: ``atan2(-0.0, -1.0)`` is pi, and the origin has the angle 0.

    Args:
        y: Ordinate, zero or of a magnitude in [1e-200, 1e200].
        x: Abscissa, likewise.

    Returns:
        The angle, less than 1 ulp from the exact value.
    """
    steep = abs(y) > abs(x)
    small = abs(x) if steep else abs(y)
    large = max(abs(x), abs(y))
    large = large if large > 0.0 else 1.0

    # atan(small / large) = atan(k) + atan(t), t = (small - k large) / (large + k small), with k = 0,
    # 1/2 or 1 so that |t| < 7/16; top is exact, and bottom + bottom_rest is.
    ratio = small / large
    near = ratio < 0.4375
    middle = ratio < 0.6875
    scaled = 2.0 * large if middle else large
    top = small if near else (2.0 * small - large if middle else small - large)
    bottom = large if near else scaled + small
    bottom_rest = 0.0 if near else small - (bottom - scaled)
    t = top / bottom
    t_rest = (_remainder(top, t, bottom) - t * bottom_rest) / bottom

    # The angle is start + turn * (atan(k) + atan(t)), start being a multiple of pi/2.
    left = x < 0.0
    turn = -1.0 if steep != left else 1.0
    start = _HALF_PI if steep else (_PI if left else 0.0)
    start_rest = _HALF_PI_REST if steep else (_PI_REST if left else 0.0)
    of_k = 0.0 if near else (_ATAN_HALF if middle else _QUARTER_PI)
    of_k_rest = 0.0 if near else (_ATAN_HALF_REST if middle else _QUARTER_PI_REST)
    base = start + turn * of_k
    base_rest = (turn * of_k - (base - start)) + (start_rest + turn * of_k_rest)
    angle = base + (turn * _atan_near_zero(t, t_rest) + base_rest)
    return -angle if y < 0.0 else angle


@device
def log(x: float) -> float:
    """Return the natural logarithm of a normal positive number, less than 1 ulp off."""
    bits = np.float64(x).view(np.int64)
    m = np.int64((bits & _FRACTION_MASK) | _BITS_OF_ONE).view(np.float64)
    k = np.float64((bits >> _FRACTION_BITS) - _EXPONENT_BIAS)
    k = k + 1.0 if m > _SQRT_2 else k
    f = (0.5 * m if m > _SQRT_2 else m) - 1.0  # x = 2**k (1 + f)
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    odd = z * (_L1 + w * (_L3 + w * (_L5 + w * _L7)))
    even = w * (_L2 + w * (_L4 + w * _L6))
    square = 0.5 * f * f
    return k * _LN_2_HIGH - ((square - (s * (square + (odd + even)) + k * _LN_2_LOW)) - f)


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


@device
def _atan_near_zero(t: float, rest: float) -> float:
    """Return atan(t + rest) for |t| < 7/16."""
    z = t * t
    w = z * z
    odd = z * (_A0 + w * (_A2 + w * (_A4 + w * (_A6 + w * (_A8 + w * _A10)))))
    even = w * (_A1 + w * (_A3 + w * (_A5 + w * (_A7 + w * _A9))))
    return t - (t * (odd + even) - rest / (1.0 + z))


@device
def _remainder(product: float, a: float, b: float) -> float:
    """Return product - a b, exact where the two nearly agree (Dekker 1971, section 5)."""
    a_high = a * _SPLITTER - (a * _SPLITTER - a)
    b_high = b * _SPLITTER - (b * _SPLITTER - b)
    a_low = a - a_high
    b_low = b - b_high
    return (((product - a_high * b_high) - a_high * b_low) - a_low * b_high) - a_low * b_low
