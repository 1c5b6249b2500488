import numpy as np
import pytest

from tramnet_master.experiments.trust import Trust
from tramnet_master.farm.audit import Answer, Audit
from tramnet_master.farm.events import Tram
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evaluate, Evaluated, Kind, Track, Tracked, Work, WorkId

HONEST, LIAR = Tram(1, 1), Tram(2, 2)
SECRET = bytes(16)


def objective_of(genomes: np.ndarray) -> np.ndarray:
    return np.square(genomes).sum(axis=1)


def recompute(work: Work) -> Answer:
    if isinstance(work, Track):
        path = np.ones((work.work.size, 2))
        return Tracked(work.work, Array.pack(path), Array.pack(path[:, 0]), 0.5), None
    assert isinstance(work, Evaluate)
    genomes = work.genomes.unpack()
    if (genomes == 13.0).any():
        raise ValueError("nobody can evaluate this")
    return Evaluated(work.work, Array.pack(objective_of(genomes)), 0.0), None


def generation(size: int = 100) -> Evaluate:
    genomes = np.random.default_rng(5).normal(size=(size, 3)) + 10.0
    return Evaluate(WorkId(Kind.EVALUATE, 0, 4, 7, 7 + size), Array.pack(genomes))


def found(audit: Audit, work: Evaluate, objectives: np.ndarray) -> set[Tram]:
    """The liars, where the first half of a generation is answered by one worker and the second by another."""
    first, last = work.work.first, work.work.last
    middle = (first + last) // 2
    for low, high, tram in ((first, middle, HONEST), (middle, last, LIAR)):
        audit.note(work.work, WorkId(work.work.kind, 0, work.work.step, low, high), tram)
    return audit.liars(work, (Evaluated(work.work, Array.pack(objectives), 0.1), None))


@pytest.mark.parametrize("fraction", [1e-12, 0.1, 1.0])
def test_who_answers_what_is_so_is_no_liar(fraction):
    work = generation()

    assert (
        found(Audit(fraction, SECRET, recompute), work, objective_of(work.genomes.unpack()))
        == set()
    )


def test_a_lie_that_makes_the_best_of_a_generation_is_always_found():
    work = generation()
    objectives = objective_of(work.genomes.unpack())
    objectives[80] = -1.0

    assert found(Audit(1e-12, SECRET, recompute), work, objectives) == {LIAR}


def test_the_least_lie_is_found_where_it_is_sampled():
    work = generation()
    objectives = objective_of(work.genomes.unpack())
    objectives[80] = np.nextafter(objectives[80], np.inf)

    assert found(Audit(1.0, SECRET, recompute), work, objectives) == {LIAR}


def test_a_sample_is_as_large_as_it_should_be_and_depends_on_the_secret():
    work = generation(2000)
    truth = objective_of(work.genomes.unpack())
    audits = [Audit(0.1, bytes([secret]) * 16, recompute) for secret in range(2)]
    drawn = [
        {s for s in range(2000) if audit._draw(work.work, s) < audit._limit} for audit in audits
    ]
    for audit in audits:
        found(audit, work, truth)

    assert all(150 < audit.checked < 250 for audit in audits)
    assert len(drawn[0] & drawn[1]) < 60


def test_an_answer_to_what_cannot_be_evaluated_is_a_lie_and_nobody_else_s_answer_is():
    work = generation()
    genomes = work.genomes.unpack().copy()
    genomes[80] = 13.0
    work = Evaluate(work.work, Array.pack(genomes))

    assert found(Audit(1.0, SECRET, recompute), work, objective_of(genomes)) == {LIAR}


def test_work_that_is_done_whole_is_compared_whole():
    work = Track(WorkId(Kind.TRACK, 0, 0, 1, 4), Array.pack(np.zeros(2)))
    truth, _ = recompute(work)
    assert isinstance(truth, Tracked)
    lie = Tracked(work.work, truth.path, Array.pack(np.zeros(3)), 0.5)
    audit = Audit(1.0, SECRET, recompute)

    for outcome, liars in ((truth, set()), (lie, {LIAR})):
        audit.note(work.work, work.work, LIAR)
        assert audit.liars(work, (outcome, None)) == liars


class Counter:
    """An engine that counts."""

    def __init__(self) -> None:
        self.generation = 0

    def state(self) -> dict:
        return {"generation": self.generation}


def test_a_run_goes_back_to_before_its_liars_had_a_part_in_it():
    engine, trust = Counter(), Trust()
    for generation, tram in ((0, HONEST), (5, LIAR), (8, Tram(3, 3))):
        engine.generation = generation
        trust.note(tram, engine)

    assert trust.go_back([LIAR]) == (5, {"generation": 5})
    assert trust.go_back([Tram(3, 3)]) == (5, {"generation": 5})  # what came after 5 is forgotten
    assert trust.go_back([HONEST, LIAR]) == (0, None)
