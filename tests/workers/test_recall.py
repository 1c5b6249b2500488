"""Remembered objectives are those that would be computed, and each is computed once."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.problems.recall import Recall

chunks = st.lists(st.lists(st.integers(0, 6), max_size=12), max_size=8)


@given(chunks=chunks, size=st.integers(1, 20))
def test_a_recalled_objective_is_the_computed_one(chunks: list[list[int]], size: int) -> None:
    recall = Recall(size)
    for values in chunks:
        genomes = np.array(values, np.int16).reshape(-1, 1)

        found = recall.evaluate(genomes, lambda fresh: np.sqrt(fresh[:, 0].astype(np.float64)))

        assert found.tolist() == np.sqrt(np.array(values, np.float64)).tolist()


def test_what_was_met_lately_is_not_computed_again() -> None:
    recall, computed = Recall(10), []

    def evaluate(genomes: NDArray[np.generic]) -> NDArray[np.float64]:
        computed.append(genomes[:, 0].tolist())
        return genomes[:, 0].astype(np.float64)

    for values in ([1, 2, 1, 3], [3, 4, 1], [2, 4]):
        recall.evaluate(np.array(values, np.int16).reshape(-1, 1), evaluate)

    assert computed == [[1, 2, 3], [4]]


def test_what_was_met_long_ago_is_forgotten() -> None:
    recall, counts = Recall(2), []

    def evaluate(genomes: NDArray[np.generic]) -> NDArray[np.float64]:
        counts.append(len(genomes))
        return genomes[:, 0].astype(np.float64)

    for value in (1, 2, 3, 4, 5, 6, 1):
        recall.evaluate(np.array([[value]], np.int16), evaluate)

    assert len(counts) == 7
