import numpy as np
import pytest

from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import (
    Evaluate,
    Evaluated,
    Evolve,
    Kind,
    PopulationMeans,
    Setup,
    Track,
    Tracked,
    WorkId,
)
from tramnet_workers.errors import BrokenProblem, InvalidParameters, UnsuitableWork
from tramnet_workers.mpga_settings import SETTINGS, GeneticSettings
from tramnet_workers.node.evaluator import Evaluator
from tramnet_workers.node.evolver import Colony
from tramnet_workers.problems import registry
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.designs import design_parameters
from tramnet_workers.problems.line_tracking import LineTracking, track
from tramnet_workers.problems.single_design import single_design
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.tracking_methods import ResolvedRate

TASK = TrackingTask.of_paper()
DESIGN = single_design(DesignTask(), SETTINGS["recommended"])
PARAMETERS = design_parameters(DESIGN)
NO_VALUES = Array.pack(np.empty((0, 1, len(DESIGN.circular))))


@pytest.fixture(scope="module")
def tracker():
    problem = LineTracking((TASK,), ResolvedRate())
    return Evaluator(Setup(problem.name, problem.parameters()))


@pytest.fixture(scope="module")
def evolver():
    return Evaluator(Setup("crank", PARAMETERS))


def colony(**changes):
    genetic = GeneticSettings(population_size=6, generations=5).parameters()
    plain = Colony("crank", PARAMETERS, genetic, 3, 0).plain()
    return {**plain, **changes}


def test_chromosomes_are_evaluated():
    work = WorkId(Kind.EVALUATE, 0, 1, 4, 6)

    outcome = Evaluator(Setup("sphere", {})).compute(Evaluate(work, Array.pack(np.ones((2, 10)))))

    assert isinstance(outcome, Evaluated)
    assert outcome.objectives.unpack().tolist() == [0.0, 0.0]


def test_a_run_of_points_is_followed(tracker):
    work = WorkId(Kind.TRACK, 0, 0, 1, 6)

    outcome = tracker.compute(Track(work, Array.pack(TASK.start)))

    assert isinstance(outcome, Tracked)
    expected = track(TASK, ResolvedRate(), 1, 6, TASK.start)
    np.testing.assert_array_equal(outcome.path.unpack(), expected.path)
    np.testing.assert_array_equal(outcome.cost.unpack(), expected.cost)


def test_populations_begin_and_tell_their_values(evolver):
    work = Evolve(WorkId(Kind.EVOLVE, 0, 0, 0, 1), NO_VALUES, problem=colony())

    outcome = evolver.compute(work)

    assert isinstance(outcome, PopulationMeans)
    assert outcome.means.shape == (1, len(DESIGN.circular))
    assert outcome.ranking.shape[0] == 0
    assert evolver.snapshot(work) is None


def test_a_worker_says_which_populations_it_does_not_hold(evolver):
    work = Evolve(WorkId(Kind.EVOLVE, 9, 3, 0, 1), Array.pack(np.zeros((1, 1, 20))))

    with pytest.raises(UnsuitableWork, match="found none of them, expected populations 0 to 0"):
        evolver.compute(work)


@pytest.mark.parametrize(
    "work",
    [
        Track(WorkId(Kind.TRACK, 0, 0, 1, 2), Array.pack(np.zeros(8))),
        Evolve(WorkId(Kind.EVOLVE, 0, 0, 0, 1), NO_VALUES),
    ],
)
def test_work_of_another_kind_is_refused(work):
    with pytest.raises(UnsuitableWork, match="expected Evaluate"):
        Evaluator(Setup("sphere", {})).compute(work)


def test_what_evaluates_no_chromosomes_is_refused_as_a_problem_of_chromosomes(tracker, evolver):
    work = Evaluate(WorkId(Kind.EVALUATE, 0, 1, 0, 1), Array.pack(np.zeros((1, 3))))

    for evaluator in (tracker, evolver):
        with pytest.raises(UnsuitableWork, match="found Evaluate"):
            evaluator.compute(work)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"seed": -1}, "seed"),
        ({"extra": 1}, "extra"),
        ({"genetic": {"bits": 99}}, "bits"),
        ({"parameters": {"kind": "square"}}, "planar, single, spatial"),
    ],
)
def test_a_colony_that_makes_no_sense_is_refused(evolver, changes, reason):
    work = Evolve(WorkId(Kind.EVOLVE, 0, 0, 0, 1), NO_VALUES, problem=colony(**changes))

    with pytest.raises(InvalidParameters, match=reason):
        evolver.compute(work)


def test_populations_that_the_problem_does_not_have_are_refused(evolver):
    work = Evolve(WorkId(Kind.EVOLVE, 0, 0, 3, 5), NO_VALUES, problem=colony())

    with pytest.raises(UnsuitableWork, match="populations 3 to 4"):
        evolver.compute(work)


def test_an_object_that_offers_nothing_is_no_problem(monkeypatch):
    monkeypatch.setitem(registry._BUILT_IN, "empty", "builtins:dict")

    with pytest.raises(BrokenProblem, match="name, genome_shape, genome_dtype and evaluate"):
        Evaluator(Setup("empty", {}))
