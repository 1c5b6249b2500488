"""Giving work: what waits, where it waits, and which worker gets it next.

Pieces wait in three places: in their batch, which stands in the queue ``ready``; among the suspects; or, where
the batch is bound to the TRAM that holds its state, with that worker. Chunks are cut only when a worker has
room, so that each is cut by what is known by then.
"""

from collections import deque
from collections.abc import Mapping

from tramnet_master.farm.batch import Assignment, Batch, Piece
from tramnet_master.farm.chunking import Costs, chunk_size
from tramnet_master.farm.events import (
    Answered,
    Cause,
    Instruction,
    Orphaned,
    Raised,
    Repeat,
    Replace,
    Send,
    Tram,
)
from tramnet_master.farm.ledger import Ledger
from tramnet_master.farm.roster import Roster, Standing, Worker
from tramnet_master.farm.rules import Rules
from tramnet_master.farm.suspects import Suspects, worker_to_replace
from tramnet_protocol.routes import KEPT

# Timer of no worker: wakes the scheduler to look at its suspects again.
_NOBODY = Tram(-1, -1)


class Turn:
    """The event in hand.

    Attributes:
        now: Its time [s].
        out: Instructions that follow from it, so far.
    """

    def __init__(self) -> None:
        self.now = 0.0
        self.out: list[Instruction] = []


class Allocation:
    """The part of the scheduler that gives work.

    Attributes:
        roster: The workers.
        costs: What their work was measured to cost.
        ready: Batches that may be cut for any worker; each at most once.
        suspects: Pieces that wait for a fresh process.
        routes: TRAMs that frames pass on their way to a worker or back, nearest the root first; empty where there
            are none.
        epoch: Number of wirings so far.
    """

    def __init__(self, rules: Rules, ledger: Ledger, turn: Turn) -> None:
        self.roster = Roster(rules)
        self.costs = Costs()
        self.ready: deque[Batch] = deque()
        self.suspects = Suspects()
        self.routes: Mapping[Tram, tuple[Tram, ...]] = {}
        self.epoch = 0
        self._rules = rules
        self._ledger = ledger
        self._turn = turn

    def release(self, batch: Batch) -> None:
        """Put what waits of a batch where it will be found."""
        for piece in batch.take_suspects():
            self.suspects.add(batch, piece)
        if batch.exhausted:
            return
        if batch.affinity is None:
            self._enqueue(batch)
            return
        holder = self.roster.find(batch.affinity)
        if holder is None or holder.standing is not Standing.WORKING:
            self.orphan(batch)
            return
        holder.bound.append(batch)
        self._feed(holder)

    def take_back(self, assignment: Assignment) -> None:
        """Let what is still open of a chunk wait again, without blame."""
        for piece in assignment.batch.take_back(assignment.piece):
            self.put_back(assignment.batch, piece)

    def put_back(self, batch: Batch, piece: Piece) -> None:
        """Let a piece that came back wait to be given again."""
        if batch.affinity is not None:
            batch.returned.append(piece)
            self.orphan(batch)
        elif piece.suspect:
            self.suspects.add(batch, piece)
        else:
            batch.returned.append(piece)
            self._enqueue(batch, ahead=True)

    def orphan(self, batch: Batch) -> None:
        """Let a batch whose state is lost wait for the engine; once, until it is submitted again."""
        if batch.open and batch.affinity is not None and not batch.parked:
            batch.parked = True
            self._turn.out.append(Orphaned(batch.work, batch.affinity))

    def dispatch(self) -> None:
        """Give what waits to workers with room, until one of the two runs out."""
        if self.suspects:
            self._isolate()
        while self.ready and (worker := self.roster.next_worker()) is not None:
            batch = self.ready[0]
            if worker.held and not self._fits_behind(batch):
                break
            self._give(worker, batch)
            if batch.exhausted:
                self.ready.popleft().queued = False
            elif len(self.ready) > 1:
                self.ready.rotate(-1)

    def _isolate(self) -> None:
        """Give suspects to fresh processes, and ask for more of these where they are short."""
        roster, suspects = self.roster, self.suspects
        while roster.fresh and (first := suspects.first()) is not None:
            suspects.waiting.popleft()
            self._send(next(iter(roster.fresh.values())), *first)
        while suspects.first() and suspects.lacks_process(roster.n_working, self._turn.now):
            worker = worker_to_replace(roster)
            if worker is None:
                return
            given_up = self._turn.now + self._rules.first_deadline
            suspects.expected.append(given_up)
            roster.wake(given_up, _NOBODY)
            roster.stand(worker, Standing.DRAINING)
            self._replace_if_drained(worker)

    def _replace_if_drained(self, worker: Worker) -> None:
        if worker.standing is Standing.DRAINING and not worker.held:
            self.roster.stand(worker, Standing.RETIRED)
            self._turn.out.append(Replace(worker.tram, Cause.FRESH_PROCESS))

    def refill(self, worker: Worker | None) -> None:
        """Do what follows when a worker holds less than before."""
        if worker is not None:
            self._replace_if_drained(worker)
            self._feed(worker)

    def _feed(self, worker: Worker) -> None:
        """Give a worker what is bound to it, as long as it has room."""
        while worker.bound and worker.standing is Standing.WORKING:
            batch = worker.bound[0]
            room = self.roster.can_queue(worker) and self._fits_behind(batch)
            if worker.held and not room:
                return
            if batch.parked or batch.affinity != worker.tram or not self._give(worker, batch):
                worker.bound.popleft()
            else:
                worker.bound.rotate(-1)

    def _enqueue(self, batch: Batch, ahead: bool = False) -> None:
        if not batch.queued:
            batch.queued = True
            self.ready.insert(0 if ahead else len(self.ready), batch)

    def _give(self, worker: Worker, batch: Batch) -> bool:
        """Send a worker the next piece of a batch; False where the batch has none."""
        work = batch.work
        sharing = max(1, self.roster.n_working) if batch.affinity is None else 1
        each = self.costs.each(work.kind)
        left = work.last - batch.uncut
        size = chunk_size(work.size, left, sharing, each, batch.bytes_each, self._rules)
        piece = batch.cut(size)
        if piece is None:
            return False
        self._send(worker, batch, piece)
        return True

    def _send(self, worker: Worker, batch: Batch, piece: Piece) -> None:
        work = batch.part(piece.first, piece.last)
        via = frozenset(self.routes.get(worker.tram, ()))
        assignment = Assignment(
            batch, piece, work, worker.tram, self._turn.now, via=via, epoch=self.epoch
        )
        batch.give(piece)
        self._ledger.record(assignment)
        worker.load(assignment)
        if len(worker.held) == 1:
            self._start_clock(worker)
        self.roster.place(worker)
        self._turn.out.append(Send(worker.tram, work))

    def rewire(self, routes: Mapping[Tram, tuple[Tram, ...]]) -> None:
        """Note other routes; what is under way may pass the old ones or the new ones."""
        self.routes = routes
        self.epoch += 1
        self.roster.rewire(routes)
        for worker in self.roster.workers.values():
            for assignment in worker.held:
                assignment.via = assignment.via.union(routes.get(worker.tram, ()))

    def repeat_what_passed(self, lost: frozenset[Tram]) -> None:
        """Send again what lost TRAMs may have taken along, to the workers that have it or should."""
        for worker in self.roster.workers.values():
            for assignment in worker.held:
                if assignment.live and self._may_have_passed(lost, assignment):
                    self._repeat(worker, assignment)

    def _may_have_passed(self, lost: frozenset[Tram], assignment: Assignment) -> bool:
        """Whether a frame may have met one of them: on its ways, or on any where nodes may have forgotten those."""
        forgotten = self.epoch - assignment.epoch >= KEPT
        return not lost.isdisjoint(assignment.via) or (forgotten and bool(assignment.via))

    def _repeat(self, worker: Worker, assignment: Assignment) -> None:
        # From now on it passes the new route only: whoever takes it in knows the new wiring.
        assignment.via = frozenset(self.routes.get(worker.tram, ()))
        assignment.epoch = self.epoch
        self._turn.out.append(Repeat(worker.tram, assignment.work))
        if assignment is worker.held[0]:
            self.restart_clock(worker)

    def restart_clock(self, worker: Worker) -> None:
        """Give the chunk in work its time anew; by now its cost may be known."""
        self._start_clock(worker)
        self.roster.place(worker)

    def unload(self, event: Answered | Raised) -> Worker | None:
        """Free the credit of a chunk its worker has answered, whatever the answer is worth."""
        worker = self.roster.find(event.tram)
        if worker is not None and worker.held:
            in_work = worker.held[0]
            worker.unload(event.work)
            if worker.held and worker.held[0] is not in_work:
                self._start_clock(worker)
            self.roster.place(worker)
        return worker

    def _start_clock(self, worker: Worker) -> None:
        """Set the deadline of the chunk that a worker has just begun."""
        assignment = worker.held[0]
        piece = assignment.piece
        each = self.costs.each(assignment.work.kind)
        if each is None:
            allowed = self._rules.first_deadline * piece.size
        else:
            allowed = max(self._rules.least_deadline, self._rules.slack * each * assignment.cost)
        worker.deadline = self._turn.now + allowed * 2.0**piece.resends
        brief = each is not None and each * assignment.cost <= self._rules.queue_behind
        worker.cheap = brief and not piece.suspect
        self.roster.watch(worker)

    def _fits_behind(self, batch: Batch) -> bool:
        """Whether a chunk of this batch may wait behind another."""
        return 2 * batch.least_bytes <= self._rules.credit_bytes
