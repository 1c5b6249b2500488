"""The two published PUMA 560s against values that toolboxes computed from the same tables.

``golden/puma560_known_values.json``: gravity load, mass matrix, inverse dynamics and wrist position
at named postures, with armature, without friction, g = 9.81; p560 equals Corke's toolbox.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.robots import puma560
from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.pinocchio_bridge import mass_matrix, rnea, tool_position

GOLDEN = json.loads(
    (Path(__file__).parents[1] / "golden" / "puma560_known_values.json").read_text()
)
ARMS: dict[str, Callable[[], SerialArm]] = {"akb": puma560.akb, "p560": puma560.p560}
POSTURES = [(arm, posture) for arm, known in GOLDEN["models"].items() for posture in known]

by_posture = pytest.mark.parametrize(("name", "posture"), POSTURES)


def known(name: str, posture: str) -> tuple[SerialArm, np.ndarray, dict[str, Any]]:
    values = GOLDEN["models"][name][posture]
    return ARMS[name](), np.array(values["q"]), values


@by_posture
def test_gravity_load_is_the_known_one(name: str, posture: str) -> None:
    arm, q, values = known(name, posture)
    still = np.zeros((1, 6))

    load = inverse_dynamics_batch(arm.table, arm.gravity, q[None], still, still)

    assert load[0] == pytest.approx(values["gravload"], abs=1e-12)


@by_posture
def test_inverse_dynamics_is_the_known_one(name: str, posture: str) -> None:
    arm, q, values = known(name, posture)
    qd, qdd = np.array([GOLDEN["qd"]]), np.array([GOLDEN["qdd"]])

    assert inverse_dynamics_batch(arm.table, arm.gravity, q[None], qd, qdd)[0] == pytest.approx(
        values["rne"], abs=1e-12
    )
    assert rnea(arm, q[None], qd, qdd)[0] == pytest.approx(values["rne"], abs=1e-12)


@by_posture
def test_the_mass_matrix_is_the_known_one(name: str, posture: str) -> None:
    arm, q, values = known(name, posture)
    still = np.zeros((6, 6))

    found = inverse_dynamics_batch(arm.table, np.zeros(3), np.tile(q, (6, 1)), still, np.eye(6)).T

    assert found == pytest.approx(np.array(values["inertia"]), abs=1e-12)
    assert mass_matrix(arm, q) == pytest.approx(np.array(values["inertia"]), abs=1e-12)


@by_posture
def test_the_wrist_is_where_it_is_known_to_be(name: str, posture: str) -> None:
    arm, q, values = known(name, posture)

    assert tool_position(arm, q) == pytest.approx(values["wrist_pos"], abs=1e-12)


def test_corke_s_book_gives_the_same_mass_matrix_at_his_nominal_posture() -> None:
    q = np.radians([0.0, 45.0, -180.0, 0.0, 45.0, 0.0])

    found = mass_matrix(puma560.p560(), q)

    # Corke (1996): the joints' own inertia and what couples joints 1 to 3, to four digits.
    assert found[0, 1] == pytest.approx(-0.4044, abs=5e-5)
    assert found[0, 2] == pytest.approx(0.1006, abs=5e-5)
    assert found[1, 2] == pytest.approx(0.3509, abs=5e-5)


@pytest.mark.parametrize("name", ARMS)
def test_both_arms_have_the_torque_limits_of_armstrong_khatib_and_burdick(name: str) -> None:
    arm = ARMS[name]()

    assert arm.torque_limits.tolist() == [97.6, 186.4, 89.4, 24.2, 20.1, 21.3]
    assert np.isinf(arm.velocity_limits).all()


@pytest.mark.parametrize("name", ARMS)
def test_wang_and_zalzala_s_start_and_goal_lie_within_the_joints_ranges(name: str) -> None:
    arm = ARMS[name]()
    start = np.array([-0.3, 0.4, -0.18, 0.0, -0.05, 0.05])  # table 1
    goal = np.array([0.51, -0.42, 0.58, 0.87, 0.64, 0.84])

    for q in (start, goal):
        assert (arm.position_lower < q).all()
        assert (q < arm.position_upper).all()


def test_the_same_angles_mean_different_postures_in_the_two_arms() -> None:
    raised = np.array([0.0, 0.5, 0.0, 0.0, 0.0, 0.0])

    change = {
        name: tool_position(arm(), raised)[2] - tool_position(arm(), np.zeros(6))[2]
        for name, arm in ARMS.items()
    }

    assert change["p560"] > 0.0
    assert change["akb"] < 0.0
