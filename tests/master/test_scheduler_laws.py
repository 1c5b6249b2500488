"""Laws of the scheduler under any sequence of events, sensible or not."""

import itertools

from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.farm.batch import runs
from tramnet_master.farm.events import (
    Accept,
    Answered,
    Condemn,
    Raised,
    Replace,
    Resolved,
    Send,
    Tick,
    Tram,
    WorkerLeaving,
    WorkerLost,
    WorkerReady,
    WorkSubmitted,
)
from tramnet_master.farm.scheduler import Scheduler
from tramnet_protocol.messages import Kind, WorkId

trams = st.builds(Tram, st.integers(1, 3), st.integers(1, 3))
work_ids = st.builds(
    lambda kind, step, first, size: WorkId(kind, 0, step, first, first + size),
    st.sampled_from(Kind),
    st.integers(0, 1),
    st.sampled_from((0, 4)),
    st.integers(1, 4),
)
wholes = work_ids.map(lambda work: WorkId(work.kind, 0, work.step, 0, 8))
seconds = st.floats(allow_nan=True, allow_infinity=True)
bad = st.lists(st.integers(-2, 12), max_size=3).map(tuple)
events = st.one_of(
    st.builds(WorkerReady, trams),
    st.builds(WorkerLost, trams),
    st.builds(WorkerLeaving, trams),
    st.builds(
        WorkSubmitted, wholes, st.sampled_from((0, 10, 200_000)), st.booleans(), st.none() | trams
    ),
    st.builds(Answered, trams, work_ids | wholes, seconds, bad),
    st.builds(Raised, trams, work_ids | wholes, st.just("ValueError")),
    st.just(Tick()),
    st.integers(0, 20),  # the n-th chunk on its way is answered
)


def slots(work):
    return [(work.kind, work.step, slot) for slot in range(work.first, work.last)]


class Witness:
    """Plays events and keeps its own books."""

    def __init__(self):
        self.scheduler = Scheduler()
        self.now = 0.0
        self.sent = []
        self.fates = {}
        self.resolved = []

    def tell(self, event, after):
        self.now += after
        if isinstance(event, int):
            if not self.sent:
                return
            sent = self.sent.pop(event % len(self.sent))
            event = Answered(sent.tram, sent.work, after)
        for instruction in self.scheduler.handle(event, self.now):
            self.note(instruction)
        self.scheduler.validate()

    def note(self, instruction):
        match instruction:
            case Send():
                self.sent.append(instruction)
            case Accept(_, _, work) | Condemn(work, _):
                for slot in slots(work):
                    assert slot not in self.fates
                    self.fates[slot] = instruction
            case Resolved(work):
                self.resolved.append(work)
                for slot in slots(work):  # it may be submitted anew from now on
                    del self.fates[slot]


@given(st.lists(st.tuples(events, st.sampled_from((0.0, 0.001, 2.0, 100.0))), max_size=60))
def test_any_events_leave_the_scheduler_sound(story):
    witness = Witness()

    for event, after in story:
        witness.tell(event, after)


@given(st.lists(st.tuples(events, st.sampled_from((0.0, 0.001, 2.0, 100.0))), max_size=40))
def test_whatever_happened_good_workers_finish_the_work(story):
    witness = Witness()
    for event, after in story:
        witness.tell(event, after)
    submitted = {event.work for event, _ in story if isinstance(event, WorkSubmitted)}
    for seat, incarnation in itertools.product((1, 2, 3), repeat=2):
        witness.tell(WorkerLost(Tram(seat, incarnation)), 0.0)
    witness.resolved.clear()

    for incarnation in range(4, 100):  # a fresh process each time, for suspects
        for work in submitted.difference(witness.resolved):  # also releases what was orphaned
            witness.tell(WorkSubmitted(work), 0.0)
        witness.sent.clear()
        witness.tell(WorkerReady(Tram(1, incarnation)), 0.0)
        while witness.sent:
            witness.tell(0, 0.001)

    assert submitted == set(witness.resolved)


@given(st.lists(st.tuples(events, st.sampled_from((0.0, 2.0))), max_size=40))
def test_the_same_events_have_the_same_consequences(story):
    told = []
    for _ in range(2):
        scheduler, now = Scheduler(), 0.0
        instructions = []
        for event, after in story:
            now += after
            if not isinstance(event, int):
                instructions += scheduler.handle(event, now)
        told.append(instructions)

    assert told[0] == told[1]


@given(st.lists(st.tuples(events, st.sampled_from((0.0, 2.0, 100.0))), max_size=60))
def test_a_worker_that_is_to_be_replaced_is_given_nothing_more(story):
    scheduler, now, gone = Scheduler(), 0.0, set()

    for event, after in story:
        now += after
        if isinstance(event, int):
            continue
        if isinstance(event, WorkerLost | WorkerLeaving):
            gone.add(event.tram)
        if isinstance(event, WorkerReady):
            gone.discard(event.tram)  # the roster judges whether it may come back
        for instruction in scheduler.handle(event, now):
            if isinstance(instruction, Replace):
                gone.add(instruction.tram)
            if isinstance(instruction, Send):
                assert instruction.tram not in gone


@given(st.sets(st.integers(0, 30)))
def test_runs_are_maximal_and_make_up_the_slots(slots):
    found = list(runs(sorted(slots)))

    assert [slot for first, last in found for slot in range(first, last)] == sorted(slots)
    assert all(last < first for (_, last), (first, _) in itertools.pairwise(found))
