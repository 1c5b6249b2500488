"""Pinocchio as the oracle of the kernels, and as the reader of robot descriptions."""

from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.robots.arm import InvalidArm, SerialArm
from tramnet_workers.robots.pinocchio_bridge import (
    UnsupportedArm,
    arm_from_urdf,
    build_model,
    forward_simulate,
    mass_matrix,
    rnea,
    tool_position,
)
from tramnet_workers.robots.puma560 import akb, p560

Array = NDArray[np.float64]

STATES = 10_000
LIMIT = '<limit lower="-2.5" upper="1.5" effort="40" velocity="3"/>'

seeds = st.integers(0, 2**32 - 1)
files_last = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


def link(name: str, rng: np.random.Generator | None = None) -> str:
    if rng is None:
        return f"<link name={quoteattr(name)}/>"
    about = rng.uniform(0.05, 0.5, 3)
    inertia = dict(zip(("ixx", "iyy", "izz"), about[[1, 0, 0]] + about[[2, 2, 1]], strict=True))
    return (
        f"<link name={quoteattr(name)}><inertial>{origin(rng)}"
        f'<mass value="{rng.uniform(0.1, 5.0)}"/><inertia ixy="0" ixz="0" iyz="0" '
        + " ".join(f'{key}="{value}"' for key, value in inertia.items())
        + "/></inertial></link>"
    )


def origin(rng: np.random.Generator) -> str:
    xyz, rpy = rng.uniform(-0.5, 0.5, 3), rng.uniform(-np.pi, np.pi, 3)
    return f'<origin xyz="{xyz[0]} {xyz[1]} {xyz[2]}" rpy="{rpy[0]} {rpy[1]} {rpy[2]}"/>'


def joint(
    number: int, kind: str, axis: Array, parent: str, child: str, rng: np.random.Generator
) -> str:
    return (
        f'<joint name="joint{number}" type="{kind}"><parent link="{parent}"/>'
        f'<child link="{child}"/>{origin(rng)}<axis xyz="{axis[0]} {axis[1]} {axis[2]}"/>'
        f"{LIMIT if kind != 'continuous' else ''}</joint>"
    )


def chain(kinds: list[str], seed: int, axes: list[Array] | None = None) -> str:
    """Write the URDF of a random chain with joints of the given kinds."""
    rng = np.random.default_rng(seed)
    axes = axes or [unit(rng.normal(size=3)) for _ in kinds]
    parts = [link("link0", rng)]
    for i, (kind, axis) in enumerate(zip(kinds, axes, strict=True)):
        parts.append(link(f"link{i + 1}", rng))
        parts.append(joint(i + 1, kind, axis, f"link{i}", f"link{i + 1}", rng))
    return f'<robot name="random">{"".join(parts)}</robot>'


def unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector)


def written(folder: Path, text: str) -> Path:
    path = folder / "arm.urdf"
    path.write_text(text)
    return path


def random_states(n: int, k: int, seed: int) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(seed)
    return (
        rng.uniform(-np.pi, np.pi, (k, n)),
        rng.uniform(-5.0, 5.0, (k, n)),
        rng.uniform(-30.0, 30.0, (k, n)),
    )


def kernel_torques(arm: SerialArm, states: tuple[Array, Array, Array]) -> Array:
    return inverse_dynamics_batch(arm.table, arm.gravity, *states)


@pytest.mark.parametrize("arm", [akb(), p560()], ids=lambda arm: arm.name)
def test_the_kernel_agrees_with_pinocchio_on_both_pumas(arm: SerialArm) -> None:
    states = random_states(arm.n_joints, STATES, seed=1)

    assert np.abs(kernel_torques(arm, states) - rnea(arm, *states)).max() < 1e-10


def test_the_kernel_agrees_with_pinocchio_on_a_random_arm_from_a_file(tmp_path: Path) -> None:
    kinds = ["revolute", "revolute", "fixed", "revolute", "revolute", "fixed", "revolute"]
    path = written(tmp_path, chain(kinds, seed=2))
    states = random_states(5, STATES, seed=3)
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()

    found = kernel_torques(arm_from_urdf(path), states)

    expected = np.array([pin.rnea(model, data, *state) for state in zip(*states, strict=True)])
    assert np.abs(found - expected).max() < 1e-10


def test_the_kernel_agrees_with_pinocchio_under_a_payload() -> None:
    arm = akb().with_payload(2.5, (0.05, -0.02, 0.1))
    states = random_states(arm.n_joints, 100, seed=4)

    assert np.abs(kernel_torques(arm, states) - rnea(arm, *states)).max() < 1e-10


@files_last
@given(st.lists(st.sampled_from(["revolute", "fixed"]), max_size=7), seeds)
def test_an_arm_from_a_file_moves_as_pinocchio_s_own_model_of_the_file(
    tmp_path: Path, kinds: list[str], seed: int
) -> None:
    path = written(tmp_path, chain(["revolute", *kinds], seed))
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    q, qd, qdd = (values[0] for values in random_states(model.nv, 1, seed))

    arm = arm_from_urdf(path)

    assert rnea(arm, q[None], qd[None], qdd[None])[0] == pytest.approx(
        pin.rnea(model, data, q, qd, qdd), abs=1e-9
    )
    pin.framesForwardKinematics(model, data, q)
    last_link = data.oMf[model.getFrameId(f"link{len(kinds) + 1}")].translation
    assert tool_position(arm, q) == pytest.approx(last_link, abs=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_coordinate_axes_are_folded_without_rounding(tmp_path: Path, sign: float) -> None:
    axes = [sign * axis for axis in np.eye(3)]
    path = written(tmp_path, chain(["revolute"] * 3, seed=5, axes=axes))

    model = build_model(arm_from_urdf(path))

    original = pin.buildModelFromUrdf(str(path))
    for j in (1, 2, 3):
        assert model.inertias[j].lever[2] == sign * original.inertias[j].lever[j - 1]


def test_limits_names_and_gravity_come_from_the_file(tmp_path: Path) -> None:
    arm = arm_from_urdf(written(tmp_path, chain(["revolute", "continuous"], seed=6)))

    assert arm.name == "random"
    assert arm.joint_names == ("joint1", "joint2")
    assert arm.position_lower.tolist() == [-2.5, -np.inf]
    assert arm.position_upper.tolist() == [1.5, np.inf]
    assert arm.torque_limits.tolist() == [40.0, np.inf]
    assert arm.velocity_limits.tolist() == [3.0, np.inf]
    assert arm.gravity.tolist() == [0.0, 0.0, -9.81]


def test_a_continuous_joint_moves_as_a_revolute_one(tmp_path: Path) -> None:
    revolute = arm_from_urdf(written(tmp_path, chain(["revolute"] * 3, seed=7)))
    continuous = arm_from_urdf(written(tmp_path, chain(["continuous"] * 3, seed=7)))

    assert continuous.table.tobytes() == revolute.table.tobytes()


def test_the_tool_is_the_link_that_was_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path, chain(["revolute", "fixed", "fixed"], seed=8))
    q = np.array([0.4])
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)

    for name in ("link1", "link2", "link3"):
        expected = data.oMf[model.getFrameId(name)].translation
        assert tool_position(arm_from_urdf(path, tool=name), q) == pytest.approx(expected)


def test_a_tool_that_does_not_move_with_the_last_joint_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, chain(["revolute", "revolute", "fixed"], seed=9))

    with pytest.raises(UnsupportedArm, match=r"joint2: .*no link 'link1'.* one of link2, link3"):
        arm_from_urdf(path, tool="link1")


@pytest.mark.parametrize("kind", ["prismatic", "floating", "planar"])
def test_a_joint_that_is_not_revolute_is_refused_by_name(tmp_path: Path, kind: str) -> None:
    path = written(tmp_path, chain(["revolute", kind, "revolute"], seed=10))

    with pytest.raises(UnsupportedArm, match=r"joint2: found .* expected a revolute") as refusal:
        arm_from_urdf(path)

    assert refusal.value.joint == "joint2"


def test_a_branching_robot_is_refused_with_the_joint_that_branches_off(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    text = chain(["revolute", "revolute"], seed=11).replace(
        "</robot>",
        link("finger", rng)
        + joint(3, "revolute", np.eye(3)[0], "link1", "finger", rng)
        + "</robot>",
    )

    with pytest.raises(UnsupportedArm, match=r"found that it hangs on 'joint1', .*serial arm"):
        arm_from_urdf(written(tmp_path, text))


def test_a_robot_without_moving_joints_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedArm, match="no moving joint"):
        arm_from_urdf(written(tmp_path, chain(["fixed"], seed=12)))


def test_a_joint_without_torque_is_refused_by_name(tmp_path: Path) -> None:
    text = chain(["revolute"], seed=13).replace('effort="40"', 'effort="0"')

    with pytest.raises(InvalidArm, match=r"torque limit of joint1 is 0\.0"):
        arm_from_urdf(written(tmp_path, text))


def test_a_file_that_is_no_robot_description_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedArm, match=r"arm\.urdf: found no valid URDF model"):
        arm_from_urdf(written(tmp_path, "<html/>"))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"missing\.urdf"):
        arm_from_urdf(tmp_path / "missing.urdf")


def test_the_model_has_the_arm_s_limits_and_armature() -> None:
    arm = p560()

    model = build_model(arm)

    assert model.armature.tolist() == arm.armature.tolist()
    assert model.upperEffortLimit.tolist() == arm.torque_limits.tolist()
    assert model.lowerEffortLimit.tolist() == (-arm.torque_limits).tolist()
    assert model.lowerPositionLimit.tolist() == arm.position_lower.tolist()
    assert model.upperPositionLimit.tolist() == arm.position_upper.tolist()


@given(seeds)
def test_forward_dynamics_undoes_inverse_dynamics(seed: int) -> None:
    """The first step of a simulation starts with the acceleration that the torque was made for."""
    arm = akb()
    q, qd, qdd = (values[0] for values in random_states(6, 1, seed))
    tau = kernel_torques(arm, (q[None], qd[None], qdd[None]))[0]
    h = 1e-7

    motion = forward_simulate(arm, lambda t: tau, q, qd, np.array([0.0, h]))

    assert (motion.qd[1] - qd) / h == pytest.approx(qdd, abs=1e-3 * (1.0 + np.abs(qdd).max()))


def test_the_torques_of_a_planned_motion_drive_the_arm_along_it() -> None:
    """Quintic from rest to rest in 0.6 s, played open loop."""
    arm = akb()
    start = np.array([-0.3, 0.4, -0.18, 0.0, -0.05, 0.05])
    goal = np.array([0.51, -0.42, 0.58, 0.87, 0.64, 0.84])
    T = 0.6

    def plan(t: float) -> tuple[Array, Array, Array]:
        x = t / T
        s = x**3 * (10 - 15 * x + 6 * x**2)
        ds = 30 * x**2 * (1 - x) ** 2 / T
        dds = 60 * x * (1 - x) * (1 - 2 * x) / T**2
        return start + s * (goal - start), ds * (goal - start), dds * (goal - start)

    def torque(t: float) -> Array:
        return kernel_torques(arm, tuple(value[None] for value in plan(t)))[0]

    motion = forward_simulate(arm, torque, start, np.zeros(6), np.linspace(0.0, T, 601))

    assert motion.q[-1] == pytest.approx(goal, abs=1e-8)
    assert motion.qd[-1] == pytest.approx(np.zeros(6), abs=1e-7)
    assert motion.q[300] == pytest.approx(plan(motion.times[300])[0], abs=1e-8)


def test_energy_is_kept_when_no_torque_acts() -> None:
    arm = akb()
    q0, qd0 = np.full(6, 0.3), np.array([1.0, -0.5, 0.7, 2.0, -1.0, 0.5])
    model = build_model(arm)
    data = model.createData()

    motion = forward_simulate(arm, lambda t: np.zeros(6), q0, qd0, np.linspace(0.0, 0.5, 501))

    def energy(k: int) -> float:
        kinetic = 0.5 * motion.qd[k] @ mass_matrix(arm, motion.q[k]) @ motion.qd[k]
        return float(kinetic + pin.computePotentialEnergy(model, data, motion.q[k]))

    assert energy(500) == pytest.approx(energy(0), abs=1e-7)


def test_sampled_torques_act_as_their_linear_interpolation() -> None:
    arm = p560()
    times = np.linspace(0.0, 0.1, 21)
    samples = np.outer(1.0 - times / 0.1, [10.0, -50.0, 20.0, 1.0, -1.0, 0.5])

    sampled = forward_simulate(arm, samples, np.zeros(6), np.zeros(6), times)
    continuous = forward_simulate(
        arm, lambda t: samples[0] * (1.0 - t / 0.1), np.zeros(6), np.zeros(6), times
    )

    assert sampled.q == pytest.approx(continuous.q, abs=1e-12)


def test_a_sample_of_the_torque_is_needed_for_every_instant() -> None:
    with pytest.raises(ValueError, match="3 samples of the torque for 5 instants"):
        forward_simulate(
            akb(), np.zeros((3, 6)), np.zeros(6), np.zeros(6), np.linspace(0.0, 1.0, 5)
        )


def test_a_torque_that_jumps_at_an_instant_is_followed_exactly() -> None:
    """Halving all steps but the one of the jump changes nothing, as no step straddles it."""
    arm = akb()

    def torque(t: float) -> Array:
        return np.full(6, 5.0) if t < 0.05 else np.full(6, -5.0)

    coarse = forward_simulate(arm, torque, np.zeros(6), np.zeros(6), np.linspace(0.0, 0.1, 101))
    fine = forward_simulate(arm, torque, np.zeros(6), np.zeros(6), np.linspace(0.0, 0.1, 201))

    assert coarse.q[-1] == pytest.approx(fine.q[-1], abs=1e-11)
