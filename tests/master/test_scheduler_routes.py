"""Stories of a farm in which workers pass on each other's frames."""

import pytest

from tramnet_master.farm.events import (
    Accept,
    Answered,
    Cause,
    Drop,
    Reason,
    Repeat,
    Replace,
    Resolved,
    Rewired,
    Send,
    Tick,
    Tram,
    WorkerLost,
    WorkerReady,
)
from tramnet_master.farm.ways import ways
from tramnet_protocol.messages import Kind, WorkId
from tramnet_protocol.routes import KEPT
from tramnet_protocol.topology import rewire, shape_named

FIRST, SECOND, THIRD, FOURTH = (Tram(seat, 1) for seat in (1, 2, 3, 4))
WORK = WorkId(Kind.EVALUATE, 0, 0, 0, 4)


def line(*trams, epoch=1):
    lives = {0: 9, **{tram.seat: tram.incarnation for tram in trams}}
    return Rewired(ways(rewire(shape_named("pipeline"), lives, epoch)))


@pytest.fixture
def farm(make_farm):
    """A pipeline of four, each with one slot of a second in work."""
    farm = make_farm(workers=4)
    farm.teach(Kind.EVALUATE, 1.0, workers=4)
    farm.tell(line(FIRST, SECOND, THIRD, FOURTH))
    farm.submit(WORK)
    return farm


def holders(farm):
    return {i.tram: i.work for i in farm.told if isinstance(i, Send) and i.work.population == 0}


def test_the_ways_of_a_pipeline_are_the_trams_before_each():
    assert line(FIRST, SECOND, THIRD).routes == {SECOND: (FIRST,), THIRD: (FIRST, SECOND)}


def test_what_passed_a_lost_tram_is_sent_again_to_the_same_worker_at_once(farm):
    held = holders(farm)

    farm.tell(line(FIRST, THIRD, FOURTH))
    out = farm.tell(WorkerLost(SECOND))

    assert out == [Repeat(THIRD, held[THIRD]), Repeat(FOURTH, held[FOURTH])]


def test_only_the_lost_tram_s_own_chunk_goes_to_another_worker(farm):
    held = holders(farm)
    farm.tell(line(FIRST, THIRD, FOURTH))
    farm.tell(WorkerLost(SECOND))

    out = farm.tell(Answered(FIRST, held[FIRST], 1.0), after=1.0)

    assert Send(FIRST, held[SECOND]) in out


def test_what_was_answered_is_not_sent_again(farm):
    held = holders(farm)
    farm.tell(Answered(THIRD, held[THIRD], 1.0), after=1.0)

    farm.tell(line(FIRST, THIRD, FOURTH))
    out = farm.tell(WorkerLost(SECOND))

    assert out == [Repeat(FOURTH, held[FOURTH]), Send(THIRD, held[SECOND])]


def test_an_answer_that_came_through_after_all_counts_once(farm):
    held = holders(farm)
    farm.tell(line(FIRST, THIRD, FOURTH))
    farm.tell(WorkerLost(SECOND))

    first = farm.tell(Answered(FOURTH, held[FOURTH], 1.0), after=1.0)
    again = farm.tell(Answered(FOURTH, held[FOURTH], 1.0))

    assert Accept(FOURTH, held[FOURTH], held[FOURTH]) in first
    assert again == [Drop(FOURTH, held[FOURTH], Reason.DUPLICATE)]


def test_an_answer_may_come_by_any_wiring_since_the_work_was_sent(farm):
    held = holders(farm)
    fifth = Tram(5, 1)
    farm.tell(line(SECOND, FIRST, THIRD, FOURTH, fifth))
    farm.tell(WorkerReady(fifth))
    farm.tell(
        Rewired({FOURTH: (fifth,)})
    )  # another shape, in which all others are next to the root

    out = farm.tell(WorkerLost(fifth))

    assert out == [Repeat(FOURTH, held[FOURTH])]


def test_a_worker_that_joins_changes_nothing_for_work_under_way(farm):
    fifth = Tram(5, 1)

    assert farm.tell(line(FIRST, SECOND, THIRD, FOURTH, fifth)) == []
    assert farm.tell(WorkerReady(fifth)) == []


def test_what_is_sent_again_gets_its_time_anew(farm):
    farm.tell(line(FIRST, THIRD, FOURTH), after=9.0)
    farm.tell(WorkerLost(SECOND))

    out = farm.wait(2.0)

    assert [i.tram for i in out if isinstance(i, Replace)] == [FIRST]


def test_what_was_sent_again_no_longer_depends_on_the_old_way(farm):
    farm.tell(line(FIRST, THIRD, FOURTH))
    farm.tell(WorkerLost(SECOND))
    farm.tell(Rewired({FOURTH: (FIRST,)}))

    farm.tell(Rewired({}))
    out = farm.tell(WorkerLost(FIRST))

    assert {i.tram for i in out if isinstance(i, Repeat)} == {THIRD, FOURTH}


def test_overdue_work_is_blamed_on_the_silent_tram_nearest_the_root(farm):
    farm.now += 10.0

    out = farm.tell(Tick(frozenset({SECOND, THIRD})))

    stalled = [i.tram for i in out if isinstance(i, Replace) and i.cause is Cause.STALLED]
    overdue = [i.tram for i in out if isinstance(i, Replace) and i.cause is Cause.OVERDUE]
    assert stalled == [SECOND]
    assert overdue == [FIRST]  # which is not silent: its own work takes too long


def test_those_behind_a_stalled_tram_lose_nothing(farm):
    held = holders(farm)
    farm.tell(Answered(FIRST, held[FIRST], 1.0), after=1.0)
    farm.now += 9.0
    farm.tell(Tick(frozenset({SECOND})))
    farm.tell(line(FIRST, THIRD, FOURTH))

    out = farm.tell(WorkerLost(SECOND))
    farm.tell(Answered(THIRD, held[THIRD], 1.0), after=1.0)
    farm.tell(Answered(FOURTH, held[FOURTH], 1.0))

    assert {i for i in out if isinstance(i, Repeat)} == {
        Repeat(THIRD, held[THIRD]),
        Repeat(FOURTH, held[FOURTH]),
    }
    assert farm.told.count(Send(FIRST, held[SECOND])) == 1
    assert sum(isinstance(i, Send) and i.work.population == 0 for i in farm.told) == 5
    assert Resolved(WORK) in farm.tell(Answered(FIRST, held[SECOND], 1.0))


def test_a_silent_tram_is_left_alone_while_nothing_is_overdue(farm):
    assert farm.tell(Tick(frozenset({SECOND})), after=5.0) == []


def test_a_silent_worker_of_a_star_is_stalled_itself(busy_farm):
    busy_farm.submit(WorkId(Kind.EVALUATE, 0, 0, 0, 1))
    (sent,) = (i for i in busy_farm.told[-1:] if isinstance(i, Send))
    busy_farm.now += 5.0

    out = busy_farm.tell(Tick(frozenset({sent.tram})))

    assert Replace(sent.tram, Cause.STALLED, sent.work) in out


def test_of_those_lost_together_none_is_given_the_work_of_another(make_farm):
    farm = make_farm(workers=8)
    farm.teach(Kind.EVALUATE, 1.0, workers=8)
    held = [i.work for i in farm.submit(WorkId(Kind.EVALUATE, 0, 0, 0, 4)) if isinstance(i, Send)]
    first, *others = [i.tram for i in farm.told[-4:]]
    idle = {Tram(seat, 1) for seat in range(1, 9)} - {first, *others}
    also_lost = idle.pop()

    out = farm.tell(WorkerLost(first, (*others, also_lost)))

    assert {i.work: i.tram in idle for i in out if isinstance(i, Send)} == dict.fromkeys(
        held[:3], True
    )


def test_work_that_has_seen_many_wirings_may_have_gone_any_way(farm):
    held = holders(farm)
    for _ in range(KEPT):
        farm.tell(line(FIRST, SECOND, THIRD, FOURTH))

    farm.tell(line(FIRST, SECOND, THIRD))
    out = farm.tell(WorkerLost(FOURTH))

    assert {i for i in out if isinstance(i, Repeat)} == {
        Repeat(SECOND, held[SECOND]),
        Repeat(THIRD, held[THIRD]),
    }


def test_of_the_idle_the_nearest_the_root_are_given_work_first(farm):
    held = holders(farm)
    for tram in (FOURTH, THIRD, SECOND, FIRST):  # in this order they have been idle the longest
        farm.tell(Answered(tram, held[tram], 1.0), after=1.0)

    sent = farm.submit(WorkId(Kind.EVALUATE, 0, 1, 0, 2))

    assert [i.tram for i in sent if isinstance(i, Send)] == [FIRST, SECOND]
