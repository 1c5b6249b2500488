"""Stories of work that is bound to a worker's state, and of work that cannot be divided."""

from tramnet_master.farm.events import (
    Accept,
    Cause,
    Condemn,
    Orphaned,
    Replace,
    Resolved,
    Send,
    Tram,
    Waiting,
    WorkerLost,
    WorkerReady,
    WorkSubmitted,
)
from tramnet_protocol.messages import Kind, WorkId

ONE, TWO = Tram(1, 1), Tram(2, 1)
EVOLVE = WorkId(Kind.EVOLVE, 3, 10, 0, 1)
TRACK = WorkId(Kind.TRACK, 0, 0, 0, 25)


def test_populations_are_evolved_where_their_state_is(make_farm):
    farm = make_farm(workers=3)

    assert farm.submit(EVOLVE, affinity=TWO) == [Send(TWO, EVOLVE)]


def test_bound_work_waits_for_its_worker_and_not_for_another(make_farm):
    farm = make_farm(workers=2)
    later = WorkId(Kind.EVOLVE, 3, 11, 0, 1)
    [sent] = farm.submit(EVOLVE, affinity=TWO)

    assert farm.submit(later, affinity=TWO) == []
    assert farm.answer(sent) == [
        Accept(TWO, EVOLVE, EVOLVE),
        Resolved(EVOLVE),
        Send(TWO, later),
    ]


def test_work_bound_to_a_lost_worker_is_orphaned_and_goes_on_when_submitted_with_the_state(
    make_farm,
):
    farm = make_farm(workers=2)
    farm.submit(EVOLVE, affinity=TWO)

    orphaned = farm.tell(WorkerLost(TWO))
    again = farm.submit(EVOLVE)

    assert orphaned == [Orphaned(EVOLVE, TWO)]
    assert again == [Send(ONE, EVOLVE)]


def test_work_bound_to_a_worker_that_is_gone_already_is_orphaned_at_once(make_farm):
    farm = make_farm(workers=2)
    farm.tell(WorkerLost(TWO))
    farm.tell(WorkerReady(Tram(2, 2)))

    assert farm.submit(EVOLVE, affinity=TWO) == [Orphaned(EVOLVE, TWO)]


def test_work_bound_to_a_worker_that_hangs_is_orphaned(make_farm):
    farm = make_farm(workers=2)
    farm.submit(EVOLVE, affinity=TWO)

    out = farm.wait(60.0)

    assert out == [Replace(TWO, Cause.OVERDUE, EVOLVE), Orphaned(EVOLVE, TWO)]


def test_a_restored_share_has_time_for_all_the_generations_it_replays(make_farm):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVOLVE, 1.0, workers=1)

    [sent] = farm.submit(EVOLVE, generations=10)
    in_time = farm.wait(99.0)
    farm.answer(sent, 0.0)
    farm.submit(WorkId(Kind.EVOLVE, 3, 11, 0, 1), affinity=ONE)
    late = farm.wait(11.0)

    assert in_time == []
    assert [type(said) for said in late] == [Replace, Orphaned, Waiting]


def test_the_cost_of_a_generation_is_learnt_from_replayed_ones_as_well(make_farm):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVOLVE, 1.0, workers=1)
    for step in range(20):
        [sent] = farm.submit(WorkId(Kind.EVOLVE, 3, step, 0, 1), generations=10)
        farm.answer(sent, 10.0)

    farm.submit(WorkId(Kind.EVOLVE, 3, 20, 0, 1), affinity=ONE)

    assert [type(said) for said in farm.wait(11.0)] == [Replace, Orphaned, Waiting]


def test_a_late_answer_to_orphaned_work_is_accepted(make_farm):
    farm = make_farm(workers=2)
    [sent] = farm.submit(EVOLVE, affinity=TWO)
    farm.tell(WorkerLost(TWO))

    assert farm.answer(sent) == [Accept(TWO, EVOLVE, EVOLVE), Resolved(EVOLVE)]


def test_work_that_is_done_is_not_orphaned(make_farm):
    farm = make_farm(workers=2)
    [sent] = farm.submit(EVOLVE, affinity=TWO)
    farm.answer(sent)

    assert farm.tell(WorkerLost(TWO)) == []


def test_orphaned_work_keeps_its_history(make_farm):
    farm = make_farm(workers=1)
    out = []
    for incarnation in range(1, 7):  # it kills whatever it is given to
        tram = Tram(1, incarnation)
        assert Send(tram, EVOLVE) in farm.tell(WorkSubmitted(EVOLVE, affinity=tram)) + out
        lost = farm.tell(WorkerLost(tram))
        out = farm.tell(WorkerReady(Tram(1, incarnation + 1)))

    assert Condemn(EVOLVE, "its worker died") in lost
    assert Resolved(EVOLVE) in lost


def test_populations_bound_to_one_worker_are_cut_for_it_alone(make_farm):
    farm = make_farm(workers=4)
    farm.teach(Kind.EVOLVE, 1e-4, workers=4)
    work = WorkId(Kind.EVOLVE, 3, 12, 0, 16)

    assert farm.submit(work, affinity=TWO) == [Send(TWO, work)]


def test_indivisible_work_goes_to_one_worker_whole(make_farm):
    farm = make_farm(workers=2)

    assert farm.submit(TRACK, divisible=False) == [Send(ONE, TRACK)]


def test_indivisible_work_of_unknown_cost_may_take_a_minute_for_each_point(make_farm):
    farm = make_farm(workers=1)
    farm.submit(TRACK, divisible=False)

    assert farm.wait(25 * 60 - 1) == []
    assert Replace(ONE, Cause.OVERDUE, TRACK) in farm.wait(2)


def test_indivisible_work_is_never_bisected_and_stands_and_falls_together(make_farm):
    farm = make_farm(workers=1)
    [sent] = farm.submit(TRACK, divisible=False)

    out = farm.answer(sent, bad=(3,))

    assert out[0] == Replace(ONE, Cause.FRESH_PROCESS)  # no part of it was accepted
    for incarnation in range(2, 5):
        farm.tell(WorkerLost(Tram(1, incarnation - 1)))
        [again, *_] = farm.tell(WorkerReady(Tram(1, incarnation)))
        assert again == Send(Tram(1, incarnation), TRACK)
        out = farm.answer(again, bad=(3,))
    assert out == [Condemn(TRACK, "unusable values"), Resolved(TRACK)]


def test_all_three_kinds_share_the_workers(make_farm):
    farm = make_farm(workers=3)
    evaluate = WorkId(Kind.EVALUATE, 0, 0, 0, 1)

    farm.submit(TRACK, divisible=False)
    farm.submit(EVOLVE, affinity=TWO)
    farm.submit(evaluate)

    assert farm.told == [Send(ONE, TRACK), Send(TWO, EVOLVE), Send(Tram(3, 1), evaluate)]
