import numpy as np
import pytest

from tramnet_master.engines.covariance import CovarianceEngine
from tramnet_protocol.messages import Setup
from tramnet_workers.node.evaluator import Evaluator
from tramnet_workers.problems.bilevel import LinkDesign, run_bilevel, strategy_for
from tramnet_workers.problems.design_task import DesignTask

PROBLEM = LinkDesign.of(DesignTask())


@pytest.fixture(scope="module")
def evaluator():
    return Evaluator(Setup(PROBLEM.name, PROBLEM.parameters()))


def engine_of(budget=60, seed=3):
    return CovarianceEngine(lambda: strategy_for(PROBLEM, seed), budget)


def step(engine, evaluator):
    return [row for work in engine.ask() for row in engine.tell(work, evaluator.compute(work))]


def test_the_farm_finds_what_one_process_finds(evaluator):
    engine = engine_of()
    while not engine.finished:
        step(engine, evaluator)

    alone = run_bilevel(DesignTask(), 56 * PROBLEM.evaluations_each, seed=3)

    assert engine.evaluations == 56
    lengths, _ = PROBLEM.arm(np.asarray(engine.best.genome))
    assert tuple(lengths) == alone.lengths


def test_a_resumed_search_draws_what_the_whole_one_draws(evaluator):
    whole, part, rest = engine_of(), engine_of(), engine_of()
    while not whole.finished:
        step(whole, evaluator)
    for _ in range(4):
        step(part, evaluator)

    rest.restore(part.state())
    while not rest.finished:
        step(rest, evaluator)

    for one, other in zip(whole.final_arrays(), rest.final_arrays(), strict=True):
        np.testing.assert_array_equal(one, other)
    assert rest.best.objective == whole.best.objective


def test_a_search_that_has_converged_ends_before_its_budget(evaluator):
    engine = engine_of(budget=100_000)
    while not engine.finished:
        step(engine, evaluator)

    assert engine.evaluations < 2_000
    assert -engine.best.objective == pytest.approx(0.27455, abs=1e-4)
