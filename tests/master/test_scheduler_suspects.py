"""Stories of individuals that kill, hang or fail: who is blamed, isolated and condemned."""

import pytest

from tramnet_master.farm.events import (
    Accept,
    Answered,
    Cause,
    Condemn,
    Drop,
    Raised,
    Reason,
    Replace,
    Resolved,
    Send,
    Tick,
    Tram,
    WorkerLost,
    WorkerReady,
)
from tramnet_protocol.messages import Kind, WorkId


def individuals(first, last):
    return WorkId(Kind.EVALUATE, 0, 0, first, last)


def sends(instructions):
    return [i for i in instructions if isinstance(i, Send)]


class Land:
    """Workers that behave, but for what one poison slot makes them do; supervisors replace them."""

    def __init__(self, farm, poison, effect):
        self.farm, self.poison, self.effect = farm, poison, effect
        self.incarnation = 1
        self.fresh = {Tram(seat, 1) for seat in range(1, 10)}
        self.log = []
        self.trials = []  # (chunk, worker, whether its process was fresh) with the poison in it

    def run(self, instructions):
        queue = list(instructions)
        while queue or self.farm.scheduler.next_time() is not None:
            if not queue:
                self.farm.now = max(self.farm.now, self.farm.scheduler.next_time())
                queue += self.farm.tell(Tick())
                continue
            instruction = queue.pop(0)
            self.log.append(instruction)
            if isinstance(instruction, Send):
                queue += self.compute(instruction)
            elif isinstance(instruction, Replace):
                queue += self.restart(instruction.tram)

    def compute(self, sent):
        was_fresh = sent.tram in self.fresh
        self.fresh.discard(sent.tram)
        if not sent.work.first <= self.poison < sent.work.last:
            return self.farm.answer(sent, 1e-5 * sent.work.size)
        self.trials.append((sent.work, sent.tram, was_fresh))
        if self.effect == "kill":
            return self.restart(sent.tram)
        if self.effect == "raise":
            return self.farm.fail(sent)
        if self.effect == "nan":
            return self.farm.answer(sent, 1e-5, bad=(self.poison,))
        return []  # hangs

    def restart(self, tram):
        self.incarnation += 1
        successor = Tram(tram.seat, self.incarnation)
        self.fresh.add(successor)
        return self.farm.tell(WorkerLost(tram)) + self.farm.tell(WorkerReady(successor))


@pytest.mark.parametrize("effect", ["kill", "hang", "raise", "nan"])
@pytest.mark.parametrize("workers", [1, 2, 5])
@pytest.mark.parametrize("poison", [0, 17, 63])
def test_a_poison_individual_is_found_and_nobody_else_condemned(make_farm, effect, workers, poison):
    farm = make_farm(workers=workers)
    farm.teach(Kind.EVALUATE, 1e-5, workers=workers)
    land = Land(farm, poison, effect)
    work = individuals(0, 64)

    land.run(farm.submit(work))

    condemned = [i.work for i in land.log if isinstance(i, Condemn)]
    accepted = [i.part for i in land.log if isinstance(i, Accept)]
    assert condemned == [individuals(poison, poison + 1)]
    assert sorted(slot for part in accepted for slot in range(part.first, part.last)) == [
        slot for slot in range(64) if slot != poison
    ]
    assert land.log.count(Resolved(work)) == 1


@pytest.mark.parametrize("effect", ["kill", "hang", "raise", "nan"])
def test_an_individual_is_condemned_only_after_three_failures_alone_in_fresh_processes(
    make_farm, effect
):
    farm = make_farm(workers=2)
    farm.teach(Kind.EVALUATE, 1e-5, workers=2)
    land = Land(farm, 5, effect)
    land.fresh.clear()  # they have learnt what work costs

    land.run(farm.submit(individuals(0, 16)))

    last = land.trials[-3:]
    assert [(work.size, fresh) for work, _, fresh in last] == [(1, True)] * 3
    assert len({tram for _, tram, _ in last}) == 3


@pytest.mark.parametrize("effect", ["kill", "hang"])
def test_a_chunk_is_bisected_after_three_accidents(make_farm, effect):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVALUATE, 1e-5, workers=1)
    land = Land(farm, 0, effect)

    land.run(farm.submit(individuals(0, 8)))

    sizes = [work.size for work, _, _ in land.trials]
    assert sizes == [8] * 3 + [4] * 3 + [2] * 3 + [1] * 3 + [1] * 3


@pytest.mark.parametrize("effect", ["raise", "nan"])
def test_an_error_separates_the_individuals_at_once(make_farm, effect):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVALUATE, 1e-5, workers=1)
    land = Land(farm, 0, effect)

    land.run(farm.submit(individuals(0, 8)))

    assert [work.size for work, _, _ in land.trials] == [8, 1, 1, 1, 1]


def test_the_good_values_of_a_chunk_with_a_bad_one_are_kept(make_farm):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVALUATE, 1e-5, workers=1)
    [sent] = farm.submit(individuals(0, 5))

    out = farm.answer(sent, 1e-5, bad=(2,))

    assert out == [
        Accept(sent.tram, sent.work, individuals(0, 2)),
        Accept(sent.tram, sent.work, individuals(3, 5)),
        Send(sent.tram, individuals(2, 3)),
    ]


def test_a_copy_of_a_bad_answer_is_not_a_second_failure(make_farm):
    farm = make_farm(workers=2)
    farm.teach(Kind.EVALUATE, 1e-5, workers=2)
    [sent, _] = farm.submit(individuals(0, 2))
    bad = Answered(sent.tram, sent.work, 0.0, bad=(0,))
    farm.tell(bad)

    assert farm.tell(bad) == [Drop(sent.tram, sent.work, Reason.DUPLICATE)]


def test_an_error_from_a_worker_that_lost_the_work_is_dropped(make_farm):
    farm = make_farm(workers=2)
    [sent] = farm.submit(individuals(0, 1))
    farm.tell(WorkerLost(sent.tram))

    out = farm.tell(Raised(sent.tram, sent.work, "MemoryError"))

    assert out == [Drop(sent.tram, sent.work, Reason.LATE_ERROR)]


def test_a_suspect_waits_until_a_busy_worker_has_made_place_for_a_fresh_process(make_farm):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVALUATE, 0.010, workers=1)
    first, second = farm.submit(individuals(0, 2))

    drained = farm.fail(first)
    replaced = farm.answer(second, 0.010)
    farm.tell(WorkerLost(Tram(1, 1)))
    tried = farm.tell(WorkerReady(Tram(1, 2)))

    assert sends(drained) == []
    assert Replace(Tram(1, 1), Cause.FRESH_PROCESS) in replaced
    assert sends(tried) == [Send(Tram(1, 2), individuals(0, 1))]


def test_a_suspect_does_not_go_to_a_process_that_comes_back(make_farm):
    farm = make_farm(workers=1)
    farm.teach(Kind.EVALUATE, 0.010, workers=1)
    [sent] = farm.submit(individuals(0, 1))
    farm.fail(sent)
    farm.tell(WorkerLost(Tram(1, 1)))

    worn = farm.tell(WorkerReady(Tram(1, 2), fresh=False))
    farm.wait(100.0)
    fresh = farm.tell(WorkerReady(Tram(2, 3)))

    assert sends(worn) == []
    assert sends(fresh) == [Send(Tram(2, 3), individuals(0, 1))]


def test_at_most_half_of_the_workers_are_replaced_for_suspects_at_a_time(make_farm):
    farm = make_farm(workers=4)
    farm.teach(Kind.EVALUATE, 1e-5, workers=4)
    suspects = []
    for sent in farm.submit(individuals(0, 4)):
        suspects += farm.fail(sent)

    replaced = [i.tram for i in suspects if isinstance(i, Replace)]
    assert len(replaced) == 2


def test_a_fresh_process_that_never_comes_is_asked_for_again(make_farm):
    farm = make_farm(workers=2)
    farm.teach(Kind.EVALUATE, 1e-5, workers=2)
    [sent] = farm.submit(individuals(0, 1))
    [first] = farm.fail(sent)
    farm.tell(WorkerLost(first.tram))

    assert farm.wait(59.0) == []
    [second] = [i for i in farm.wait(2.0) if isinstance(i, Replace)]

    assert second == Replace(Tram(3 - first.tram.seat, 1), Cause.FRESH_PROCESS)


def test_random_kills_condemn_nobody(make_farm):
    farm = make_farm(workers=3)
    farm.teach(Kind.EVALUATE, 1e-5, workers=3)
    work = individuals(0, 60)
    pending = sends(farm.submit(work))
    for kill in range(40):  # every other chunk is killed, always another worker's
        sent = pending.pop(kill % len(pending))
        if kill % 2:
            pending += sends(farm.answer(sent, 1e-5 * sent.work.size))
        else:
            lost = farm.tell(WorkerLost(sent.tram))
            ready = farm.tell(WorkerReady(Tram(sent.tram.seat, sent.tram.incarnation + 1)))
            pending = [s for s in pending if s.tram != sent.tram] + sends(lost + ready)
        if not pending:
            break

    assert not any(isinstance(i, Condemn) for i in farm.told)
    assert Resolved(work) in farm.told
