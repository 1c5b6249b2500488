"""The arm of Lin, Chen & Yu (2017) against the printed numbers and against Pinocchio."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.dh_rows import arm_from_dh_rows
from tramnet_workers.robots.link_chain import link_chain
from tramnet_workers.robots.pinocchio_bridge import tool_position
from tramnet_workers.robots.redundant8 import redundant8, start_posture

Array = NDArray[np.float64]

angles = st.floats(-3.1, 3.1)
lengths = st.floats(-0.5, 0.5)
degrees = st.floats(-180.0, 180.0)
dh_rows = st.tuples(degrees, lengths, lengths, degrees | st.sampled_from([0.0, 90.0, -90.0]))


def tip(arm: SerialArm, q: Array) -> Array:
    return link_chain(arm).points(q[None])[0, -1]


def test_the_tip_starts_where_the_paper_says() -> None:
    # Table 3 prints (17.0, 57.6, 30.5); what is lost is rounding.
    np.testing.assert_allclose(tip(redundant8(), start_posture()), [17.0, 57.6, 30.5], atol=0.0482)


def test_the_joints_start_on_the_recovered_points() -> None:
    points = link_chain(redundant8()).points(start_posture()[None])[0]

    expected = {
        1: (0.0, 0.0, 43.0),
        2: (0.0, 26.683, 49.653),
        4: (0.0, 44.218, 85.605),
        5: (17.0, 44.218, 85.605),
        6: (17.0, 58.047, 54.544),
        8: (17.0, 57.628, 30.548),
    }
    for i, point in expected.items():
        np.testing.assert_allclose(points[i], point, atol=1e-3)


def test_the_printed_sign_of_q5_and_tool_miss_by_a_metre() -> None:
    posture = start_posture()
    posture[4] = -posture[4]

    assert np.linalg.norm(tip(redundant8(0.2), posture) - [17.0, 57.6, 30.5]) > 100.0


def test_a_tool_lengthens_the_last_link() -> None:
    np.testing.assert_allclose(
        tip(redundant8(0.2), start_posture()), [17.0, 57.28, 10.55], atol=0.005
    )


@given(st.lists(angles, min_size=8, max_size=8))
def test_kinematics_agree_with_pinocchio(posture: list[float]) -> None:
    q = np.array(posture)

    np.testing.assert_allclose(
        tip(redundant8(), q) / 100.0, tool_position(redundant8(), q), rtol=0.0, atol=1e-14
    )


@given(
    st.lists(dh_rows, min_size=3, max_size=8),
    st.sets(st.integers(0, 1)),
    st.lists(angles, min_size=8, max_size=8),
)
def test_kinematics_of_any_table_agree_with_pinocchio(
    rows: list[tuple[float, float, float, float]], fixed: set[int], posture: list[float]
) -> None:
    arm = arm_from_dh_rows("any", rows, fixed)
    q = np.array(posture[: arm.n_joints])

    np.testing.assert_allclose(tip(arm, q) / 100.0, tool_position(arm, q), rtol=0.0, atol=1e-12)


def test_only_the_last_joint_of_the_arm_moves_nothing() -> None:
    assert link_chain(redundant8()).inert.tolist() == [False] * 7 + [True]


def test_a_bent_tool_leaves_no_joint_inert() -> None:
    rows = [(0.0, 0.3, 0.0, 90.0), (0.0, 0.2, 0.0, -90.0), (0.0, 0.2, 0.1, 0.0)]

    assert not link_chain(arm_from_dh_rows("bent", rows)).inert.any()


def test_joints_on_one_axis_with_the_tip_are_inert_together() -> None:
    rows = [(0.0, 0.3, 0.0, 90.0), (0.0, 0.2, 0.0, 0.0), (0.0, 0.2, 0.0, 0.0)]

    assert link_chain(arm_from_dh_rows("stick", rows)).inert.tolist() == [False, True, True]


@given(st.lists(angles, min_size=8, max_size=8), st.floats(-3.0, 3.0))
def test_an_inert_joint_moves_no_point(posture: list[float], turn: float) -> None:
    chain, q = link_chain(redundant8()), np.array(posture)
    turned = q + turn * chain.inert

    np.testing.assert_array_equal(chain.points(q[None]), chain.points(turned[None]))


def test_the_column_is_no_link() -> None:
    chain = link_chain(redundant8())

    assert chain.links.tolist() == [[1, 2], [3, 4], [4, 5], [5, 6], [7, 8]]


@given(st.lists(angles, min_size=8, max_size=8), st.lists(angles, min_size=8, max_size=8))
def test_no_point_of_a_link_swings_farther_than_its_arms_allow(
    before: list[float], change: list[float]
) -> None:
    chain, q, dq = link_chain(redundant8()), np.array(before), np.array(change) / 10.0
    first, then = chain.points(np.stack([q, q + dq]))

    swings = chain.arms @ np.abs(dq)

    moved = np.linalg.norm(then - first, axis=1)
    assert (moved[chain.links].max(axis=1) <= swings + 1e-9).all()


@pytest.mark.parametrize("field", ["links", "inert", "arms"])
def test_a_chain_cannot_be_changed(field: str) -> None:
    assert not getattr(link_chain(redundant8()), field).flags.writeable
