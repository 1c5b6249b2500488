"""What is always true of the scheduler's state, as code.

Each check stands for a promise: no evaluation lost (every open slot is waiting in exactly one place or given to
exactly one worker), none done twice without need, no worker above its credit, no deadline unwatched, no worker idle
while there is work for it, and nothing under way that a loss would make unfindable.
"""

from collections import deque

from tramnet_master.farm.allocation import Allocation
from tramnet_master.farm.batch import CLOSED, GIVEN, WAITING, Batch, Piece
from tramnet_master.farm.ledger import Ledger
from tramnet_master.farm.roster import Roster, Standing, Worker
from tramnet_master.farm.rules import Rules
from tramnet_master.farm.suspects import Suspects


def check(rules: Rules, ledger: Ledger, allocation: Allocation) -> None:
    """Raise AssertionError if an invariant does not hold."""
    roster, ready, suspects = allocation.roster, allocation.ready, allocation.suspects
    for worker in roster.workers.values():
        _check_worker(worker, rules, roster)
    standings = [worker.standing for worker in roster.workers.values()]
    assert roster.n_working == standings.count(Standing.WORKING)
    _check_routes(allocation)
    _check_ledger(ledger)
    _check_slots(roster, ledger, suspects)
    _check_queues(ledger, ready)
    _check_nobody_idle(rules, roster, ready, suspects)
    _check_next(roster)


def _check_worker(worker: Worker, rules: Rules, roster: Roster) -> None:
    seat, standing = worker.tram.seat, worker.standing
    working = standing is Standing.WORKING
    assert roster.workers[seat] is worker
    assert worker.bytes == sum(assignment.bytes for assignment in worker.held)
    assert len(worker.held) <= rules.credit_chunks
    assert worker.bytes <= rules.credit_bytes or len(worker.held) == 1
    assert (seat in roster.empty) == (working and not worker.held)
    assert (seat in roster.fresh) == (working and worker.fresh)
    assert (seat in roster.partly) == (working and roster.can_queue(worker))
    assert not (worker.fresh and worker.held)
    if worker.held and standing is not Standing.RETIRED:
        assert worker.timer is not None
        assert worker.timer <= worker.deadline
    if standing is Standing.RETIRED:
        assert not worker.bound
        assert not any(assignment.live for assignment in worker.held)
    if standing is Standing.DRAINING:
        assert worker.held
    if any(assignment.piece.suspect for assignment in worker.held):
        assert len(worker.held) == 1


def _check_next(roster: Roster) -> None:
    """Of those that hold nothing, one of the nearest the root is next."""
    worker = roster.next_worker()
    if roster.empty:
        assert worker is not None
        assert not worker.held
        assert worker.way == min(idle.way for idle in roster.empty.values())


def _check_routes(allocation: Allocation) -> None:
    """What is under way is known to pass whatever its worker's frames pass now."""
    for worker in allocation.roster.workers.values():
        for assignment in worker.held:
            assert assignment.via.issuperset(allocation.routes.get(worker.tram, ()))


def _check_ledger(ledger: Ledger) -> None:
    chunks = [chunk for batch in ledger.open.values() for chunk in batch.chunks]
    assert len(chunks) == len(set(chunks))
    assert set(chunks) == set(ledger.given)
    for work, batch in ledger.open.items():
        assert batch.work == work
        assert 0 < batch.open == batch.work.size - batch.slots.count(CLOSED)


def _check_slots(roster: Roster, ledger: Ledger, suspects: Suspects) -> None:
    """Each open slot waits in one place or is given to one worker."""
    waiting: dict[int, list[Piece]] = {id(batch): [] for batch in ledger.open.values()}
    given: dict[int, list[Piece]] = {id(batch): [] for batch in ledger.open.values()}
    for batch in ledger.open.values():
        waiting[id(batch)] += [*batch.returned, Piece(batch.uncut, batch.work.last)]
    for batch, piece in suspects.waiting:
        waiting.get(id(batch), []).append(piece)
    for worker in roster.workers.values():
        for assignment in worker.held:
            if assignment.live and id(assignment.batch) in given:
                given[id(assignment.batch)].append(assignment.piece)
                assert ledger.given[assignment.work][worker.tram] is assignment
    for batch in ledger.open.values():
        _check_partition(batch, waiting[id(batch)], given[id(batch)])


def _check_partition(batch: Batch, waiting: list[Piece], given: list[Piece]) -> None:
    expected = bytearray((CLOSED,)) * batch.work.size
    for state, pieces in ((WAITING, waiting), (GIVEN, given)):
        for piece in pieces:
            for i in range(piece.first - batch.work.first, piece.last - batch.work.first):
                if batch.slots[i] != CLOSED:
                    assert expected[i] == CLOSED, f"slot {i} of {batch.work} is in two places"
                    expected[i] = state
    assert expected == batch.slots, f"{batch.work}: slots {batch.slots!r}, found {expected!r}"


def _check_queues(ledger: Ledger, ready: deque[Batch]) -> None:
    assert len({id(batch) for batch in ready}) == len(ready)
    assert all(batch.queued for batch in ready)
    for batch in ledger.open.values():
        if batch.affinity is None:
            assert not batch.parked
            assert batch.queued or WAITING not in batch.slots or not _can_be_cut(batch)


def _can_be_cut(batch: Batch) -> bool:
    return batch.uncut < batch.work.last or any(batch.trim(piece) for piece in batch.returned)


def _check_nobody_idle(
    rules: Rules, roster: Roster, ready: deque[Batch], suspects: Suspects
) -> None:
    if any(_can_be_cut(batch) for batch in ready):
        assert not roster.empty
        assert not roster.partly or any(
            2 * batch.least_bytes > rules.credit_bytes for batch in ready
        )
    if suspects.first():
        assert not roster.fresh
    for worker in roster.workers.values():
        if worker.standing is Standing.WORKING and not worker.held:
            assert not any(
                batch.affinity == worker.tram and not batch.parked and _can_be_cut(batch)
                for batch in worker.bound
            )
