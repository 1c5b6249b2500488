"""The inverse-dynamics kernel: laws of mechanics, blocks, and its machine code."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numba import njit
from numpy.typing import NDArray

from tramnet_workers.kernels import dynamics
from tramnet_workers.kernels.dynamics import (
    LANES,
    dynamics_workspace,
    inverse_dynamics,
    inverse_dynamics_batch,
)
from tramnet_workers.robots.puma560 import akb

Array = NDArray[np.float64]

ARM = akb()
N = ARM.n_joints

PACKED_PRODUCT = re.compile(r"\bv?mulpd\b|\bfmul\s+v\d+\.2d")
LIBM = re.compile(
    r"\b(sin|cos|tan|sincos|atan2?|log|floor|exp|pow|rint|fma|hypot|fmod|ldexp|frexp)f?\b"
)

states = arrays(np.float64, (3, N), elements=st.floats(-10.0, 10.0, allow_subnormal=False))


def torques(q: Array, qd: Array, qdd: Array) -> Array:
    return inverse_dynamics_batch(ARM.table, ARM.gravity, q, qd, qdd)


def torque(q: Array, qd: Array, qdd: Array) -> Array:
    return torques(q[None], qd[None], qdd[None])[0]


def random_states(k: int, seed: int) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(seed)
    return (
        rng.uniform(-np.pi, np.pi, (k, N)),
        rng.uniform(-5.0, 5.0, (k, N)),
        rng.uniform(-30.0, 30.0, (k, N)),
    )


def mass_matrix(q: Array) -> Array:
    rest = torque(q, np.zeros(N), np.zeros(N))
    columns = torques(np.tile(q, (N, 1)), np.zeros((N, N)), np.eye(N)) - rest
    return columns.T


@given(states)
def test_torque_is_affine_in_acceleration(state: Array) -> None:
    q, qd, qdd = state
    still = torque(q, qd, np.zeros(N))

    once = torque(q, qd, qdd) - still
    twice = torque(q, qd, 2.0 * qdd) - still

    assert twice == pytest.approx(2.0 * once, abs=1e-10 * (1.0 + np.abs(still).max()))


@given(states)
def test_torque_of_motion_alone_is_quadratic_in_velocity(state: Array) -> None:
    q, qd, _ = state
    gravity = torque(q, np.zeros(N), np.zeros(N))

    once = torque(q, qd, np.zeros(N)) - gravity
    back_at_double = torque(q, -2.0 * qd, np.zeros(N)) - gravity

    assert back_at_double == pytest.approx(4.0 * once, abs=1e-10 * (1.0 + np.abs(once).max()))


@given(states)
def test_the_mass_matrix_is_symmetric_and_positive_definite(state: Array) -> None:
    inertia = mass_matrix(state[0])

    assert inertia == pytest.approx(inertia.T, abs=1e-12)
    assert np.linalg.eigvalsh(inertia).min() > 0.0


@given(states)
def test_the_power_of_the_torques_is_the_change_of_kinetic_and_potential_energy(
    state: Array,
) -> None:
    q, qd, qdd = state
    h = 1e-5

    power = qd @ torque(q, qd, qdd)
    forth = kinetic_energy(q + h * qd, qd + h * qdd)
    back = kinetic_energy(q - h * qd, qd - h * qdd)
    lifting = qd @ torque(q, np.zeros(N), np.zeros(N))

    scale = 1.0 + np.abs(qd) @ np.abs(torque(q, qd, qdd))
    assert power == pytest.approx((forth - back) / (2.0 * h) + lifting, abs=1e-6 * scale)


def kinetic_energy(q: Array, qd: Array) -> float:
    return float(0.5 * qd @ mass_matrix(q) @ qd)


@pytest.mark.parametrize("count", [1, LANES - 1, LANES, LANES + 1, 3 * LANES + 5])
def test_torques_are_the_same_to_the_bit_wherever_a_state_stands(count: int) -> None:
    q, qd, qdd = random_states(count, seed=count)
    order = np.random.default_rng(0).permutation(count)

    together = torques(q, qd, qdd)
    alone = np.array([torque(*state) for state in zip(q, qd, qdd, strict=True)])
    shuffled = torques(q[order], qd[order], qdd[order])

    assert together.tobytes() == alone.tobytes()
    assert shuffled.tobytes() == together[order].tobytes()


def test_torques_do_not_depend_on_the_neighbours_in_a_block() -> None:
    q, qd, qdd = random_states(LANES, seed=1)
    alone = torque(q[0], qd[0], qdd[0])
    q[1:], qd[1:], qdd[1:] = np.nan, np.inf, -np.inf

    beside_nonsense = torques(q, qd, qdd)[0]

    assert beside_nonsense.tobytes() == alone.tobytes()


def test_a_block_gives_what_the_batch_gives() -> None:
    q, qd, qdd = random_states(LANES, seed=2)
    block = [np.ascontiguousarray(values.T) for values in (q, qd, qdd)]
    tau = np.empty((N, LANES))

    inverse_dynamics(ARM.table, ARM.gravity, *block, tau, dynamics_workspace(N))

    assert tau.T.tobytes() == torques(q, qd, qdd).tobytes()


def test_a_workspace_carries_nothing_from_call_to_call() -> None:
    q, qd, qdd = random_states(LANES, seed=3)
    block = [np.ascontiguousarray(values.T) for values in (q, qd, qdd)]
    tau = np.empty((N, LANES))
    work = dynamics_workspace(N)
    work[:] = np.nan

    inverse_dynamics(ARM.table, ARM.gravity, *block, tau, work)

    assert tau.T.tobytes() == torques(q, qd, qdd).tobytes()


def test_the_recursion_is_vectorised_and_calls_no_mathematics() -> None:
    compiled = njit(error_model="numpy")(inverse_dynamics.py_func)  # type: ignore[attr-defined]
    block = np.zeros((N, LANES))
    work = dynamics_workspace(N)
    compiled(np.array(ARM.table), np.array(ARM.gravity), block, block, block, block.copy(), work)

    (code,) = compiled.inspect_asm().values()

    # The two loops have 166 products, those of sine and cosine included.
    assert len(PACKED_PRODUCT.findall(code)) >= 150
    assert not LIBM.search(code)


def test_an_arm_of_one_joint_is_a_pendulum() -> None:
    mass, length, inertia, armature = 2.0, 0.5, 0.03, 0.1
    table = np.zeros((1, dynamics.ARM_COLUMNS))
    table[0, : dynamics.TRANSLATION] = np.eye(3).reshape(-1)
    table[0, dynamics.MASS], table[0, dynamics.CENTRE] = mass, length
    table[0, dynamics.INERTIA + 5], table[0, dynamics.ARMATURE] = inertia, armature
    gravity = np.array([0.0, -9.81, 0.0])
    q, qd, qdd = np.array([[0.3]]), np.array([[2.0]]), np.array([[5.0]])

    tau = inverse_dynamics_batch(table, gravity, q, qd, qdd)

    expected = (mass * length**2 + inertia + armature) * 5.0 + mass * 9.81 * length * np.cos(0.3)
    assert tau[0, 0] == pytest.approx(expected, rel=1e-14)
