"""Stories of the farm: each is a list of events and what the scheduler makes of them."""

import pytest

from tramnet_master.farm.events import (
    Accept,
    Answered,
    Cause,
    Drop,
    Reason,
    Replace,
    Resolved,
    Resumed,
    Send,
    Tram,
    Waiting,
    WorkerLeaving,
    WorkerLost,
    WorkerReady,
)
from tramnet_protocol.messages import Kind, WorkId

ONE, TWO, THREE = Tram(1, 1), Tram(2, 1), Tram(3, 1)


def individuals(first, last, step=0):
    return WorkId(Kind.EVALUATE, 0, step, first, last)


def sends(instructions):
    return [i for i in instructions if isinstance(i, Send)]


def test_before_a_cost_is_known_each_worker_gets_one_individual(make_farm):
    farm = make_farm(workers=2)

    out = farm.submit(individuals(0, 10))

    assert out == [Send(ONE, individuals(0, 1)), Send(TWO, individuals(1, 2))]


def test_a_cheap_population_is_one_chunk_per_worker(make_farm):
    farm = make_farm(workers=2)
    farm.teach(Kind.EVALUATE, 1e-5, workers=2)

    out = farm.submit(individuals(0, 100))

    assert out == [Send(ONE, individuals(0, 50)), Send(TWO, individuals(50, 100))]


def test_the_last_answer_resolves_the_work(make_farm):
    farm = make_farm(workers=1)
    work = individuals(0, 1)
    [sent] = farm.submit(work)

    out = farm.answer(sent)

    assert out == [Accept(ONE, work, work), Resolved(work)]


def test_a_worker_holds_one_chunk_in_work_and_one_waiting(busy_farm):
    out = busy_farm.submit(individuals(0, 1000))

    assert sorted(sent.tram for sent in sends(out)) == [ONE, ONE, TWO, TWO]


def test_nothing_waits_behind_a_chunk_that_takes_long(make_farm):
    farm = make_farm(workers=2)
    farm.teach(Kind.EVALUATE, 1.0, workers=2)

    out = farm.submit(individuals(0, 10))

    assert sends(out) == [Send(ONE, individuals(0, 1)), Send(TWO, individuals(1, 2))]


def test_a_worker_never_holds_more_than_its_credit_in_bytes(make_farm):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVALUATE, 1e-5, workers=1)

    out = farm.submit(individuals(0, 1000), bytes_each=1024)

    assert [sent.work.size for sent in sends(out)] == [128, 128]


def test_an_individual_larger_than_the_credit_travels_alone(make_farm):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVALUATE, 1e-5, workers=1)

    out = farm.submit(individuals(0, 3), bytes_each=1_000_000)

    assert out == [Send(ONE, individuals(0, 1))]


def test_a_lost_worker_s_chunks_go_to_the_next_one_at_once(make_farm):
    farm = make_farm(workers=2)
    farm.teach(Kind.EVALUATE, 1e-5, workers=2)
    _, second = farm.submit(individuals(0, 100))

    out = farm.tell(WorkerLost(second.tram))

    assert out == [Send(ONE, second.work)]


def test_loss_of_an_unknown_worker_changes_nothing(busy_farm):
    assert busy_farm.tell(WorkerLost(Tram(1, 7))) == []


def test_an_overdue_chunk_goes_to_another_worker_and_its_worker_is_replaced(make_farm):
    farm = make_farm(workers=2)
    farm.teach(Kind.EVALUATE, 1e-5, workers=2)
    first, second = farm.submit(individuals(0, 100))
    farm.answer(second, 0.001)

    out = farm.wait(3.0)

    assert out == [Replace(ONE, Cause.OVERDUE, first.work), Send(TWO, first.work)]


def test_a_chunk_may_take_ten_times_its_measured_cost(make_farm):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVALUATE, 2.0, workers=1)
    [sent] = farm.submit(individuals(0, 1))

    assert farm.wait(19.9) == []
    assert farm.wait(0.2) == [Replace(ONE, Cause.OVERDUE, sent.work), Waiting()]


def test_an_individual_of_unknown_cost_may_take_a_minute(make_farm):
    farm = make_farm(workers=1)
    [sent] = farm.submit(individuals(0, 1))

    assert farm.wait(59.9) == []
    assert farm.wait(0.2) == [Replace(ONE, Cause.OVERDUE, sent.work), Waiting()]


def test_each_overrun_doubles_the_deadline(make_farm):
    farm = make_farm(workers=4)
    farm.teach(Kind.EVALUATE, 1e-5, workers=4)
    farm.submit(individuals(0, 1))
    overruns = []
    for _ in range(3):
        start = farm.now
        while not farm.wait(0.25):
            pass
        overruns.append(farm.now - start)

    assert overruns == pytest.approx([3.0, 6.0, 12.0], abs=0.25)


def test_the_clock_of_a_waiting_chunk_starts_when_the_one_before_it_is_answered(busy_farm):
    out = sends(busy_farm.submit(individuals(0, 1000)))
    in_work, waiting = (sent for sent in out if sent.tram == ONE)
    busy_farm.now += 2.9
    busy_farm.answer(in_work)

    out = busy_farm.wait(0.3)
    later = busy_farm.wait(2.8)

    assert Replace(TWO, Cause.OVERDUE, out[0].work) in out
    assert not any(isinstance(i, Replace) and i.tram == ONE for i in out)
    assert Replace(ONE, Cause.OVERDUE, waiting.work) in later


def test_only_the_chunk_in_work_is_blamed_for_a_death(make_farm):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVALUATE, 0.010, workers=1)
    in_work, waiting = farm.submit(individuals(0, 2))
    for incarnation in (1, 2, 3):
        farm.tell(WorkerLost(Tram(1, incarnation)))
        alone = farm.tell(WorkerReady(Tram(1, incarnation + 1)))

    after = farm.answer(alone[0])

    assert sends(alone) == [Send(Tram(1, 4), in_work.work)]  # a suspect by now
    assert sends(after) == [Send(Tram(1, 4), waiting.work)]  # not one: no fresh process is needed


def test_a_late_answer_to_open_work_is_accepted_and_its_copy_dropped(make_farm):
    farm = make_farm(workers=2)
    farm.teach(Kind.EVALUATE, 1e-5, workers=2)
    work = individuals(0, 1)
    [late] = farm.submit(work)
    [_, again] = farm.wait(3.0)

    accepted = farm.answer(late)
    dropped = farm.answer(again)

    assert accepted == [Accept(late.tram, work, work), Resolved(work)]
    assert dropped == [Drop(again.tram, work, Reason.CLOSED)]
    assert farm.scheduler.dropped[Reason.CLOSED] == 1


def test_a_late_answer_from_a_lost_worker_is_accepted(make_farm):
    farm = make_farm(workers=2)
    work = individuals(0, 1)
    [sent] = farm.submit(work)
    farm.tell(WorkerLost(ONE))

    assert farm.answer(sent) == [Accept(ONE, work, work), Resolved(work)]


def test_a_worker_whose_chunk_was_answered_by_another_keeps_its_deadline(make_farm):
    farm = make_farm(workers=2)
    farm.teach(Kind.EVALUATE, 1e-5, workers=2)
    [late] = farm.submit(individuals(0, 1))
    [_, again] = farm.wait(3.0)
    farm.answer(late)

    out = farm.wait(6.0)

    assert out == [Replace(again.tram, Cause.OVERDUE, again.work)]


def test_a_late_answer_to_a_chunk_cut_differently_since_closes_its_slots_wherever_they_are(
    make_farm,
):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVALUATE, 1e-5, workers=1)
    work = individuals(0, 8)
    [whole] = farm.submit(work)
    for incarnation in (2, 3, 4):  # dies three times: the chunk is bisected
        farm.tell(WorkerLost(Tram(1, incarnation - 1)))
        out = farm.tell(WorkerReady(Tram(1, incarnation)))
    left, right = sends(out)
    assert (left.work, right.work) == (individuals(0, 4), individuals(4, 8))
    farm.answer(left)

    out = farm.answer(whole)

    assert out == [Accept(ONE, work, individuals(4, 8)), Resolved(work)]
    assert farm.answer(right) == [Drop(right.tram, right.work, Reason.CLOSED)]


def test_a_duplicate_answer_is_dropped(make_farm):
    farm = make_farm(workers=2)
    first, _ = farm.submit(individuals(0, 3))
    farm.answer(first)

    out = farm.tell(Answered(first.tram, first.work, 0.0))

    assert Drop(first.tram, first.work, Reason.DUPLICATE) in out


@pytest.mark.parametrize("stranger", [TWO, Tram(1, 2), Tram(77, 1)])
def test_an_answer_from_one_who_was_not_given_the_work_is_dropped(make_farm, stranger):
    farm = make_farm(workers=1)
    [sent] = farm.submit(individuals(0, 1))

    out = farm.tell(Answered(stranger, sent.work, 0.0))

    assert out == [Drop(stranger, sent.work, Reason.STRANGER)]


def test_an_answer_to_work_never_submitted_is_dropped(make_farm):
    farm = make_farm(workers=1)

    out = farm.tell(Answered(ONE, individuals(0, 1), 0.0))

    assert out == [Drop(ONE, individuals(0, 1), Reason.CLOSED)]


def test_a_worker_that_claims_absurd_times_spoils_no_deadline(make_farm):
    farm = make_farm(workers=1)
    for step in range(3):
        [sent] = farm.submit(individuals(0, 1, step))
        farm.tell(Answered(ONE, sent.work, float("inf")), after=0.001)
    farm.submit(individuals(0, 1, 3))

    assert isinstance(farm.wait(3.1)[0], Replace)


def test_without_workers_the_root_waits_and_says_so_once(make_farm):
    farm = make_farm()

    assert farm.submit(individuals(0, 2)) == [Waiting()]
    assert farm.submit(individuals(0, 2, 1)) == []
    assert farm.tell(WorkerReady(ONE)) == [Send(ONE, individuals(0, 1)), Resumed()]


def test_a_worker_that_joins_in_mid_run_gets_work(make_farm):
    farm = make_farm(workers=1)
    farm.submit(individuals(0, 10))

    assert farm.tell(WorkerReady(TWO)) == [Send(TWO, individuals(1, 2))]


def test_a_worker_that_leaves_gives_its_chunks_back_and_nobody_is_blamed(make_farm):
    farm = make_farm(workers=1)
    work = individuals(0, 2)
    farm.teach(Kind.EVALUATE, 1e-5, workers=1)
    farm.submit(work)
    for incarnation in range(2, 9):
        farm.tell(WorkerLeaving(Tram(1, incarnation - 1)))
        farm.tell(WorkerLost(Tram(1, incarnation - 1)))

        out = farm.tell(WorkerReady(Tram(1, incarnation)))

        assert sends(out) == [Send(Tram(1, incarnation), work)]


def test_a_successor_on_a_seat_takes_over_from_one_not_yet_missed(make_farm):
    farm = make_farm(workers=1)
    [sent] = farm.submit(individuals(0, 1))

    out = farm.tell(WorkerReady(Tram(1, 2)))
    stale = farm.tell(WorkerLost(ONE))

    assert out == [Send(Tram(1, 2), sent.work)]
    assert stale == []


@pytest.mark.parametrize("stale", [Tram(1, 4), Tram(1, 5)])
def test_old_news_of_a_worker_s_arrival_changes_nothing(make_farm, stale):
    farm = make_farm()
    farm.tell(WorkerReady(Tram(1, 5)))
    farm.submit(individuals(0, 2))

    assert farm.tell(WorkerReady(stale)) == []


def test_a_work_submitted_twice_is_done_once(make_farm):
    farm = make_farm(workers=2)
    farm.submit(individuals(0, 1))

    assert farm.submit(individuals(0, 1)) == []


def test_several_works_share_the_workers_in_turn(make_farm):
    farm = make_farm(workers=1)
    works = [WorkId(Kind.EVALUATE, population, 0, 0, 2) for population in range(3)]
    pending = farm.submit(*works)
    order = []
    while pending:
        sent = pending.pop(0)
        if isinstance(sent, Send):
            order.append(sent.work.population)
            pending += farm.answer(sent, 1.0)

    assert order == [0, 0, 1, 2, 1, 2]


def test_time_is_not_asked_for_while_nothing_is_held(make_farm):
    assert make_farm(workers=3).scheduler.next_time() is None
