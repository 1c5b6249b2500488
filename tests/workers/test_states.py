"""Stories of one worker: events in a list, and what it does."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import (
    Evaluate,
    Evaluated,
    Evolve,
    Failed,
    Kind,
    PopulationMeans,
    PopulationSnapshot,
    Setup,
    WorkId,
)
from tramnet_workers.node.states import (
    CREDIT,
    REMEMBERED,
    Announce,
    Answer,
    AnswerAgain,
    Build,
    BuildFailed,
    Built,
    Finished,
    Joined,
    Leave,
    Membership,
    Phase,
    Reject,
    Rejoin,
    RootLost,
    Start,
    StopReceived,
    Why,
    WorkerStates,
    WorkReceived,
)

ME = Membership(root=1, seat=2, incarnation=3)
SUCCESSOR = Membership(root=2, seat=2, incarnation=3)
SETUP = Setup("sphere", {"dimension": 3})
EMPTY = Array("<f8", (0,), b"")


def work(i):
    return Evaluate(WorkId(Kind.EVALUATE, 0, 0, i, i + 1), EMPTY)


def outcome(i):
    return Evaluated(work(i).work, EMPTY, 0.001)


def tell(worker, *events):
    return [instruction for event in events for instruction in worker.handle(event)]


@pytest.fixture
def worker():
    """A worker that can take work."""
    states = WorkerStates()
    tell(states, Joined(ME, SETUP), Built(ME))
    return states


def test_a_worker_builds_the_problem_before_it_shows_itself():
    states = WorkerStates()

    assert tell(states, Joined(ME, SETUP)) == [Build(ME, SETUP)]
    assert tell(states, Built(ME)) == [Announce(ME)]


def test_work_that_comes_while_the_problem_is_built_waits_for_it():
    states = WorkerStates()
    tell(states, Joined(ME, SETUP))

    assert tell(states, WorkReceived(ME, work(0))) == []
    assert tell(states, Built(ME)) == [Announce(ME), Start(ME, work(0))]


def test_a_problem_that_cannot_be_built_ends_the_worker_with_an_error():
    states = WorkerStates()
    tell(states, Joined(ME, SETUP))

    assert tell(states, BuildFailed(ME, "UnknownProblem")) == [Leave("UnknownProblem", failed=True)]


def test_a_chunk_is_evaluated_and_answered(worker):
    assert tell(worker, WorkReceived(ME, work(0))) == [Start(ME, work(0))]
    assert tell(worker, Finished(ME, outcome(0))) == [Answer(ME, outcome(0))]


def test_an_error_is_an_answer_too(worker):
    failed = Failed(work(0).work, "ValueError")
    tell(worker, WorkReceived(ME, work(0)))

    assert tell(worker, Finished(ME, failed)) == [Answer(ME, failed)]


def test_the_waiting_chunk_starts_when_the_one_in_work_is_finished(worker):
    tell(worker, WorkReceived(ME, work(0)))

    assert tell(worker, WorkReceived(ME, work(1))) == []
    assert tell(worker, Finished(ME, outcome(0))) == [Start(ME, work(1)), Answer(ME, outcome(0))]


def test_a_chunk_beyond_the_credit_is_dropped_and_counted(worker):
    tell(worker, WorkReceived(ME, work(0)), WorkReceived(ME, work(1)))

    out = tell(worker, WorkReceived(ME, work(2)))

    assert out == [Reject(work(2).work, Why.BEYOND_CREDIT)]
    assert worker.rejected[Why.BEYOND_CREDIT] == 1


@pytest.mark.parametrize("i", [0, 1])
def test_a_chunk_that_is_held_already_is_dropped(worker, i):
    tell(worker, WorkReceived(ME, work(0)), WorkReceived(ME, work(1)))

    assert tell(worker, WorkReceived(ME, work(i))) == [Reject(work(i).work, Why.HELD)]


@pytest.mark.parametrize(
    "other", [SUCCESSOR, Membership(1, 2, 2), Membership(1, 1, 3), Membership(9, 9, 9)]
)
def test_work_for_another_membership_is_dropped(worker, other):
    assert tell(worker, WorkReceived(other, work(0))) == [Reject(work(0).work, Why.FOREIGN)]


def test_a_worker_that_never_joined_takes_no_work():
    assert tell(WorkerStates(), WorkReceived(ME, work(0))) == [Reject(work(0).work, Why.FOREIGN)]


def test_an_outcome_nobody_began_is_dropped(worker):
    assert tell(worker, Finished(ME, outcome(0))) == [Reject(work(0).work, Why.UNEXPECTED)]


def test_a_worker_that_loses_its_root_forgets_its_work_and_asks_for_a_seat_again(worker):
    tell(worker, WorkReceived(ME, work(0)), WorkReceived(ME, work(1)))

    assert tell(worker, RootLost()) == [Rejoin()]
    assert worker.held == []
    assert worker.phase is Phase.OUTSIDE
    assert tell(worker, RootLost()) == []


def test_an_evaluation_that_outlives_its_root_is_not_answered_to_the_next_one(worker):
    tell(worker, WorkReceived(ME, work(0)), RootLost(), Joined(SUCCESSOR, SETUP))
    waiting = tell(worker, Built(SUCCESSOR), WorkReceived(SUCCESSOR, work(0)))

    out = tell(worker, Finished(ME, outcome(0)))

    assert waiting == [Announce(SUCCESSOR)]  # the evaluator is still busy
    assert out == [Reject(work(0).work, Why.FOREIGN), Start(SUCCESSOR, work(0))]


def test_a_problem_built_for_a_lost_root_announces_nobody():
    states = WorkerStates()
    tell(states, Joined(ME, SETUP), RootLost(), Joined(SUCCESSOR, SETUP))

    assert tell(states, Built(ME), BuildFailed(ME, "late")) == []
    assert tell(states, Built(SUCCESSOR)) == [Announce(SUCCESSOR)]


def test_a_second_reply_to_the_same_join_changes_nothing(worker):
    tell(worker, WorkReceived(ME, work(0)))

    assert tell(worker, Joined(ME, SETUP)) == []
    assert tell(worker, Finished(ME, outcome(0))) == [Answer(ME, outcome(0))]


def test_after_stop_nothing_happens_any_more(worker):
    tell(worker, WorkReceived(ME, work(0)))

    assert tell(worker, StopReceived("scaled down")) == [Leave("scaled down")]
    assert tell(worker, Finished(ME, outcome(0)), WorkReceived(ME, work(1)), RootLost()) == []


memberships = st.sampled_from((ME, SUCCESSOR))
indices = st.integers(0, 4)
any_event = st.one_of(
    st.builds(Joined, memberships, st.just(SETUP)),
    st.builds(Built, memberships),
    st.builds(WorkReceived, memberships, indices.map(work)),
    st.builds(Finished, memberships, indices.map(outcome)),
    st.just(RootLost()),
)


@given(st.lists(any_event, max_size=60))
def test_any_events_leave_one_chunk_in_work_and_one_waiting_at_most(story):
    worker = WorkerStates()
    for event in story:
        running = worker.running
        if isinstance(event, Finished) and running == (event.membership, event.answer.work):
            running = None

        out = worker.handle(event)

        starts = [i for i in out if isinstance(i, Start)]
        assert len(starts) <= (running is None)
        assert all(i.membership == worker.membership for i in out if isinstance(i, Start | Answer))
        assert len(worker.held) <= CREDIT
        if worker.phase is Phase.WORKING and worker.held:
            assert worker.running is not None


@given(st.lists(any_event, max_size=60))
def test_every_answer_was_begun_and_is_given_once(story):
    worker = WorkerStates()
    begun = []

    for event in story:
        out = worker.handle(event)
        for answer in (i for i in out if isinstance(i, Answer)):
            begun.remove((answer.membership, answer.answer.work))
        begun += [(i.membership, i.work.work) for i in out if isinstance(i, Start)]


EVOLVED = Evolve(WorkId(Kind.EVOLVE, 0, 3, 0, 1), EMPTY)


def evolved(step):
    work = WorkId(Kind.EVOLVE, 0, step, 0, 1)
    return PopulationMeans(work, EMPTY, EMPTY, 0.001)


def test_a_chunk_that_comes_again_after_its_answer_is_answered_again_not_computed(worker):
    tell(worker, WorkReceived(ME, work(0)), Finished(ME, outcome(0)))

    assert tell(worker, WorkReceived(ME, work(0))) == [AnswerAgain(Answer(ME, outcome(0)))]
    assert worker.held == []


def test_a_snapshot_belongs_to_its_answer_also_when_that_is_sent_again(worker):
    snapshot = PopulationSnapshot(EVOLVED.work, EMPTY, EMPTY)
    finished = Finished(ME, evolved(3), snapshot)

    out = tell(worker, WorkReceived(ME, EVOLVED), finished, WorkReceived(ME, EVOLVED))

    answer = Answer(ME, evolved(3), snapshot)
    assert out[1:] == [answer, AnswerAgain(answer)]


def test_a_chunk_that_brings_its_state_is_computed_again(worker):
    restored = Evolve(EVOLVED.work, EMPTY, populations=EMPTY)
    tell(worker, WorkReceived(ME, restored), Finished(ME, evolved(3)))

    assert tell(worker, WorkReceived(ME, restored)) == [Start(ME, restored)]


def test_an_error_is_not_remembered(worker):
    tell(worker, WorkReceived(ME, work(0)), Finished(ME, Failed(work(0).work, "ValueError")))

    assert tell(worker, WorkReceived(ME, work(0))) == [Start(ME, work(0))]


def test_only_the_last_answers_are_remembered_and_only_in_their_membership(worker):
    for i in range(REMEMBERED + 1):
        tell(worker, WorkReceived(ME, work(i)), Finished(ME, outcome(i)))

    assert tell(worker, WorkReceived(ME, work(0)))[0] == Start(ME, work(0))
    tell(worker, RootLost(), Joined(SUCCESSOR, SETUP), Built(SUCCESSOR))
    assert worker.remembered == {}
