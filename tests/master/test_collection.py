import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.farm.collection import WrongOutcome, open_collection
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import (
    Evaluate,
    Evaluated,
    Evolve,
    Kind,
    PopulationMeans,
    PopulationSnapshot,
    Track,
    Tracked,
    WorkId,
)

N = 12


def part(first: int, last: int) -> WorkId:
    return WorkId(Kind.EVALUATE, 0, 3, first, last)


def generation() -> Evaluate:
    genomes = np.arange(N * 2, dtype=np.int16).reshape(N, 2)
    return Evaluate(part(0, N), Array.pack(genomes))


def answer(first: int, last: int, values: object = None) -> Evaluated:
    objectives = np.arange(first, last, dtype=np.float64) if values is None else np.array(values)
    return Evaluated(part(first, last), Array.pack(objectives), 0.5)


@given(st.sets(st.integers(1, N - 1)), st.randoms())
def test_however_it_is_cut_and_in_whatever_order_it_comes_back_the_whole_is_the_same(cuts, random):
    collection = open_collection(generation())
    borders = [0, *sorted(cuts), N]
    pieces = list(itertools.pairwise(borders))
    random.shuffle(pieces)

    for first, last in pieces:
        collection.accept(answer(first, last), part(first, last))

    assert collection.outcome().objectives.unpack().tolist() == list(range(N))


def test_a_chunk_carries_its_own_chromosomes():
    chunk = open_collection(generation()).chunk(part(3, 5))

    assert chunk.work == part(3, 5)
    assert chunk.genomes.unpack().tolist() == [[6, 7], [8, 9]]


def test_only_the_accepted_part_of_an_answer_is_kept():
    collection = open_collection(generation())
    collection.accept(answer(0, N), part(0, 5))
    collection.accept(answer(0, N), part(7, N))

    collection.accept(answer(4, 8, [-1.0, -2.0, -3.0, -4.0]), part(5, 7))

    assert collection.outcome().objectives.unpack()[4:8].tolist() == [4.0, -2.0, -3.0, 7.0]


def test_slots_without_a_usable_number_are_named():
    bad = open_collection(generation()).inspect(answer(4, 8, [0.0, np.nan, np.inf, 1.0]))

    assert bad == (5, 6)


@pytest.mark.parametrize(
    "values", [[1.0, 2.0, 3.0], np.zeros((4, 1)), np.zeros(4, np.float32), np.zeros(4, np.int64)]
)
def test_an_outcome_of_another_shape_or_type_is_refused(values):
    with pytest.raises(WrongOutcome, match="expected float64 of shape"):
        open_collection(generation()).inspect(answer(4, 8, values))


def test_an_outcome_of_another_kind_is_refused():
    path = Tracked(part(0, N), Array.pack(np.zeros((N, 8))), Array.pack(np.zeros(N)), 0.0)

    with pytest.raises(WrongOutcome, match="Tracked"):
        open_collection(generation()).inspect(path)


def test_a_condemned_individual_gets_the_worst_objective_of_the_others():
    collection = open_collection(generation())
    collection.accept(answer(0, N), part(0, 4))
    collection.condemn(part(4, 5))
    collection.accept(answer(0, N), part(5, N))

    assert collection.condemned == [4]
    assert collection.outcome().objectives.unpack()[4] == N - 1


def test_when_all_are_condemned_the_objectives_are_still_numbers():
    collection = open_collection(generation())
    collection.condemn(part(0, N))

    assert np.isfinite(collection.outcome().objectives.unpack()).all()


def test_a_track_is_one_piece():
    work = Track(WorkId(Kind.TRACK, 0, 0, 1, 11), Array.pack(np.zeros(8)))
    collection = open_collection(work)
    path = Tracked(work.work, Array.pack(np.ones((10, 8))), Array.pack(np.zeros(10)), 0.1)

    assert not collection.divisible
    assert collection.inspect(path) == ()
    collection.accept(path, work.work)
    assert collection.outcome() == path


@pytest.mark.parametrize(
    ("path", "cost"),
    [
        (np.zeros((1, 8)), np.zeros(10)),  # which NumPy would spread over all points
        (np.zeros((10, 5)), np.zeros(10)),
        (np.zeros((10, 8), np.float32), np.zeros(10)),
        (np.zeros((10, 8)), np.zeros(0)),
        (np.zeros((10, 8)), np.zeros((10, 1))),
    ],
)
def test_a_path_of_another_shape_or_type_is_refused(path, cost):
    work = Track(WorkId(Kind.TRACK, 0, 0, 1, 11), Array.pack(np.zeros(8)))
    told = Tracked(work.work, Array.pack(path), Array.pack(cost), 0.1)

    with pytest.raises(WrongOutcome, match="expected"):
        open_collection(work).inspect(told)


EVOLVE = WorkId(Kind.EVOLVE, 0, 10, 2, 5)  # three populations that tell two values each


@pytest.mark.parametrize(
    ("means", "ranking", "populations", "fitness"),
    [
        ((1, 2), (3, 7), (3, 20, 6), (3, 20)),
        ((3, 4), (3, 7), (3, 20, 6), (3, 20)),
        ((), (3, 7), (3, 20, 6), (3, 20)),
        ((3, 2), (2, 7), (3, 20, 6), (3, 20)),
        ((3, 2), (3,), (3, 20, 6), (3, 20)),
        ((3, 2), (3, 7), (2, 20, 6), (2, 20)),
        ((3, 2), (3, 7), (3, 20), (3, 20)),
        ((3, 2), (3, 7), (3, 20, 6), (3, 19)),
        ((3, 2), (3, 7), (3, 20, 6), (60,)),
    ],
)
def test_populations_of_another_shape_are_refused(means, ranking, populations, fitness):
    work = Evolve(EVOLVE, Array.pack(np.zeros((1, 8, 2))), snapshot=True)
    told = PopulationMeans(EVOLVE, Array.pack(np.zeros(means)), Array.pack(np.zeros(ranking)), 0.1)
    snapshot = PopulationSnapshot(
        EVOLVE, Array.pack(np.zeros(populations, np.uint8)), Array.pack(np.zeros(fitness))
    )

    with pytest.raises(WrongOutcome, match="expected"):
        open_collection(work).inspect(told, snapshot)


@pytest.mark.parametrize("rows", [3, 0], ids=["on the way", "at the end"])
def test_populations_tell_values_until_the_last_generation(rows):
    work = Evolve(EVOLVE, Array.pack(np.zeros((1, 8, 2))), snapshot=True)
    told = PopulationMeans(
        EVOLVE, Array.pack(np.zeros((rows, 2))), Array.pack(np.zeros((3, 7))), 0.1
    )
    snapshot = PopulationSnapshot(
        EVOLVE, Array.pack(np.zeros((3, 20, 6), np.uint8)), Array.pack(np.zeros((3, 20)))
    )

    assert open_collection(work).inspect(told, snapshot) == ()
