import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.checkpoints import Checkpoint, decode_checkpoint, encode_checkpoint
from tramnet_master.engines.farmed import GenerationalEngine
from tramnet_master.experiments.runner import population_hash
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evaluated

N = 6


class Shift:
    """Each next population is the last one, shifted by the generation."""

    population_size = N

    def initial(self):
        return np.arange(N * 2, dtype=np.int16).reshape(N, 2)

    def breed(self, genomes, objectives, generation):
        return np.roll(genomes, generation, axis=0)


def score(genomes):
    return np.abs(genomes.astype(np.float64) - 5.5).sum(axis=1)


def advance(engine, generations):
    rows = []
    for _ in range(generations):
        (work,) = engine.ask()
        objectives = score(work.genomes.unpack())
        rows += engine.tell(work, Evaluated(work.work, Array.pack(objectives), 0.1))
    return rows


def test_a_generation_is_handed_out_once_and_nothing_comes_after_the_last():
    engine = GenerationalEngine(Shift(), 2)

    assert len(engine.ask()) == 1
    assert engine.ask() == []
    advance(GenerationalEngine(Shift(), 2), 2)
    engine = GenerationalEngine(Shift(), 2)
    advance(engine, 2)
    assert engine.finished
    assert engine.ask() == []


def test_generations_and_evaluations_count_the_first_population():
    engine = GenerationalEngine(Shift(), 3)

    rows = advance(engine, 3)

    assert [row.generation for row in rows] == [1, 2, 3]
    assert [row.evaluations for row in rows] == [N, 2 * N, 3 * N]
    assert rows[0].mean == math.fsum(score(Shift().initial())) / N


def test_among_equals_the_lowest_slot_and_the_earliest_generation_win():
    engine = GenerationalEngine(Shift(), 3)

    advance(engine, 3)

    assert engine.best.generation == 1
    assert engine.best.genome.tolist() == [4, 5]  # as good as [6, 7], in a lower slot


@given(st.integers(1, 8))
def test_a_run_restored_from_a_checkpoint_goes_on_bit_for_bit(cut):
    whole, first, second = (GenerationalEngine(Shift(), 9) for _ in range(3))
    advance(whole, 9)
    advance(first, cut)

    saved = encode_checkpoint(Checkpoint(cut, {"engine": first.state()}))
    second.restore(decode_checkpoint(saved, None).state["engine"])
    advance(second, 9 - cut)

    assert population_hash(second) == population_hash(whole)
    assert second.best.objective == whole.best.objective
    assert second.best.generation == whole.best.generation
    assert second.evaluations == whole.evaluations


def test_the_hash_sees_genomes_and_objectives():
    one, other = GenerationalEngine(Shift(), 1), GenerationalEngine(Shift(), 1)
    (work,) = one.ask()
    objectives = score(work.genomes.unpack())
    one.tell(work, Evaluated(work.work, Array.pack(objectives), 0.0))
    (work,) = other.ask()
    other.tell(work, Evaluated(work.work, Array.pack(np.nextafter(objectives, 9.0)), 0.0))

    assert population_hash(one) != population_hash(other)


def test_what_an_engine_hands_out_cannot_be_changed():
    engine = GenerationalEngine(Shift(), 1)
    advance(engine, 1)

    with pytest.raises(ValueError, match="read-only"):
        engine.best.genome[0] = 0
