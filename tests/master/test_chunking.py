"""Laws of chunk sizes and of the measured cost."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.farm.chunking import Costs, chunk_size
from tramnet_master.farm.rules import Rules
from tramnet_protocol.messages import Kind

RULES = Rules()
counts = st.integers(1, 10_000)
workers = st.integers(1, 4095)
costs = st.none() | st.floats(0.0, 100.0)
sizes = st.integers(0, 1_000_000)


def cut_all(total, n_workers, each, bytes_each=0):
    chunks, uncut = [], total
    while uncut:
        chunks.append(chunk_size(total, uncut, n_workers, each, bytes_each, RULES))
        uncut -= chunks[-1]
    return chunks


@given(counts, workers, costs, sizes)
def test_chunks_make_up_the_work(total, n_workers, each, bytes_each):
    chunks = cut_all(total, n_workers, each, bytes_each)

    assert min(chunks) >= 1
    assert sum(chunks) == total


@given(counts, workers, costs, sizes)
def test_two_chunks_fit_into_the_credit_unless_an_individual_does_not(
    total, n_workers, each, bytes_each
):
    for chunk in cut_all(total, n_workers, each, bytes_each):
        assert chunk == 1 or 2 * chunk * bytes_each <= RULES.credit_bytes


@given(counts, workers)
def test_a_cheap_work_is_at_most_one_chunk_per_worker(total, n_workers):
    chunks = cut_all(total, n_workers, 0.9 * RULES.chunk_seconds / total)

    assert len(chunks) <= n_workers
    assert max(chunks) == math.ceil(total / n_workers)


@given(counts, workers, st.floats(1e-6, 100.0))
def test_a_chunk_takes_no_longer_than_it_should_unless_it_is_one_individual(total, n_workers, each):
    for chunk in cut_all(total, n_workers, each):
        assert chunk == 1 or chunk * each <= RULES.chunk_seconds * (1 + 1e-9)


@given(st.integers(2, 10_000), st.integers(2, 64), st.floats(1e-6, 1.0))
def test_chunks_of_a_dear_work_never_grow_towards_its_end(total, n_workers, each):
    chunks = cut_all(total, n_workers, each)

    assert chunks == sorted(chunks, reverse=True)


def test_individuals_go_one_by_one_until_their_cost_is_known():
    assert chunk_size(100, 100, 2, None, 0, RULES) == 1


def test_two_workers_finish_a_dear_work_together():
    ends = [0.0, 0.0]
    for chunk in cut_all(100, 2, 0.001):
        ends.sort()
        ends[0] += chunk * 0.001

    assert max(ends) <= 0.1 / 1.95


def test_the_first_answer_of_a_worker_serves_until_there_is_a_better_one():
    costs = Costs()

    costs.observe(Kind.EVALUATE, 1, 0.3, warm=False)
    assert costs.each(Kind.EVALUATE) == pytest.approx(0.3)
    costs.observe(Kind.EVALUATE, 10, 1e-4, warm=True)
    assert costs.each(Kind.EVALUATE) == pytest.approx(1e-5)
    costs.observe(Kind.EVALUATE, 1, 0.3, warm=False)
    assert costs.each(Kind.EVALUATE) == pytest.approx(1e-5)


def test_kinds_of_work_have_costs_of_their_own():
    costs = Costs()

    costs.observe(Kind.TRACK, 10, 1.0, warm=True)

    assert costs.each(Kind.EVALUATE) is None


@given(st.lists(st.floats(1e-6, 1.0), min_size=1), st.floats(1e-6, 1.0))
def test_the_mean_stays_within_what_was_measured(seconds, last):
    costs = Costs()

    for each in [*seconds, last]:
        costs.observe(Kind.EVALUATE, 1, each, warm=True)

    mean = costs.each(Kind.EVALUATE)
    assert min([*seconds, last]) * (1 - 1e-9) <= mean <= max([*seconds, last]) * (1 + 1e-9)
