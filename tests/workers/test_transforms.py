"""The elementary functions against exact values, from decimal arithmetic and extended precision."""

import re
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.transforms import atan2, log, sincos

Array = NDArray[np.float64]

PI = Decimal(
    "3.14159265358979323846264338327950288419716939937510582097494459230781640628620899863"
)
SAMPLES = 400_000

PACKED_PRODUCT = re.compile(r"\bv?mulpd\b|\bfmul\s+v\d+\.2d")
LIBM = re.compile(
    r"\b(sin|cos|tan|sincos|atan2?|log|floor|exp|pow|rint|fma|hypot|fmod|ldexp|frexp)f?\b"
)

angles = st.floats(-1e5, 1e5, allow_subnormal=False)
lengths = st.floats(1e-200, 1e200).flatmap(lambda size: st.sampled_from([size, -size]))


@kernel
def all_sincos(x: Array, out: Array) -> None:
    for i in range(x.shape[0]):
        out[0, i], out[1, i] = sincos(x[i])


@kernel
def all_atan2(y: Array, x: Array, out: Array) -> None:
    for i in range(x.shape[0]):
        out[i] = atan2(y[i], x[i])


@kernel
def all_log(x: Array, out: Array) -> None:
    for i in range(x.shape[0]):
        out[i] = log(x[i])


def exact_sine(x: Decimal) -> Decimal:
    """Sum the Taylor series at the angle brought into [-pi, pi], in the context's precision."""
    x = x - 2 * PI * (x / (2 * PI)).to_integral_value()
    total = term = x
    n = 1
    while abs(term) > Decimal(10) ** -60:
        term *= -x * x / ((n + 1) * (n + 2))
        n += 2
        total += term
    return total


def ulps_off(found: float, exact: Decimal) -> float:
    return float(abs(Decimal(found) - exact) / Decimal(float(np.spacing(abs(float(exact))))))


def largest_error(found: Array, exact: NDArray[np.longdouble]) -> float:
    """Return the largest error in units of the last place of the exact value."""
    spacing = np.spacing(np.abs(exact.astype(np.float64)))
    return float(np.max(np.abs(found - exact) / spacing))


@given(angles)
def test_sine_and_cosine_are_within_one_ulp_of_the_exact_values(x: float) -> None:
    sine, cosine = sincos(x)

    with localcontext() as context:
        context.prec = 80
        assert ulps_off(sine, exact_sine(Decimal(x))) < 1.0
        assert ulps_off(cosine, exact_sine(Decimal(x) + PI / 2)) < 1.0


@pytest.mark.parametrize("n", [1, 2, 3, 4, 29, 58, 116, 232, 464, 4321, 63661])
def test_sine_and_cosine_are_exact_next_to_multiples_of_a_right_angle(n: int) -> None:
    with localcontext() as context:
        context.prec = 80
        x = float(n * PI / 2)

        sine, cosine = sincos(x)

        assert ulps_off(sine, exact_sine(Decimal(x))) < 1.0
        assert ulps_off(cosine, exact_sine(Decimal(x) + PI / 2)) < 1.0


@pytest.mark.parametrize("reach", [0.8, 4.0, 1e3, 1e5])
def test_many_sines_and_cosines_agree_with_extended_precision(reach: float) -> None:
    x = np.random.default_rng(1).uniform(-reach, reach, SAMPLES)
    out = np.empty((2, SAMPLES))

    all_sincos(x, out)

    assert largest_error(out[0], np.sin(x.astype(np.longdouble))) < 1.0
    assert largest_error(out[1], np.cos(x.astype(np.longdouble))) < 1.0


@given(angles)
def test_sine_is_odd_and_cosine_even_to_the_bit(x: float) -> None:
    assert sincos(-x).sine == -sincos(x).sine
    assert sincos(-x).cosine == sincos(x).cosine


@given(lengths, lengths)
def test_the_angle_of_a_point_is_within_one_ulp_of_extended_precision(y: float, x: float) -> None:
    found = np.array([atan2(y, x)])

    assert largest_error(found, np.arctan2([np.longdouble(y)], [np.longdouble(x)])) < 1.0


@pytest.mark.parametrize("ratio", [0.4375, 0.6875, 1.0, 16 / 7, 16 / 11, 1e-3, 1e3])
def test_angles_stay_accurate_where_the_formula_changes(ratio: float) -> None:
    rng = np.random.default_rng(2)
    x = rng.uniform(-1.0, 1.0, SAMPLES)
    y = x * rng.choice([-ratio, ratio], SAMPLES) * rng.uniform(0.99, 1.01, SAMPLES)
    out = np.empty(SAMPLES)

    all_atan2(y, x, out)

    assert largest_error(out, np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble))) < 1.0


@pytest.mark.parametrize(
    ("y", "x", "angle"),
    [
        (0.0, 0.0, 0.0),
        (0.0, 2.0, 0.0),
        (2.0, 0.0, np.pi / 2),
        (-2.0, 0.0, -np.pi / 2),
        (0.0, -2.0, np.pi),
        (-0.0, -2.0, np.pi),
        (2.0, 2.0, np.pi / 4),
        (-2.0, -2.0, -3 * np.pi / 4),
    ],
)
def test_angles_on_the_axes_and_diagonals_are_the_nearest_doubles(
    y: float, x: float, angle: float
) -> None:
    assert atan2(y, x) == angle


@pytest.mark.parametrize("spread", [0.001, 0.5, 300.0])
def test_logarithms_are_within_one_ulp_of_extended_precision(spread: float) -> None:
    x = 10.0 ** np.random.default_rng(3).uniform(-spread, spread, SAMPLES)
    out = np.empty(SAMPLES)

    all_log(x, out)

    assert largest_error(out, np.log(x.astype(np.longdouble))) < 1.0


@given(st.integers(1, 1022), st.sampled_from([-1, 1]))
def test_the_logarithm_of_a_power_of_two_is_within_one_ulp(k: int, sign: int) -> None:
    found = log(2.0 ** (sign * k))

    with localcontext() as context:
        context.prec = 50
        assert ulps_off(found, sign * k * Decimal(2).ln()) < 1.0


def test_the_logarithm_of_one_is_zero() -> None:
    assert log(1.0) == 0.0


@pytest.mark.parametrize(
    ("loop", "n_inputs", "shape"),
    [(all_sincos, 1, (2, 64)), (all_atan2, 2, (64,)), (all_log, 1, (64,))],
)
def test_loops_over_the_functions_are_vectorised_and_call_no_mathematics(
    loop: Any, n_inputs: int, shape: tuple[int, ...]
) -> None:
    compiled = njit(error_model="numpy")(loop.py_func)  # what came from the cache has no listing
    compiled(*[np.linspace(0.1, 1.0, 64)] * n_inputs, np.empty(shape))

    (code,) = compiled.inspect_asm().values()

    assert PACKED_PRODUCT.search(code)
    assert not LIBM.search(code)
