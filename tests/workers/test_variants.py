from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from tramnet_workers.evolution.mpga import run_mpga
from tramnet_workers.kernels.design import BPC, DM, HC, LC, RC, TC
from tramnet_workers.mpga_settings import SETTINGS
from tramnet_workers.problems.bilevel import worth
from tramnet_workers.problems.design_report import planar_arm
from tramnet_workers.problems.design_task import Base, DesignTask, Stroke
from tramnet_workers.problems.progressive import advance, begin
from tramnet_workers.problems.stages import Poses, design_stage, evaluate_poses
from tramnet_workers.problems.steps import Step
from tramnet_workers.problems.trajectory import Circle, Polyline
from tramnet_workers.problems.variants import (
    VARIANTS,
    mobile_base,
    path_placement,
    prismatic,
    workspace,
)
from tramnet_workers.robots.planar import PlanarArm

RECOMMENDED = SETTINGS["recommended"]


def designed(task, seed=1):
    """Run all steps; return the states passed through."""
    states = [begin(task, RECOMMENDED)]
    while (stage := states[-1].stage) is not None:
        found = run_mpga(stage.problem, stage.genetic, seed, stream=states[-1].stream)
        states.append(advance(states[-1], found.final_traits))
    return states


def searched(task, seed=1):
    """Run step 1; return its result."""
    stage = design_stage(task, RECOMMENDED)
    return run_mpga(stage.problem, stage.genetic, seed)


@pytest.mark.parametrize("name", list(VARIANTS))
def test_every_variant_runs_to_its_end(name):
    outcome = designed(VARIANTS[name](DesignTask()))[-1].outcome

    assert outcome is not None
    assert len(outcome.terms) == len(outcome.poses.stations)


def test_path_placement_fixes_dimension_and_turns_lc_and_hc_off():
    problem = design_stage(path_placement(DesignTask()), RECOMMENDED).problem

    assert begin(path_placement(DesignTask()), RECOMMENDED).stage.step is Step.PLACEMENT
    assert np.array_equal(problem.lower[:, -3:], problem.upper[:, -3:])
    assert np.all(problem.coupling.weights[[LC, HC]] == 0.0)
    assert np.all(problem.coupling.weights[[RC, BPC]] > 0.0)


@pytest.mark.parametrize("seed", range(100, 104))
def test_path_placement_finds_a_base_nearly_as_good_as_the_best_on_a_grid(seed):
    task = path_placement(DesignTask(lengths=(0.5, 0.4, 0.4)))
    lengths, axis = np.array(task.lengths), np.linspace(-0.5, 0.5, 21)
    best = max(worth(task, lengths, np.array([x, y])).mean for x in axis for y in axis)

    outcome = designed(task, seed)[-1].outcome

    assert worth(task, lengths, outcome.poses.bases[0]).mean > 0.95 * best
    assert outcome.violations == ()
    assert np.ptp(outcome.poses.bases, axis=0) == pytest.approx(0.0, abs=1e-12)


def test_an_omnidirectional_base_gives_every_point_its_best_distance():
    outcome = searched(mobile_base(DesignTask()), 100)

    # Equal links are at their best, .29274, everywhere; a fixed base allows .27455 in the mean.
    assert outcome.terms[:, DM].mean() > 0.95 * 0.29274 > 0.27455
    assert np.ptp(outcome.final_traits[:, 3:5], axis=0).max() > 0.05


@pytest.mark.parametrize("reach", [0.0, 0.05, 0.2])
def test_a_base_of_limited_reach_keeps_near_its_places_at_the_neighbours(reach):
    task = mobile_base(DesignTask(base=Base(free=True), mobility=reach))

    bases = searched(task, 100).final_traits[:, 3:5]

    steps = np.hypot(*(np.roll(bases, -1, axis=0) - bases).T)
    assert steps.max() <= reach + 0.01


def test_a_mobile_base_moves_along_its_path():
    outcome = designed(mobile_base(DesignTask()))[-1].outcome

    assert outcome.violations == ()
    assert np.ptp(outcome.poses.bases, axis=0).max() > 0.05


@pytest.mark.parametrize("seed", range(100, 104))
def test_a_polar_arm_reaches_with_its_stroke_what_its_link_does_not(seed):
    # One joint and a stroke: the tip is at the fixed length plus the stroke, DM is scale / distance.
    line = Polyline(((0.5, 0.0), (0.7, 0.0), (0.6, 0.3)))
    task = DesignTask(line, (0.0, 1.0, 2.0), lower=(-3.0,), upper=(3.0,),
                      strokes=(Stroke(0, 0.4, scale=0.3),))  # fmt: skip

    result = searched(task, seed)

    distances = np.hypot(*task.points.T)
    lengths, strokes = result.final_traits[:, 0], result.final_traits[:, -1]
    assert lengths + strokes == pytest.approx(distances)
    assert np.ptp(lengths) < 2e-3  # LC compares the fixed parts only
    assert result.terms[:, DM] == pytest.approx(0.3 / distances)


@pytest.mark.parametrize("seed", range(100, 104))
def test_links_with_a_stroke_are_nearly_as_good_as_the_best_ones(seed):
    stroke = Stroke(1, 0.3, scale=0.0)  # dexterity of turning alone
    task = prismatic(DesignTask(strokes=(stroke,), weights={"jac": 0.01}))

    result = searched(task, seed)

    lengths = result.final_traits[:, :3].mean(axis=0)
    extended = lengths + np.linspace(0.0, 0.3, 13)[:, None] * [0.0, 1.0, 0.0]
    exact = [worth(DesignTask(), arm, np.zeros(2)).dexterity for arm in extended]
    # .27643 is the optimum with strokes, by search over the lengths with exact poses and strokes.
    assert np.max(exact, axis=0).mean() > 0.97 * 0.27643
    assert np.ptp(result.final_traits[:, -1]) > 0.02
    assert np.ptp(result.final_traits[:, :3], axis=0).max() < 3e-3


@pytest.mark.parametrize("seed", range(100, 104))
def test_workspace_design_maps_reach_and_dexterity_of_a_given_arm(seed):
    task = workspace(DesignTask())
    outcome = designed(task, seed)[-1].outcome
    reach, distances = sum(task.lengths), np.hypot(*task.points.T)
    inside = distances < 0.99 * reach

    terms = outcome.terms[outcome.at_task_points]

    exact = worth(task, np.array(task.lengths), np.zeros(2)).dexterity
    assert terms[:, RC] == pytest.approx(np.maximum(distances - reach, 0.0), abs=0.02)
    assert terms[inside, DM].sum() > 0.93 * exact[inside].sum()
    assert outcome.returns == 0
    blind = {v.stations[0] for v in outcome.violations if v.constraint == "rc"}
    assert blind >= set(np.array(task.stations)[distances > 1.01 * reach])


def test_an_obstacle_is_avoided():
    free = searched(DesignTask(), 100)
    length, angle = free.final_traits[0, [0, 5]]
    x, y = length * np.cos(angle), length * np.sin(angle)  # joint 2 at the first point
    there = replace(DesignTask(), boxes=((x - 0.1, y - 0.1, x + 0.1, y + 0.1),))

    blocked = searched(there, 100)

    assert blocked.terms[:, TC].max() < 0.005
    assert crossing(there, free.final_traits).max() > 0.05  # which is what it would do otherwise


def crossing(task, traits):
    poses = Poses(
        np.array(task.stations), traits[:, :3].mean(axis=0), traits[:, 3:5], traits[:, 5:]
    )
    return evaluate_poses(task, RECOMMENDED, poses)[:, TC]


def test_a_user_s_term_acts_by_name():
    plain = searched(DesignTask(), 100)
    round_ = searched(DesignTask(terms=("isotropy",), weights={"tc": 0.3}), 100)
    told = searched(DesignTask(terms=("isotropy",), weights={"tc": 0.0}), 100)

    assert round_.terms[:, TC].mean() < 0.5 * told.terms[:, TC].mean()
    assert np.array_equal(told.traits, plain.traits)


def loaded(arm):
    model = pin.buildModelFromXML(arm.urdf())
    return model, model.createData(), model.getFrameId("tip")


@pytest.mark.parametrize(
    "task",
    [DesignTask(), prismatic(DesignTask()), DesignTask(Circle((0.3, 0.5), 0.3), (0.0, 0.5))],
    ids=["crank", "prismatic", "elsewhere"],
)
def test_the_exported_arm_reaches_every_task_point_in_pinocchio(task):
    state = designed(task)[-1]
    poses, n = state.outcome.poses, task.n_links
    arm = planar_arm(task, poses, "crank")
    model, data, tip = loaded(arm)
    order = [model.getJointId(f"joint{k + 1}") for k in range(n)]
    order += [model.getJointId(f"stroke{stroke.link + 1}") for stroke in task.strokes]

    for joints, station in zip(poses.joints, poses.stations, strict=True):
        q = np.empty(model.nq)
        q[[model.joints[j].idx_q for j in order]] = joints
        pin.framesForwardKinematics(model, data, q)
        reached = data.oMf[tip].translation
        assert reached[:2] == pytest.approx(task.trajectory.point(station), abs=1e-3)


def test_the_table_of_the_arm_is_its_links():
    arm = PlanarArm("arm", (0.5, 0.4), (0.0, 0.0), (-1.0, -2.0), (1.0, 2.0), (0.0, 0.1))

    rows = arm.dh_rows()

    assert [(row.joint, row.d, row.a, row.alpha, row.stroke) for row in rows] == [
        ("joint1", 0.0, 0.5, 0.0, 0.0),
        ("joint2", 0.0, 0.4, 0.0, 0.1),
    ]


def test_the_exported_arm_keeps_its_limits():
    model, _, _ = loaded(PlanarArm("arm", (0.5, 0.4), (0.1, 0.0), (-1, -2), (1, 2), (0.0, 0.1)))

    assert list(model.names)[1:] == ["joint1", "joint2", "stroke2"]
    assert model.lowerPositionLimit.tolist() == [-1.0, -2.0, 0.0]
    assert model.upperPositionLimit.tolist() == [1.0, 2.0, 0.1]
