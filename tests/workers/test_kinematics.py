"""Lane-blocked kinematics: the laws of rotations, and one posture against many."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.kinematics import (
    LARGEST_TURN,
    chain_points,
    joint_axes,
    turn_from,
)
from tramnet_workers.kernels.lanes import LANES, new_rows
from tramnet_workers.robots.link_chain import link_chain
from tramnet_workers.robots.redundant8 import redundant8, start_posture

Array = NDArray[np.float64]

postures = hnp.arrays(np.float64, (8,), elements=st.floats(-3.1, 3.1))


@kernel
def turned(sine: float, cosine: float, dq: Array) -> Array:
    turn = new_rows(1, 2)[0]
    turn_from(sine, cosine, dq, turn)
    return turn


@given(st.floats(-10.0, 10.0), st.floats(-LARGEST_TURN, LARGEST_TURN))
def test_a_turn_by_a_sum_is_the_turn_of_the_sum(q: float, change: float) -> None:
    turn = turned(float(np.sin(q)), float(np.cos(q)), np.full(LANES, change))

    np.testing.assert_allclose(turn[:LANES], np.sin(q + change), rtol=0.0, atol=2e-15)
    np.testing.assert_allclose(turn[LANES:], np.cos(q + change), rtol=0.0, atol=2e-15)


@given(hnp.arrays(np.float64, (LANES + 3, 8), elements=st.floats(-3.1, 3.1)))
def test_the_points_of_a_posture_do_not_depend_on_its_place(q: Array) -> None:
    chain = link_chain(redundant8()).chain

    together = chain_points(chain, q)

    alone = np.concatenate([chain_points(chain, posture[None].copy()) for posture in q])
    np.testing.assert_array_equal(together, alone)


@given(postures)
def test_the_points_of_one_posture_are_those_of_a_block(q: Array) -> None:
    chain = link_chain(redundant8()).chain
    axes, points = np.empty((8, 3)), np.empty((9, 3))

    joint_axes(chain, q, axes, points)

    np.testing.assert_allclose(points, chain_points(chain, q[None].copy())[0], atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-14)


@given(postures)
def test_links_keep_their_lengths(q: Array) -> None:
    chain = link_chain(redundant8()).chain

    points = chain_points(chain, q[None].copy())[0]

    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    np.testing.assert_allclose(lengths, [15.0, 27.5, 0.0, 40.0, 17.0, 34.0, 0.0, 24.0], atol=1e-12)


def test_a_joint_s_axis_is_the_derivative_of_the_tip() -> None:
    chain, q = link_chain(redundant8()).chain, start_posture()
    axes, points, step = np.empty((8, 3)), np.empty((9, 3)), 1e-6

    joint_axes(chain, q, axes, points)

    for j in range(8):
        ahead, behind = q.copy(), q.copy()
        ahead[j] += step
        behind[j] -= step
        tips = chain_points(chain, np.stack([ahead, behind]))[:, -1]
        slope = (tips[0] - tips[1]) / (2 * step)
        np.testing.assert_allclose(np.cross(axes[j], points[-1] - points[j]), slope, atol=1e-7)
