from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tramnet_master.engines.multipopulation import MultiPopulationEngine
from tramnet_master.engines.population_search import SNAPSHOT_PERIOD, Search
from tramnet_master.farm.events import Tram
from tramnet_master.farm.holders import Holders
from tramnet_protocol.messages import Evolve
from tramnet_workers.evolution.mpga import run_mpga
from tramnet_workers.evolution.population import PopulationState
from tramnet_workers.mpga_settings import SETTINGS, Connect
from tramnet_workers.node.evolver import Colony, Evolver
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.designs import design_parameters
from tramnet_workers.problems.stages import design_stage

T, GENERATIONS, SEED = 4, 25, 7
STAGE = design_stage(DesignTask(), replace(SETTINGS["recommended"], elbow=None))


def genetic_of(connect=Connect.MEDIAN):
    return replace(STAGE.genetic, population_size=20, generations=GENERATIONS, connect=connect)


def search(genetic, stream=0):
    colony = Colony("crank", design_parameters(STAGE.problem), genetic.parameters(), SEED, stream)
    return Search(
        "design", T, 20, GENERATIONS, len(STAGE.problem.circular), STAGE.problem.n_terms,
        colony.plain(),
    )  # fmt: skip


def engine_of(genetic, searches=1):
    def follow(finals):
        return search(genetic, 100 * len(finals)) if len(finals) < searches else None

    return MultiPopulationEngine(follow)


class Farm:
    """Workers that hold populations, and forget them whenever they are told to."""

    def __init__(self, engine, workers=3):
        self.engine = engine
        self.workers = [Evolver("crank", STAGE.problem) for _ in range(workers)]
        self.holders = Holders()

    def do(self, work, forgotten=False):
        assert isinstance(work, Evolve)
        holder = None if forgotten else self.holders.find(work.work)
        if holder is None:
            work = self.engine.restate(work)
            holder = Tram(1 + (work.work.first + work.work.step) % len(self.workers), 1)
        evolver = self.workers[holder.seat - 1]
        outcome = evolver.compute(work)
        self.holders.note(work.work, holder)
        if work.snapshot:
            self.engine.keep(evolver.snapshot(work))
        return self.engine.tell(work, outcome)

    def step(self, workers, forget=lambda: False):
        self.engine.spread(workers)
        return [row for work in self.engine.ask() for row in self.do(work, forget())]

    def run(self, workers=3):
        rows = []
        while not self.engine.finished:
            rows += self.step(workers)
        return rows


@pytest.fixture(scope="module")
def expected():
    return run_mpga(STAGE.problem, genetic_of(), SEED)


def assert_same(engine, expected):
    found = engine.found[0]
    for name in ("best", "mean", "traits", "terms"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)


@pytest.mark.parametrize("workers", [1, 2, 3, 4, 9])
def test_any_number_of_workers_finds_what_one_process_finds(workers, expected):
    engine = engine_of(genetic_of())

    rows = Farm(engine).run(workers)

    assert_same(engine, expected)
    assert [row.generation for row in rows] == list(range(1, GENERATIONS + 1))
    assert rows[-1].evaluations == engine.evaluations == GENERATIONS * T * 20
    np.testing.assert_allclose(-np.array([row.best for row in rows]), expected.best.max(axis=1))


@given(data=st.data())
@settings(max_examples=15, deadline=None)
def test_whoever_comes_goes_and_loses_populations_the_bits_are_the_same(data, expected):
    engine = engine_of(genetic_of())
    farm = Farm(engine)

    while not engine.finished:
        workers = data.draw(st.integers(1, 5))
        farm.step(workers, lambda: data.draw(st.integers(0, 9)) == 0)

    assert_same(engine, expected)


def test_a_snapshot_is_asked_for_every_ten_generations_and_at_the_end():
    engine = engine_of(genetic_of())
    farm, asked = Farm(engine), []
    while not engine.finished:
        engine.spread(2)
        for work in engine.ask():
            asked += [work.work.step] if work.snapshot else []
            farm.do(work)

    due = [*range(SNAPSHOT_PERIOD, GENERATIONS, SNAPSHOT_PERIOD), GENERATIONS]
    assert asked == [step for step in due for _ in range(2)]


def test_what_is_restored_costs_at_most_ten_generations_of_values():
    engine = engine_of(genetic_of())
    farm, longest = Farm(engine), 0
    while not engine.finished:
        engine.spread(1)
        for work in engine.ask():
            longest = max(longest, engine.restate(work).means.shape[0])
            farm.do(work)

    assert longest == SNAPSHOT_PERIOD


@pytest.mark.parametrize("stop", [1, 9, 10, 11, GENERATIONS - 1, GENERATIONS, GENERATIONS + 8])
@pytest.mark.parametrize("connect", [Connect.MEDIAN, Connect.BEST])
def test_a_resumed_run_of_two_searches_ends_with_the_same_bits(stop, connect):
    whole, genetic = engine_of(genetic_of(connect), searches=2), genetic_of(connect)
    Farm(whole).run()
    first = engine_of(genetic, searches=2)
    farm = Farm(first)
    while first.generation < stop:
        farm.step(3)

    second = engine_of(genetic, searches=2)
    second.restore(first.state())
    Farm(second).run(2)

    for one, other in zip(whole.final_arrays(), second.final_arrays(), strict=True):
        np.testing.assert_array_equal(one, other)
    for one, other in zip(whole.found, second.found, strict=True):
        np.testing.assert_array_equal(one.rankings, other.rankings)
    assert second.best.objective == whole.best.objective
    assert second.best.generation == whole.best.generation


def test_the_final_arrays_are_the_populations_as_one_process_leaves_them():
    genetic = genetic_of()
    engine = engine_of(genetic)
    Farm(engine).run()
    state = PopulationState(STAGE.problem, genetic, SEED, 0, T)
    values = state.begin()
    while not state.finished:
        values = state.advance(values).values
    state.advance(values)

    genomes, fitness = engine.final_arrays()

    np.testing.assert_array_equal(genomes, state.snapshot())
    np.testing.assert_array_equal(fitness, state.fitness)
