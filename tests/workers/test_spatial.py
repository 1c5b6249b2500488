from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_workers.errors import InvalidTask
from tramnet_workers.evolution.mpga import run_mpga
from tramnet_workers.kernels.design import DM, HC, JLC, LC, RC
from tramnet_workers.kernels.roots import cube_root
from tramnet_workers.mpga_settings import SETTINGS
from tramnet_workers.problems.spatial_design import SpatialDesign
from tramnet_workers.problems.spatial_task import SpatialTask, find_spatial, spatial_stage
from tramnet_workers.robots.revolute_chain import ChainRow, chain_urdf_of, six_joint_template

RECOMMENDED = SETTINGS["recommended"]
SEEDS = st.integers(0, 2**32)


def turned(x, y):
    """Return an orientation turned about y, then about its own x axis, as nested tuples."""
    matrix = pin.utils.rotate("y", y) @ pin.utils.rotate("x", x)
    return tuple(map(tuple, matrix.tolist()))


POSES = tuple(turned(x, np.pi / 2) for x in (0.0, 0.3, 0.0, -0.3))


@given(st.floats(1e-280, 1e280))
def test_cube_roots_are_exact_to_the_last_digits(x):
    assert cube_root(x) == pytest.approx(np.cbrt(x), rel=1e-15)


def test_the_cube_root_of_nothing_is_nothing():
    assert cube_root(0.0) == cube_root(-1e-3) == 0.0


def evaluated(task, angles, lengths, base):
    """Return traits and terms of one arm at the first task point."""
    stage = spatial_stage(task, RECOMMENDED)
    genes = np.concatenate([angles, base, lengths])[None, :, None]
    traits, terms = np.empty((1, len(genes[0]), 1)), np.empty((1, 8, 1))
    stage.problem.evaluate(0, genes, traits, terms)
    return traits[0, :, 0], terms[0, :, 0]


def pinocchio_arm(lengths, base):
    model = pin.buildModelFromXML(chain_urdf_of(six_joint_template(), lengths, tuple(base), "arm"))
    return model, model.createData(), model.getFrameId("tip")


def random_arm(seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-np.pi, np.pi, 6), rng.uniform(0.1, 0.8, 2), rng.uniform(-0.2, 0.2, 3)


@given(SEEDS)
def test_reachability_agrees_with_pinocchio_on_the_exported_arm(seed):
    q, lengths, base = random_arm(seed)
    task = SpatialTask(orientations=POSES)
    model, data, tip = pinocchio_arm(lengths, base)
    pin.framesForwardKinematics(model, data, q)
    have, want = data.oMf[tip], pin.SE3(np.array(POSES[0]), np.array(task.points[0]))

    _, terms = evaluated(task, q, lengths, base)

    angle = np.linalg.norm(pin.log3(have.rotation.T @ want.rotation))
    distance = np.linalg.norm(want.translation - have.translation)
    assert terms[RC] == pytest.approx(distance + 0.3 * angle, abs=1e-6)


@pytest.mark.parametrize(("orientations", "order"), [((), 3), (POSES, 6)])
@given(seed=SEEDS)
def test_dexterity_agrees_with_pinocchio_s_jacobian(seed, orientations, order):
    q, lengths, base = random_arm(seed)
    model, data, tip = pinocchio_arm(lengths, base)
    J = pin.computeFrameJacobian(model, data, q, tip, pin.LOCAL_WORLD_ALIGNED)
    J[3:] *= 0.3
    total = lengths.sum() + 0.1

    _, terms = evaluated(SpatialTask(orientations=orientations), q, lengths, base)

    determinant = max(np.linalg.det(J[:order] @ J[:order].T), 0.0)
    assert terms[DM] == pytest.approx(determinant ** (1 / order) / total**2, abs=1e-4)


def test_the_heuristic_compares_links_that_are_no_zero_links():
    q, base = np.zeros(6), np.zeros(3)

    _, falling = evaluated(SpatialTask(), q, np.array([0.5, 0.3]), base)
    _, rising = evaluated(SpatialTask(), q, np.array([0.3, 0.5]), base)

    assert falling[HC] == 0.0
    assert rising[HC] == pytest.approx(0.2)


def test_joint_limits_are_those_of_the_template():
    arm = (*six_joint_template()[:5], replace(six_joint_template()[5], lower=-1.0, upper=1.0))

    _, terms = evaluated(SpatialTask(arm=arm), np.full(6, 1.5), np.full(2, 0.4), np.zeros(3))

    assert terms[JLC] == pytest.approx(0.5)


@pytest.mark.parametrize("orientations", [(), POSES])
def test_rc_replaces_inverse_kinematics(orientations):
    task = SpatialTask(orientations=orientations)
    stage = spatial_stage(task, RECOMMENDED)
    result = run_mpga(stage.problem, stage.genetic, 100)

    found = find_spatial(task, RECOMMENDED, result.final_traits)

    assert result.terms[:, RC].max() < 0.1  # without inverse kinematics, before anything is snapped
    assert found.spread < 0.005
    assert found.terms[:, RC].max() < 1e-9
    assert found.terms[:, LC] == pytest.approx(0.0, abs=1e-12)
    assert found.terms[:, DM].mean() > (0.10 if orientations else 0.20)


def test_the_exported_arm_reaches_every_task_point_in_pinocchio():
    task = SpatialTask(orientations=POSES)
    stage = spatial_stage(task, RECOMMENDED)
    found = find_spatial(task, RECOMMENDED, run_mpga(stage.problem, stage.genetic, 2).final_traits)
    model, data, tip = pinocchio_arm(found.lengths, found.base)

    for q, point, turn in zip(found.angles, task.points, POSES, strict=True):
        pin.framesForwardKinematics(model, data, q)
        assert data.oMf[tip].translation == pytest.approx(np.array(point), abs=1e-3)
        assert data.oMf[tip].rotation == pytest.approx(np.array(turn), abs=1e-3)


def test_literal_settings_snap_nothing():
    task, literal = SpatialTask(), SETTINGS["literal"]
    traits = np.zeros((4, 2 + 3 + 6))
    traits[:, :2] = 0.4

    found = find_spatial(task, literal, traits)

    assert np.array_equal(found.angles, traits[:, 5:])


def test_a_spatial_problem_survives_the_wire():
    stage = spatial_stage(SpatialTask(orientations=POSES), RECOMMENDED)
    genetic = replace(stage.genetic, generations=5, population_size=20)

    copy = SpatialDesign.from_parameters(stage.problem.parameters())

    one, other = (run_mpga(problem, genetic, 1) for problem in (stage.problem, copy))
    assert np.array_equal(one.values, other.values)


def test_a_spatial_task_survives_the_wire():
    task = SpatialTask(orientations=POSES, weights={"dm": 2.0}, base_upper=(-0.2, 0.0, 0.0))

    assert SpatialTask.from_parameters(task.parameters()) == task
    assert SpatialTask.from_parameters({}) == SpatialTask()


@pytest.mark.parametrize(
    ("parameters", "field"),
    [
        ({"points": []}, "points"),
        ({"points": [[0.1, 0.2]]}, r"points\[0\]"),
        ({"orientations": [POSES[0]]}, "orientations"),
        ({"orientations": [((1, 0, 0), (0, 1, 0), (0, 0, 2))] * 4}, r"orientations\[0\]"),
        ({"lengths": [0.5, 0.1]}, "lengths"),
        ({"base_lower": [0.3, 0.0, 0.0]}, r"base_lower\[0\]"),
        ({"weights": {"dex": 1.0}}, "weights.dex"),
        ({"arm": [{"a": 0.1, "d": 0.0, "alpha": 0.0}]}, "arm"),
    ],
)
def test_a_wrong_field_is_named(parameters, field):
    with pytest.raises(InvalidTask, match=rf"^{field}.*: found .*, expected "):
        SpatialTask.from_parameters(parameters)


def test_a_template_marks_what_is_to_be_designed():
    assert SpatialTask().designed == [(1, "a"), (3, "d")]
    assert SpatialTask(arm=(ChainRow(0.1, 0.0, 0.0, "d"),)).designed == [(0, "d")]
