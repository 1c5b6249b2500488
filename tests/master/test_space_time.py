import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.traffic.recording import RecordedWork, SeenFrame
from tramnet_master.traffic.space_time import Doing, Stretch, stretches_of


def work(n):
    return RecordedWork("evaluate", 0, 1, n, n + 1)


def ask(time, seat, n, link=None):
    return SeenFrame(time, link or (0, seat), 0, seat, "evaluate", 100, 0, work(n))


def answer(time, seat, n, seconds, link=None):
    return SeenFrame(time, link or (seat, 0), seat, 0, "evaluated", 50, 0, work(n), seconds)


def test_a_worker_computes_from_its_chunk_on_and_then_sends():
    done = stretches_of([ask(1.0, 1, 0), answer(1.5, 1, 0, 0.4)])

    assert done[1] == [
        Stretch(Doing.COMPUTING, 1.0, pytest.approx(1.4)),
        Stretch(Doing.SENDING, pytest.approx(1.4), 1.5),
    ]


def test_a_waiting_chunk_is_computed_after_the_one_before():
    frames = [ask(1.0, 1, 0), ask(1.01, 1, 1), answer(1.5, 1, 0, 0.4), answer(2.0, 1, 1, 0.5)]

    computing = [s for s in stretches_of(frames)[1] if s.doing is Doing.COMPUTING]

    assert [(s.begin, s.end) for s in computing] == [
        (1.0, pytest.approx(1.4)),
        (pytest.approx(1.4), pytest.approx(1.9)),
    ]


def test_of_a_chunk_that_was_sent_before_the_recording_only_its_end_is_known():
    done = stretches_of([answer(1.5, 1, 0, 0.4)])

    assert done[1][0] == Stretch(Doing.COMPUTING, pytest.approx(1.1), 1.5)


def test_the_root_computes_while_no_work_is_out():
    frames = [ask(1.0, 1, 0), ask(1.0005, 2, 1), answer(1.5, 1, 0, 0.4), answer(1.6, 2, 1, 0.5)]

    done = stretches_of([*frames, ask(1.7, 1, 2)])

    assert done[0] == [
        Stretch(Doing.SENDING, 1.0, 1.0005),
        Stretch(Doing.COMPUTING, 1.6, 1.7),
        Stretch(Doing.SENDING, 1.7, 1.7),
    ]


def test_a_tram_in_between_passes_frames_on():
    frames = [
        ask(1.0, 2, 0, link=(0, 1)),
        ask(1.001, 2, 0, link=(1, 2)),
        answer(1.5, 2, 0, 0.4, link=(2, 1)),
        answer(1.502, 2, 0, 0.4, link=(1, 0)),
    ]

    done = stretches_of(frames)

    assert done[1] == [Stretch(Doing.PASSING, 1.0, 1.001), Stretch(Doing.PASSING, 1.5, 1.502)]
    assert done[2][0] == Stretch(Doing.COMPUTING, 1.001, pytest.approx(1.401))


moments = st.floats(0.0, 10.0)
frames = st.lists(
    st.builds(ask, moments, st.integers(1, 3), st.integers(0, 5))
    | st.builds(answer, moments, st.integers(1, 3), st.integers(0, 5), st.floats(0.0, 5.0)),
    max_size=40,
).map(lambda found: sorted(found, key=lambda frame: frame.time))


@given(frames)
def test_no_tram_computes_two_things_at_once_nor_backwards(found):
    for stretches in stretches_of(found).values():
        assert all(stretch.begin <= stretch.end for stretch in stretches)
        computing = [stretch for stretch in stretches if stretch.doing is Doing.COMPUTING]
        for before, after in itertools.pairwise(computing):
            assert before.end <= after.begin
