"""Which chunk goes to which worker, and what happens when one is lost: a pure state machine.

Events in, instructions out (``events.py``). There is no clock here (time comes with each event), no socket, no
thread and no chance, so everything that can happen to a farm can be written down as a list and tried.

Rules of this file:

1. It sees identities, sizes, costs and affinities, never content. All three kinds of work are alike to it.
2. A slot is given to one worker at a time. Only when that worker is lost, asked to leave or declared overdue
   is it given to another; from then on any of them may answer, and the first answer closes it.
3. An answer is judged by the ledger: who was given this chunk of open work. It does not matter whether the
   worker still lives, how late it is or how the chunk has been cut since. It is accepted slot by slot.
4. Each worker holds at most one chunk in work and one waiting. Only the chunk in work has a running deadline,
   and only it is blamed for a death. The clock of the waiting one starts when the one before it is answered.
5. A death that the root asked for blames nobody.
6. A worker that overran is asked nothing more, and its supervisor is to replace it.
7. A suspect (``escalation.py``) goes to a fresh, idle process and has it to itself. Where there is none, an
   idle worker is replaced to get one, or a busy one when it has finished; at most half of them at a time.
8. Work with affinity goes to the TRAM that holds its state and nowhere else. When that TRAM is lost, overdue or
   fails at it, ``Orphaned`` tells the engine, and the work waits, with its history, until the engine submits it
   again together with the state. A suspect with affinity goes to a fresh process in spite of it.
9. Where workers pass on each other's frames, a lost TRAM takes along what was under way through it, answers too.
   What may have passed it, by any wiring since it was sent, is sent again to the same worker at once: ``Repeat``.
   Nothing is taken from a worker because somebody on the way to it was lost.
10. Work that is overdue is first blamed on silence: the silent TRAM nearest the root on the way, or the worker
   itself, has stalled. It is replaced and wired out, which ends like a loss; those behind it get their time anew.
11. Several works share the workers in turn, chunk by chunk; what came back goes first.

This file judges what has happened; ``allocation.py`` gives work; ``invariants.py`` says what is always true, and
tests call ``validate`` after every event. The common case, one worker and one chunk per generation, is on the
hot path (``benchmarks/scheduler.py``).
"""

from collections import Counter

from tramnet_master.farm.allocation import Allocation, Turn
from tramnet_master.farm.batch import Assignment, Batch, Piece
from tramnet_master.farm.escalation import after_accident, after_error
from tramnet_master.farm.events import (
    Accept,
    Answered,
    Cause,
    Condemn,
    Drop,
    Event,
    Instruction,
    Raised,
    Reason,
    Replace,
    Resolved,
    Resumed,
    Rewired,
    Tick,
    Tram,
    Waiting,
    WorkerLeaving,
    WorkerLost,
    WorkerReady,
    WorkSubmitted,
)
from tramnet_master.farm.invariants import check
from tramnet_master.farm.ledger import Ledger
from tramnet_master.farm.roster import Standing, Worker
from tramnet_master.farm.rules import Rules


class Scheduler:
    """The farm's decisions.

    Attributes:
        dropped: Answers dropped so far, by reason.
    """

    def __init__(self, rules: Rules | None = None) -> None:
        self.dropped: Counter[Reason] = Counter()
        self._rules = rules or Rules()
        self._turn = Turn()
        self._ledger = Ledger()
        self._allocation = Allocation(self._rules, self._ledger, self._turn)
        self._roster = self._allocation.roster
        self._waiting = False  # whether Waiting was said and Resumed was not
        self._stalled: set[Tram] = set()  # declared so, and not yet lost

    def handle(self, event: Event, now: float) -> list[Instruction]:
        """Instructions that follow from an event.

        Args:
            event: What happened.
            now: Monotonic time [s].
        """
        self._turn.now = now
        self._turn.out = []
        match event:
            case Answered():
                self._answered(event)
            case WorkSubmitted():
                self._submitted(event)
            case Tick():
                for worker in self._roster.overdue(now):
                    self._overdue(worker, event.silent)
            case Rewired():
                self._allocation.rewire(event.routes)
                return self._turn.out  # who joined or was lost comes next
            case WorkerReady():
                self._joined(event)
            case WorkerLeaving():
                self._leaving(event.tram)
            case WorkerLost():
                self._lost(event.tram, *event.others)
            case Raised():
                self._raised(event)
        self._allocation.dispatch()
        self._say_whether_waiting()
        return self._turn.out

    def next_time(self) -> float | None:
        """When the next ``Tick`` is due [s], or None while nothing is timed."""
        return self._roster.next_time()

    def validate(self) -> None:
        """Check every invariant; the cost grows with all that is open, so this is for tests."""
        check(self._rules, self._ledger, self._allocation)

    def _submitted(self, event: WorkSubmitted) -> None:
        batch = self._ledger.open.get(event.work)
        if batch is None:
            batch = Batch(event)
            self._ledger.open[event.work] = batch
        elif batch.parked:
            batch.parked = False
            batch.affinity, batch.generations = event.affinity, event.generations
        else:
            return
        self._allocation.release(batch)

    def _answered(self, event: Answered) -> None:
        worker = self._allocation.unload(event)
        assignment = self._judge(event)
        if assignment is not None:
            live = assignment.answer()
            bad = assignment.spoilt(event.bad)
            parts = assignment.batch.close(assignment.piece, bad)
            self._turn.out += [Accept(event.tram, event.work, part) for part in parts]
            if live:
                self._measure(assignment, event.seconds, worker)
                if bad:
                    self._error(assignment, "unusable values")
            elif not parts:
                self._drop(event, Reason.LATE_ERROR if bad else Reason.CLOSED)
            self._settle(assignment.batch)
        self._allocation.refill(worker)

    def _raised(self, event: Raised) -> None:
        worker = self._allocation.unload(event)
        assignment = self._judge(event)
        if assignment is not None:
            if assignment.answer():
                self._error(assignment, event.error)
            else:
                self._drop(event, Reason.LATE_ERROR)
            self._settle(assignment.batch)
        self._allocation.refill(worker)

    def _judge(self, event: Answered | Raised) -> Assignment | None:
        """What the sender was given, if it may answer it; otherwise the answer is dropped."""
        verdict = self._ledger.judge(event.tram, event.work)
        if isinstance(verdict, Reason):
            self._drop(event, verdict)
            return None
        return verdict

    def _drop(self, event: Answered | Raised, reason: Reason) -> None:
        self.dropped[reason] += 1
        self._turn.out.append(Drop(event.tram, event.work, reason))

    def _measure(self, assignment: Assignment, seconds: float, worker: Worker | None) -> None:
        """Learn what a chunk took; a worker cannot claim more time than has passed."""
        passed = self._turn.now - assignment.sent
        spent = seconds if 0.0 <= seconds <= passed else passed
        warm = worker is not None and worker.warm
        self._allocation.costs.observe(assignment.work.kind, assignment.cost, spent, warm)
        if worker is not None:
            worker.warm = True

    def _accident(self, assignment: Assignment, error: str) -> None:
        """Try again what is still open of a chunk whose worker died or overran with it."""
        batch = assignment.batch
        for piece in batch.take_back(assignment.piece):
            atomic = batch.is_atomic(piece)
            self._try_again(batch, piece, after_accident(piece, atomic, error, self._rules), error)
        self._settle(batch)

    def _error(self, assignment: Assignment, error: str) -> None:
        """Try again what is still open of a chunk that could not be evaluated."""
        batch = assignment.batch
        alone = batch.is_atomic(assignment.piece)
        for piece in batch.take_back(assignment.piece):
            self._try_again(batch, piece, after_error(piece, alone, error, self._rules), error)

    def _try_again(self, batch: Batch, piece: Piece, again: list[Piece], error: str) -> None:
        for smaller in again:
            self._allocation.put_back(batch, smaller)
        if not again:
            self._turn.out.extend(Condemn(part, error) for part in batch.close(piece))

    def _settle(self, batch: Batch) -> None:
        if self._ledger.settle(batch):
            self._turn.out.append(Resolved(batch.work))

    def _joined(self, event: WorkerReady) -> None:
        tram = event.tram
        present = self._roster.workers.get(tram.seat)
        if present is not None:
            if tram.incarnation <= present.tram.incarnation:
                return
            self._lost(present.tram)
        self._roster.add(tram, event.fresh)
        if event.fresh:
            self._allocation.suspects.welcome()

    def _leaving(self, tram: Tram) -> None:
        worker = self._roster.find(tram)
        if worker is not None:
            self._retire(worker, blame=None)

    def _lost(self, *trams: Tram) -> None:
        found = [worker for tram in trams if (worker := self._roster.find(tram)) is not None]
        for worker in found:
            self._retire(worker, blame="its worker died")
            self._roster.remove(worker)
        lost = frozenset(worker.tram for worker in found)
        self._stalled -= lost
        if lost:
            self._allocation.repeat_what_passed(lost)

    def _overdue(self, worker: Worker, silent: frozenset[Tram]) -> None:
        way = (*self._allocation.routes.get(worker.tram, ()), worker.tram)
        stalled = next((tram for tram in way if tram in silent), None)
        if stalled is None:
            self._turn.out.append(Replace(worker.tram, Cause.OVERDUE, worker.held[0].work))
            self._retire(worker, blame="its deadline passed")
            return
        if stalled not in self._stalled:
            self._stalled.add(stalled)
            self._turn.out.append(Replace(stalled, Cause.STALLED, worker.held[0].work))
            culprit = self._roster.find(stalled)
            if culprit is not None:
                self._retire(culprit, blame="its worker fell silent")
        if worker.standing is not Standing.RETIRED:
            self._allocation.restart_clock(worker)

    def _retire(self, worker: Worker, blame: str | None) -> None:
        """Take everything back from a worker; where there is blame, the chunk in work has it."""
        if worker.standing is Standing.RETIRED:
            return
        self._roster.stand(worker, Standing.RETIRED)
        for i, assignment in enumerate(worker.held):
            if not assignment.recall():
                continue
            if blame is not None and i == 0:
                self._accident(assignment, blame)
            else:
                self._allocation.take_back(assignment)
        while worker.bound:
            self._allocation.orphan(worker.bound.popleft())

    def _say_whether_waiting(self) -> None:
        waiting = self._roster.n_working == 0 and bool(self._ledger.open)
        if waiting is not self._waiting:
            self._waiting = waiting
            self._turn.out.append(Waiting() if waiting else Resumed())
