from dataclasses import replace

import numpy as np
import pytest

from tramnet_workers.errors import InvalidParameters, InvalidTask
from tramnet_workers.evolution.mpga import run_mpga
from tramnet_workers.kernels.design import DM, HC, JAC, JLC, RC
from tramnet_workers.mpga_settings import SETTINGS
from tramnet_workers.problems.bilevel import polish, run_bilevel, worth
from tramnet_workers.problems.design_task import Base, DesignTask, Stroke
from tramnet_workers.problems.designs import build_design, design_parameters
from tramnet_workers.problems.single_design import single_design, single_genetic
from tramnet_workers.problems.spatial_task import SpatialTask, spatial_stage
from tramnet_workers.problems.stages import design_stage

RECOMMENDED = SETTINGS["recommended"]
ORIGIN = np.zeros(2)


def crank(t, **changes):
    return DesignTask(stations=tuple(np.arange(t) / t), **changes)


def test_the_optimum_of_the_crank_has_equal_links():
    found = run_bilevel(crank(4), budget=400_000, seed=1)

    assert found.dexterity == pytest.approx(0.27455, abs=1e-4)
    assert found.lengths == pytest.approx([0.4626] * 3, abs=1e-3)
    per_point = worth(crank(4), np.array(found.lengths), ORIGIN).dexterity
    assert per_point == pytest.approx([0.2802, 0.2918, 0.2496, 0.2767], abs=5e-4)


def test_without_the_heuristic_the_middle_link_vanishes():
    found = run_bilevel(crank(4, weights={"hc": 0.0}), budget=400_000, seed=1)

    assert sorted(found.lengths)[0] < 0.02  # "awkward design such as zero link length"
    assert found.dexterity == pytest.approx(0.3305, abs=2e-3)


@pytest.mark.parametrize("t", [16, 64])
def test_more_points_make_it_no_harder(t):
    found = run_bilevel(crank(t), budget=100_000 * t, seed=1)

    assert found.dexterity == pytest.approx(0.27450, abs=1e-4)
    assert found.evaluations <= 101_000 * t


def test_a_seed_gives_the_same_search_and_leaves_other_generators_alone():
    np.random.seed(7)  # noqa: NPY002
    expected = np.random.random()  # noqa: NPY002
    np.random.seed(7)  # noqa: NPY002

    one, other = (run_bilevel(crank(4), budget=20_000, seed=3) for _ in range(2))

    assert one == other
    assert np.random.random() == expected  # noqa: NPY002


def test_a_free_base_is_searched_as_well():
    fixed = run_bilevel(crank(4), budget=200_000, seed=1)
    free = run_bilevel(crank(4, base=Base(free=True)), budget=600_000, seed=1)

    assert free.dexterity > fixed.dexterity + 0.003


@pytest.mark.parametrize("lengths", [(0.72, 0.36, 0.36), (0.5, 0.38, 0.37), (0.46, 0.46, 0.46)])
def test_the_polish_reaches_the_optimum_from_what_step_1_finds(lengths):
    found = polish(crank(4), np.array(lengths), ORIGIN)

    assert found.dexterity >= 0.9999 * 0.27455
    assert list(found.lengths) == sorted(found.lengths, reverse=True)


def test_an_arm_that_is_too_short_is_worth_nothing_and_misses_by_what_it_lacks():
    found = worth(crank(4), np.full(3, 0.1), ORIGIN)

    assert found.mean == 0.0
    distances = np.hypot(*crank(4).points.T)
    assert found.shortfall == pytest.approx(distances.mean() - 0.3)


@pytest.mark.parametrize(
    "task",
    [DesignTask(lower=(-3.0, -2.0), upper=(3.0, 2.0)), DesignTask(strokes=(Stroke(0, 0.1),))],
)
def test_exact_poses_are_for_three_revolute_joints(task):
    with pytest.raises(InvalidTask, match="three links and no stroke"):
        worth(task, np.full(task.n_links, 0.4), ORIGIN)


def single_terms(task, genes):
    problem = single_design(task, RECOMMENDED)
    traits, terms = np.empty((1, len(problem.circular), 1)), np.empty((1, 8, 1))
    problem.evaluate(0, np.asarray(genes, float)[None, :, None], traits, terms)
    return traits[0, :, 0], terms[0, :, 0]


def test_one_chromosome_bends_the_arm_onto_every_point():
    task = crank(5)
    exact = worth(task, np.full(3, 0.4626), ORIGIN)
    genes = np.concatenate([np.full(3, 0.4626), ORIGIN, exact.joints[:, 0]])

    traits, terms = single_terms(task, genes)

    joints = traits[5:].reshape(5, 3)
    tips = np.exp(1j * np.cumsum(joints, axis=1)) @ np.full(3, 0.4626)
    assert np.stack([tips.real, tips.imag], axis=1) == pytest.approx(task.points)
    assert terms[[RC, HC, JLC]] == pytest.approx(0.0, abs=1e-12)
    turns = np.angle(np.exp(1j * (np.roll(joints, -1, axis=0) - joints)))
    assert terms[JAC] == pytest.approx(abs(turns).sum() / 5)
    same_side = joints[:, 2] * exact.joints[:, 2] > 0.0
    assert same_side.any()
    if same_side.all():
        assert terms[DM] == pytest.approx(exact.mean)


def test_a_point_out_of_reach_costs_the_distance_that_is_missing():
    task = DesignTask(stations=(0.0,))

    _, terms = single_terms(task, [0.2, 0.2, 0.2, 0.0, 0.0, np.arctan2(0.4, 1.05)])

    assert terms[RC] == pytest.approx(np.hypot(1.05, 0.4) - 0.6)


def test_one_population_with_all_variables_solves_the_small_crank():
    task = crank(4)

    genetic = single_genetic(task, RECOMMENDED, budget=400_000)
    lengths = run_mpga(single_design(task, RECOMMENDED), genetic, seed=1).final_traits[0, :3]

    assert genetic.generations * genetic.population_size * 4 == 400_000
    assert worth(task, lengths, ORIGIN).mean > 0.99 * 0.27455


def test_a_single_chromosome_is_for_three_links_to_be_designed():
    with pytest.raises(InvalidTask, match="links that are to be designed"):
        single_design(DesignTask(lengths=(0.4, 0.4, 0.4)), RECOMMENDED)


@pytest.mark.parametrize(
    "design",
    [
        single_design(crank(4), RECOMMENDED),
        design_stage(crank(4), RECOMMENDED).problem,
        spatial_stage(SpatialTask(), RECOMMENDED).problem,
    ],
    ids=["single", "planar", "spatial"],
)
def test_every_kind_of_design_survives_the_wire(design):
    genetic = replace(RECOMMENDED.genetic, generations=4, population_size=10)

    copy = build_design(design_parameters(design))

    one, other = (run_mpga(problem, genetic, 1) for problem in (design, copy))
    assert type(copy) is type(design)
    assert np.array_equal(one.traits, other.traits)


@pytest.mark.parametrize(
    "parameters", [{}, {"kind": "wooden", "design": {}}, {"kind": "single", "design": {}}]
)
def test_an_unknown_kind_of_design_is_refused(parameters):
    with pytest.raises(InvalidParameters, match="expected"):
        build_design(parameters)
