"""Serial arms as values: what they hold, check, and become."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_workers.kernels import dynamics
from tramnet_workers.robots.arm import InvalidArm, SerialArm
from tramnet_workers.robots.denavit_hartenberg import DhLink, modified_dh_arm, standard_dh_arm
from tramnet_workers.robots.puma560 import akb

points = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


def link(alpha: float = 0.0, a: float = 0.0, d: float = 0.0) -> DhLink:
    return DhLink(
        alpha=alpha,
        a=a,
        d=d,
        mass=1.0,
        centre=(0.1, 0.2, 0.3),
        inertia=(0.1, 0.2, 0.25),
        armature=0.5,
        lower=-1.0,
        upper=2.0,
        torque=30.0,
    )


def test_an_arm_s_arrays_are_read_only_copies() -> None:
    mass = np.ones(2)
    two_links = modified_dh_arm("two", [link(), link(a=0.5)])

    arm = replace(two_links, mass=mass)
    mass[0] = 7.0

    assert arm.mass.tolist() == [1.0, 1.0]
    arrays = [getattr(arm, field.name) for field in fields(arm)] + [arm.table]
    assert not any(array.flags.writeable for array in arrays if isinstance(array, np.ndarray))


def test_the_table_has_a_row_per_joint_in_the_kernels_columns() -> None:
    arm = modified_dh_arm("two", [link(), link(alpha=np.pi / 2, a=0.5, d=0.25)])

    row = arm.table[1]

    assert arm.table.shape == (2, dynamics.ARM_COLUMNS)
    assert row[:9].tolist() == [1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0]
    assert row[9:12].tolist() == [0.5, -0.25, 0.0]
    assert row[12:16].tolist() == [1.0, 0.1, 0.2, 0.3]
    assert row[16:].tolist() == [0.1, 0.0, 0.0, 0.2, 0.0, 0.25, 0.5]


def test_an_arm_survives_the_way_through_its_parameters() -> None:
    arm = akb()

    again = SerialArm.from_parameters(arm.parameters())

    assert again == arm
    assert hash(again) == hash(arm)
    assert again.table.tobytes() == arm.table.tobytes()


def test_parameters_are_plain_numbers_words_and_lists() -> None:
    def is_plain(value: object) -> bool:
        if isinstance(value, list):
            return all(is_plain(item) for item in value)
        return type(value) in (str, float)

    assert all(is_plain(value) for value in akb().parameters().values())


def test_arms_with_different_numbers_differ() -> None:
    assert replace(akb(), gravity=np.zeros(3)) != akb()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"mass": [1.0]}, r"mass has shape \(1,\), but must have shape \(6,\)"),
        ({"mass": ["heavy"] * 6}, "mass must be numbers"),
        ({"mass": [float("nan")] * 6}, "mass is .* must contain finite numbers"),
        ({"com": np.full((6, 3), np.inf).tolist()}, "com is .* must contain finite numbers"),
        ({"mass": [0, 0, -1, 0, 0, 0]}, "mass of joint3 is -1.0, but must be at least 0"),
        ({"armature": [-1, 0, 0, 0, 0, 0]}, "armature of joint1 is -1.0, but must be at least 0"),
        ({"torque_limits": [1, 1, 1, 1, 0, 1]}, "torque limit of joint5 is 0.0, but must be above"),
        ({"velocity_limits": [1, 1, 1, 1, 1, 0]}, "velocity limit of joint6 is 0.0, but must be"),
        ({"position_upper": [-9] * 6}, "range of angles of joint1 is .* but must be increasing"),
        ({"rotation": np.ones((6, 3, 3)).tolist()}, "rotation of joint1 is .* be orthonormal"),
        ({"tool": np.zeros((4, 4)).tolist()}, "rotation of tool is .* be orthonormal"),
        ({"inertia": np.ones((6, 3, 3)).cumsum(1).tolist()}, "inertia of joint1 is .* symmetric"),
        ({"joint_names": "abcdef"}, "must be words"),
        ({"joint_names": []}, "needs at least one"),
        ({"colour": "white"}, "'colour'"),
    ],
)
def test_parameters_that_make_no_arm_are_refused_with_the_reason(
    change: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(InvalidArm, match=complaint):
        SerialArm.from_parameters(akb().parameters() | change)


def test_a_missing_parameter_is_named() -> None:
    parameters = akb().parameters()
    del parameters["mass"]

    with pytest.raises(InvalidArm, match=r"\['mass'\] are missing"):
        SerialArm.from_parameters(parameters)


def test_an_arm_needs_a_joint() -> None:
    with pytest.raises(InvalidArm, match="at least one"):
        modified_dh_arm("none", [])


@given(st.floats(0.0, 10.0), points)
def test_a_payload_adds_its_mass_and_moves_the_last_link_s_centre(
    mass: float, centre: tuple[float, float, float]
) -> None:
    arm = akb()

    loaded = arm.with_payload(mass, centre)

    assert loaded.mass[-1] == pytest.approx(arm.mass[-1] + mass)
    assert loaded.mass[-1] * loaded.com[-1] == pytest.approx(
        arm.mass[-1] * arm.com[-1] + mass * np.array(centre), abs=1e-12
    )
    assert loaded.table[:-1].tobytes() == arm.table[:-1].tobytes()


@given(st.floats(0.01, 10.0), points, points)
def test_a_payload_s_inertia_obeys_steiner_s_theorem_about_any_point(
    mass: float, centre: tuple[float, float, float], about: tuple[float, float, float]
) -> None:
    arm = akb()

    loaded = arm.with_payload(mass, centre)

    point_mass = mass * spread(np.array(centre) - about)
    assert inertia_about(loaded, about) == pytest.approx(
        inertia_about(arm, about) + point_mass, abs=1e-12
    )


def spread(offset: np.ndarray) -> np.ndarray:
    """Return the inertia of a unit mass at an offset."""
    return offset @ offset * np.eye(3) - np.outer(offset, offset)


def inertia_about(arm: SerialArm, point: tuple[float, float, float]) -> np.ndarray:
    return arm.inertia[-1] + arm.mass[-1] * spread(arm.com[-1] - np.array(point))


def test_two_payloads_in_one_place_are_one_payload() -> None:
    place = (0.1, -0.2, 0.3)

    twice = akb().with_payload(1.0, place).with_payload(2.0, place)

    assert twice.table == pytest.approx(akb().with_payload(3.0, place).table, abs=1e-14)


@pytest.mark.parametrize(
    ("mass", "centre"), [(-1.0, (0.0, 0.0, 0.0)), (np.inf, (0.0, 0.0, 0.0)), (1.0, (0.0, 0.0))]
)
def test_an_impossible_payload_is_refused(mass: float, centre: Any) -> None:
    with pytest.raises(InvalidArm, match="payload"):
        akb().with_payload(mass, centre)


def test_standard_and_modified_tables_of_one_arm_move_alike() -> None:
    """One link turned by alpha and moved by a, d: T = Rz Tz Tx Rx against Rx Tx Rz Tz."""
    alpha, a, d = 0.7, 0.5, 0.25
    modified = modified_dh_arm("m", [link(), link(alpha=alpha, a=a), link()])
    standard = standard_dh_arm("s", [link(alpha=alpha, a=a), link(d=d), link()])

    assert standard.rotation[1] == pytest.approx(modified.rotation[1])
    assert standard.translation[1] == pytest.approx(modified.translation[1])
    assert standard.translation[2] == pytest.approx([0.0, 0.0, d])
    assert standard.com[0] == pytest.approx(standard.rotation[1] @ [0.1, 0.2, 0.3] + [a, 0.0, 0.0])
