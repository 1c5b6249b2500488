import json
from dataclasses import replace

import numpy as np
import pytest

from tramnet_workers.evolution.mpga import run_mpga
from tramnet_workers.kernels.design import BPC, DM, HC, JAC, JLC, LC, RC
from tramnet_workers.kernels.order import wrap
from tramnet_workers.mpga_settings import SETTINGS
from tramnet_workers.problems.bilevel import worth
from tramnet_workers.problems.checks import MOST_JUMP, find_violations, follow_poses
from tramnet_workers.problems.design_report import DesignedArm, describe_design
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.progressive import advance, begin, interpolate, summarise
from tramnet_workers.problems.stages import (
    Poses,
    design_stage,
    evaluate_poses,
    planning_stage,
    prototype_stage,
    ring_neighbours,
)
from tramnet_workers.problems.steps import CONSTRAINTS, Step
from tramnet_workers.problems.stock import Stock
from tramnet_workers.problems.trajectory import Polyline

RECOMMENDED = SETTINGS["recommended"]
FRESH_SEEDS = range(100, 108)


def designed(task, settings=RECOMMENDED, seed=1):
    """Run all steps; return the states passed through."""
    states = [begin(task, settings)]
    while (stage := states[-1].stage) is not None:
        found = run_mpga(stage.problem, stage.genetic, seed, stream=states[-1].stream)
        states.append(advance(states[-1], found.final_traits))
    return states


def posed(task, lengths=(0.45, 0.45, 0.45), elbow=1.0):
    """Return exact best poses of an arm at the task points, the elbow on one side."""
    lower = (-np.pi, 0.0, 0.0) if elbow > 0 else (-np.pi, -2.6, -2.6)
    upper = (np.pi, 2.6, 2.6) if elbow > 0 else (np.pi, 0.0, 0.0)
    one_sided = replace(task, lower=lower, upper=upper)
    joints = worth(one_sided, np.array(lengths), np.zeros(2)).joints
    t = len(task.stations)
    return Poses(np.array(task.stations), np.array(lengths), np.zeros((t, 2)), joints)


def test_which_constraints_act_in_which_step_is_figure_8():
    assert CONSTRAINTS[Step.DESIGN] == {"dm", "tc", "hc", "jlc", "lc", "bpc", "jac"}
    assert CONSTRAINTS[Step.PROTOTYPE] == {"dm", "tc", "rc", "jlc", "bpc", "jac"}
    assert CONSTRAINTS[Step.PLANNING] == {"dm", "tc", "rc", "jlc", "jac"}
    assert CONSTRAINTS[Step.CONTROL] == {"rc", "jlc"}


def test_weights_of_constraints_that_do_not_act_are_zero():
    task, around = DesignTask(), posed(DesignTask())
    between, neighbours = interpolate(task, around)
    at = replace(task, stations=tuple(between.stations))
    stages = (
        design_stage(task, RECOMMENDED),
        prototype_stage(task, RECOMMENDED, around),
        planning_stage(at, RECOMMENDED, between, neighbours, around),
    )

    off = [set(np.flatnonzero(stage.problem.coupling.weights == 0.0)) for stage in stages]

    assert off == [{RC}, {HC, LC}, {HC, LC, BPC}]


def test_step_1_wants_the_same_elbow_by_jac_for_few_points_and_by_limits_for_many():
    few = design_stage(DesignTask(), RECOMMENDED).problem
    many = design_stage(DesignTask(stations=tuple(np.arange(8) / 8)), RECOMMENDED).problem

    assert few.coupling.weights[JAC] == 0.06
    assert few.model.limits[0] == pytest.approx(np.deg2rad([-180, -150, -150]))
    assert (many.coupling.weights[JAC], many.coupling.weights[JLC]) == (0.01, 0.5)
    assert many.model.limits[0] == pytest.approx(np.deg2rad([-180, 0, 0]))
    assert many.model.limits[1] == pytest.approx(np.deg2rad([180, 150, 150]))


def test_a_user_s_weight_is_never_overruled():
    task = DesignTask(weights={"jac": 0.3, "hc": 0.0})

    weights = design_stage(task, RECOMMENDED).problem.coupling.weights

    assert (weights[JAC], weights[HC]) == (0.3, 0.0)


def test_the_prototype_looks_forty_degrees_around_step_1():
    around = posed(DesignTask())
    problem = prototype_stage(DesignTask(), RECOMMENDED, around).problem

    assert problem.lower[:, :3] == pytest.approx(around.joints - np.deg2rad(40.0))
    assert problem.upper[:, :3] == pytest.approx(around.joints + np.deg2rad(40.0))
    assert np.array_equal(problem.lower[:, 3:], problem.upper[:, 3:])


def test_planning_interpolates_four_points_between_poses_that_stay():
    task, fixed = DesignTask(), posed(DesignTask())

    between, neighbours = interpolate(task, fixed)

    assert len(between.stations) == 16
    assert between.stations[:4] == pytest.approx([0.05, 0.10, 0.15, 0.20])
    assert between.stations[-1] == pytest.approx(0.95)
    assert neighbours[0].tolist() == [16, 1]  # the first task point, the next sub-task point
    assert neighbours[3].tolist() == [2, 17]
    assert neighbours[15].tolist() == [14, 16]  # the circle closes
    steps = [wrap(a) for a in (between.joints[1] - between.joints[0])]
    whole = [wrap(a) for a in (fixed.joints[1] - fixed.joints[0])]
    assert np.array(steps) == pytest.approx(np.array(whole) / 5)


def test_interpolated_angles_take_the_short_way_round():
    task = DesignTask(stations=(0.0, 0.5))
    poses = Poses(np.array([0.0, 0.5]), np.full(3, 0.4), np.zeros((2, 2)),
                  np.array([[3.0, 1.0, 1.0], [-3.0, 1.0, 1.0]]))  # fmt: skip

    between, _ = interpolate(task, poses)

    assert [wrap(a - np.pi) for a in between.joints[:4, 0]] == pytest.approx(
        np.array([-0.6, -0.2, 0.2, 0.6]) * (np.pi - 3.0), abs=1e-9
    )


@pytest.mark.parametrize(
    ("closed", "expected"),
    [(True, [[2, 1], [0, 2], [1, 0]]), (False, [[-1, 1], [0, 2], [1, -1]])],
)
def test_neighbours_of_an_open_path_end_with_it(closed, expected):
    assert ring_neighbours(3, closed).tolist() == expected


def test_two_points_on_a_circle_are_neighbours_once():
    assert ring_neighbours(2, closed=True).tolist() == [[-1, 1], [0, -1]]


def test_good_poses_violate_nothing():
    task = DesignTask(stations=tuple(np.arange(20) / 20))
    poses = posed(task)

    terms = evaluate_poses(task, RECOMMENDED, poses)

    assert terms[:, RC].max() < 1e-9
    assert find_violations(task, poses, terms, follow_poses(task, poses)) == ()


def test_mixed_elbows_are_a_violation():
    task = DesignTask()
    up, down = posed(task), posed(task, elbow=-1.0)
    joints = np.where([[True], [False], [True], [True]], up.joints, down.joints)
    poses = up._replace(joints=joints)
    terms = evaluate_poses(task, RECOMMENDED, poses)

    found = find_violations(task, poses, terms, follow_poses(task, poses))

    jumps = {v.stations for v in found if v.constraint == "jump"}
    assert {(0.0, 0.25), (0.25, 0.5)} <= jumps
    assert all(v.found > MOST_JUMP for v in found if v.constraint == "jump")


@pytest.mark.parametrize(
    ("column", "value", "name"), [(RC, 2e-3, "rc"), (JLC, 0.1, "jlc"), (DM, 0.01, "dm")]
)
def test_a_term_beyond_its_limit_is_reported_with_its_station(column, value, name):
    task = DesignTask(stations=tuple(np.arange(20) / 20))
    poses = posed(task)
    terms = evaluate_poses(task, RECOMMENDED, poses)
    terms[7, column] = value

    found = find_violations(task, poses, terms, follow_poses(task, poses))

    assert [(v.constraint, v.stations, v.found) for v in found] == [(name, (0.35,), value)]


def with_elbows(state, elbows):
    """Tell step 1 poses with elbows up or down, whatever a search would have found."""
    task = state.task
    up, down = posed(task).joints, posed(task, elbow=-1.0).joints
    joints = np.where(np.array(elbows)[:, None] > 0, up, down)
    lengths = np.full((len(joints), 3), 0.45)
    return advance(state, np.concatenate([lengths, np.zeros((len(joints), 2)), joints], axis=1))


def test_mixed_elbows_return_to_step_1_with_the_offending_points_added():
    state = with_elbows(begin(DesignTask(), RECOMMENDED), [1, -1, 1, 1])
    while state.returns == 0:
        stage = state.stage
        found = run_mpga(stage.problem, stage.genetic, 1, stream=state.stream)
        state = advance(state, found.final_traits)

    assert state.returns == 1
    assert state.stage.step is Step.DESIGN
    added = set(state.task.stations) - set(DesignTask().stations)
    assert added
    assert all(0.0 < s < 0.5 for s in added)  # between the elbows that differ


def test_every_search_has_random_streams_of_its_own():
    streams = [state.stream for state in designed(DesignTask(), seed=3) if state.stage]

    assert len(set(streams)) == len(streams)


def test_what_cannot_be_repaired_is_reported_after_the_last_return():
    too_short = DesignTask(stock=Stock.of_lengths([0.2]), most_returns=1)

    outcome = designed(too_short)[-1].outcome

    assert outcome.returns == 1
    missing = {v.stations[0] for v in outcome.violations if v.constraint == "rc"}
    assert missing >= {0.0, 0.25}  # 1.12 and 1.03 m away, for an arm of 0.6 m


@pytest.mark.parametrize("seed", FRESH_SEEDS)
def test_the_crank_turns_after_backtracking(seed):
    outcome = designed(DesignTask(), seed=seed)[-1].outcome

    assert outcome.violations == ()
    assert len(outcome.poses.stations) >= 20
    assert outcome.terms[:, RC].max() <= 1e-3
    assert outcome.motion.end_errors.max() <= 1e-3
    assert outcome.motion.null_peaks.max() <= 1.1


def test_the_printed_gain_is_not_almost_constant():
    outcome = designed(DesignTask())[-1].outcome

    printed = follow_poses(DesignTask(), outcome.poses, exact_gain=False)

    assert printed.null_peaks.min() > 2.0
    assert printed.end_errors.max() <= 1e-3


def test_literal_settings_snap_nothing_and_still_reach_their_points():
    states = designed(DesignTask(), SETTINGS["literal"])
    outcome = states[-1].outcome

    assert outcome.terms[outcome.at_task_points, RC].max() > 1e-9


def test_a_polished_design_is_as_good_as_can_be():
    task = DesignTask()
    found = designed(task, SETTINGS["polished"])[-1].found

    assert worth(task, found.lengths, np.zeros(2)).mean >= 0.999 * 0.27455


def test_a_single_task_point_needs_no_plan():
    outcome = designed(DesignTask(stations=(0.0,)))[-1].outcome

    assert len(outcome.poses.stations) == 1
    assert outcome.violations == ()


def test_an_open_path_is_followed_from_end_to_end():
    task = DesignTask(Polyline(((0.6, 0.1), (0.9, 0.3), (0.7, 0.6))), (0.0, 1.0, 2.0))

    outcome = designed(task)[-1].outcome

    n_intervals = 5 * (outcome.at_task_points.sum() - 1)
    assert outcome.violations == ()
    assert outcome.poses.stations[[0, -1]].tolist() == [0.0, 2.0]
    assert len(outcome.motion.joints) == n_intervals
    assert len(outcome.poses.stations) == n_intervals + 1


def test_the_report_of_step_1_has_links_spread_and_elbows():
    traits = np.array([[0.5, 0.4, 0.3, 0, 0, 1, 1.0, 1.0], [0.5, 0.4, 0.2, 0, 0, 1, 1.0, 1.0],
                       [0.5, 0.4, 0.1, 0, 0, 1, -1.0, 1.0]])  # fmt: skip

    found = summarise(DesignTask(), traits)

    assert found.lengths == pytest.approx([0.5, 0.4, 0.2])
    assert found.spread == pytest.approx(0.2)
    assert found.elbow_agreement == pytest.approx(2 / 3)


def test_a_design_is_described_by_plain_values_with_units():
    state = designed(DesignTask())[-1]

    plain = describe_design(DesignedArm.after(state.task, state.outcome))

    assert json.loads(json.dumps(plain)) == plain
    assert plain["link_lengths_m"] == state.outcome.poses.lengths.tolist()
    assert plain["returns"] == state.outcome.returns
    assert plain["violations"] == []
    task_points = [point for point in plain["points"] if point["task_point"]]
    assert np.mean([point["dexterity"] for point in task_points]) == plain["dexterity_mean"]
    for point in plain["points"]:
        assert set(point["constraints"]) == {"tc", "rc", "hc", "jlc", "lc", "bpc", "jac"}
        tip = np.exp(1j * np.cumsum(point["pose_rad"])) @ plain["link_lengths_m"]
        assert [tip.real, tip.imag] == pytest.approx(point["point_m"], abs=1e-9)


def test_a_description_says_which_constraint_fails_where():
    state = designed(DesignTask(stock=Stock.of_lengths([0.2]), most_returns=0))[-1]

    plain = describe_design(DesignedArm.after(state.task, state.outcome))

    fails = {point["station"]: point["fails"] for point in plain["points"]}
    assert "rc" in fails[0.0]
    assert {v["constraint"] for v in plain["violations"]} >= {"rc"}
