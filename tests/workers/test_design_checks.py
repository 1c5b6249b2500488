"""What a design is checked for, and what that leads to: obstacles, reach with strokes, returns."""

import json
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_workers.evolution.mpga import run_mpga
from tramnet_workers.kernels.design import JAC
from tramnet_workers.mpga_settings import SETTINGS
from tramnet_workers.problems import progressive
from tramnet_workers.problems.checks import (
    LIMITS,
    Violation,
    crossings,
    find_violations,
    follow_poses,
    motion_values,
)
from tramnet_workers.problems.design_report import DesignedArm, describe_design, planar_arm
from tramnet_workers.problems.design_task import Base, DesignTask, Stroke
from tramnet_workers.problems.design_yardsticks import best_arm, design_quality
from tramnet_workers.problems.progressive import advance, begin
from tramnet_workers.problems.stages import (
    Poses,
    evaluate_poses,
    planning_stage,
    prototype_stage,
)
from tramnet_workers.problems.stock import Stock
from tramnet_workers.problems.variants import mobile_base, prismatic

RECOMMENDED = SETTINGS["recommended"]
BOX = (0.2, 0.1, 0.6, 0.3)


def designed(task, settings=RECOMMENDED, seed=1):
    state = begin(task, settings)
    while state.stage is not None:
        found = run_mpga(state.stage.problem, state.stage.genetic, seed, stream=state.stream)
        state = advance(state, found.final_traits)
    return state


def places(lengths, base, angles):
    turns = np.cumsum(angles)
    links = lengths[:, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return np.concatenate([[base], base + np.cumsum(links, axis=0)])


@given(st.integers(0, 2**32))
def test_crossings_are_what_sampled_links_have_inside_the_box(seed):
    rng = np.random.default_rng(seed)
    lengths, bases = rng.uniform(0.1, 0.8, 3), rng.uniform(-0.3, 0.3, (2, 2))
    joints = rng.uniform(-np.pi, np.pi, (2, 3))
    share = (np.arange(4000) + 0.5) / 4000

    found = crossings(DesignTask(boxes=(BOX,)), lengths, bases, joints)

    for i in range(2):
        corners = places(lengths, bases[i], joints[i])
        inside = 0.0
        for k in range(3):
            points = corners[k] + share[:, None] * (corners[k + 1] - corners[k])
            within = (points > BOX[:2]) & (points < BOX[2:])
            inside += lengths[k] * within.all(axis=1).mean()
        assert found[i] == pytest.approx(inside, abs=2e-3)


def test_without_boxes_nothing_is_crossed():
    assert crossings(DesignTask(), np.full(3, 0.4), np.zeros((5, 2)), np.zeros((5, 3))).sum() == 0.0


def test_an_arm_that_runs_into_a_box_violates_a_limit_even_between_its_stations():
    state = designed(DesignTask())
    outcome, lengths = state.outcome, state.outcome.poses.lengths
    i = 5
    middle = places(lengths, np.zeros(2), outcome.motion.joints[i, 10])[1]
    box = (*(middle - 1e-3), *(middle + 1e-3))  # about joint 2, halfway between two stations
    there = replace(state.task, boxes=(tuple(float(x) for x in box),))

    found = find_violations(there, outcome.poses, outcome.terms, outcome.motion)

    assert outcome.violations == ()
    ends = tuple(outcome.poses.stations[[i, i + 1]].tolist())
    assert ("tc", ends) in {(violation.constraint, violation.stations) for violation in found}


def test_a_user_s_own_term_has_no_limit():
    outcome = designed(DesignTask(terms=("isotropy",), weights={"tc": 0.0})).outcome

    assert outcome.violations == ()


def test_motion_values_are_checked_against_the_limits():
    state = designed(DesignTask())
    outcome = state.outcome

    values = motion_values(state.task, outcome.poses, outcome.motion)

    assert len(values) == len(outcome.poses.stations)
    assert max(value.end for value in values) == outcome.motion.end_errors.max()
    assert all(value.jump <= LIMITS["jump"] for value in values)


@pytest.mark.parametrize(
    ("constraint", "found", "severity"),
    [("rc", 0.01, 10.0), ("dm", 0.025, 2.0), ("dm", 0.0, np.inf), ("end", np.nan, np.inf)],
)
def test_how_severe_a_violation_is(constraint, found, severity):
    violation = Violation(constraint, (0.0,), found, LIMITS[constraint])

    assert violation.severity == pytest.approx(severity)


def test_a_stroke_counts_as_reach_when_modules_are_chosen():
    stock, wanted = Stock.of_lengths([0.25, 0.3, 0.4]), np.array([0.28, 0.27, 0.26])
    far = np.array([1.12])

    without = stock.choose(wanted, ordered=True, reaches=far)
    extended = stock.choose(wanted, ordered=True, reaches=far, strokes=np.array([0.0, 0.3, 0.0]))

    assert without.sum() >= 1.12
    assert extended.tolist() == [0.3, 0.3, 0.25]


def test_drawn_in_links_reach_as_near_as_drawn_out_ones_allow():
    stock, wanted = Stock.of_lengths([0.2, 0.6]), np.array([0.6, 0.2])
    near = np.array([0.3])

    without = stock.choose(wanted, ordered=True, reaches=near)
    extended = stock.choose(wanted, ordered=True, reaches=near, strokes=np.array([0.0, 0.2]))

    assert without.tolist() == [0.2, 0.2]
    assert extended.tolist() == [0.6, 0.2]


def test_a_prismatic_arm_mostly_needs_no_return():
    states = [designed(prismatic(DesignTask()), seed=seed) for seed in range(100, 104)]

    assert sum(state.outcome.returns for state in states) <= 2


def test_offending_points_are_added_the_worst_first_and_only_up_to_a_number(monkeypatch):
    monkeypatch.setattr(progressive, "MOST_TASK_POINTS", 6)
    short = DesignTask(stock=Stock.of_lengths([0.2]), most_returns=2)

    state = designed(short)

    assert state.outcome.returns == 2
    assert len(state.task.stations) == 6
    first_added = set(state.task.stations) - set(short.stations)
    assert first_added < {k / 20 for k in range(20)}  # sub-task points of the first round


def test_poses_between_task_points_follow_each_other_more_smoothly_than_jac_alone_makes_them():
    def way(settings):
        joints = designed(DesignTask(), settings).outcome.motion.joints.reshape(-1, 3)
        return abs(np.diff(np.unwrap(joints, axis=0), axis=0)).sum()

    def weighing(refinement):
        return replace(refinement, jac=0.01)

    rough = replace(
        RECOMMENDED,
        prototype=weighing(RECOMMENDED.prototype),
        planning=weighing(RECOMMENDED.planning),
    )
    assert way(RECOMMENDED) < 0.85 * way(rough)


def test_the_weight_of_jac_in_steps_2_and_3_is_a_setting_that_a_user_overrules():
    around = Poses(np.arange(2.0), np.full(3, 0.4), np.zeros((2, 2)), np.zeros((2, 3)))
    task = DesignTask(stations=(0.0, 0.5))
    own = replace(task, weights={"jac": 0.7})

    def weights(task):
        prototype = prototype_stage(task, RECOMMENDED, around)
        ring = np.array([[-1, 1], [0, -1]])
        planning = planning_stage(task, RECOMMENDED, around, ring, around)
        return [stage.problem.coupling.weights[JAC] for stage in (prototype, planning)]

    assert weights(task) == [RECOMMENDED.prototype.jac, RECOMMENDED.planning.jac]
    assert weights(own) == [0.7, 0.7]


def test_a_mobile_base_is_two_joints_of_the_exported_arm():
    task = mobile_base(DesignTask(base=Base(free=True), mobility=0.2))
    poses = designed(task).outcome.poses
    model = pin.buildModelFromXML(planar_arm(task, poses, "crank").urdf())
    data, tip = model.createData(), model.getFrameId("tip")

    assert list(model.names)[1:] == ["base_x", "base_y", "joint1", "joint2", "joint3"]
    for station, base, joints in zip(poses.stations, poses.bases, poses.joints, strict=True):
        q = np.concatenate([base - poses.bases[0], joints])
        assert (abs(q[:2]) <= model.upperPositionLimit[:2] + 1e-12).all()
        pin.framesForwardKinematics(model, data, q)
        reached = data.oMf[tip].translation[:2]
        assert reached == pytest.approx(task.trajectory.point(station), abs=1e-3)


def test_the_description_of_a_design_is_plain_and_says_the_motion_to_the_next_station():
    state = designed(prismatic(DesignTask()))
    design = DesignedArm.after(state.task, state.outcome)

    plain = json.loads(json.dumps(describe_design(design)))

    assert plain["prismatic_links"] == [2]
    assert plain["path"] == {"kind": "circle", "centre_m": [0.8, 0.4], "radius_m": 0.25}
    assert all(len(point["strokes_m"]) == 1 for point in plain["points"])
    ends = [point["to_next"]["end_error_rad"] for point in plain["points"]]
    assert max(ends) == state.outcome.motion.end_errors.max()


def test_the_best_arm_is_worth_one_of_itself():
    task, base = DesignTask(), np.zeros(2)
    best = np.array(best_arm(task).lengths)

    quality = design_quality(task, best, np.array([0.45, 0.45, 0.45]), base)

    assert quality.designed == pytest.approx(1.0)
    assert 0.95 < quality.built < 1.0


@pytest.mark.parametrize(
    "task",
    [
        DesignTask(strokes=(Stroke(0, 0.1),)),
        DesignTask(lengths=(0.4, 0.4, 0.4)),
        DesignTask(base=Base(free=True), mobility=np.inf),
        DesignTask(lower=(-1.0, -1.0), upper=(1.0, 1.0)),
    ],
    ids=["prismatic", "given", "mobile", "two links"],
)
def test_where_the_best_arm_is_not_known_there_is_no_quality(task):
    assert design_quality(task, np.full(3, 0.4), np.full(3, 0.4), np.zeros(2)) is None


def test_poses_of_the_pure_search_violate_what_they_violate():
    state = designed(DesignTask())
    short = state.outcome.poses._replace(lengths=0.5 * state.outcome.poses.lengths)
    terms = evaluate_poses(state.task, RECOMMENDED, short)

    found = find_violations(state.task, short, terms, follow_poses(state.task, short))

    assert {v.stations[0] for v in found if v.constraint == "rc"} >= set(short.stations.tolist())
