"""The workers, what each holds, and who is next to be given work.

A worker is WORKING, DRAINING (it finishes what it holds and is then replaced) or RETIRED (overdue, leaving or
drained: nothing it still holds counts, and nothing more is given). Workers with room stand in line, those that
hold nothing before those that can queue a second chunk, so that finding the next one costs the same for one
worker and for 4,095.
"""

import enum
import heapq
from collections import OrderedDict, deque

from tramnet_master.farm.batch import Assignment, Batch
from tramnet_master.farm.events import Tram
from tramnet_master.farm.rules import Rules
from tramnet_protocol.messages import WorkId


class Standing(enum.Enum):
    """What may be expected of a worker."""

    WORKING = enum.auto()
    DRAINING = enum.auto()
    RETIRED = enum.auto()


class Worker:
    """What the scheduler knows of one worker.

    Attributes:
        tram: Its seat and incarnation.
        standing: What may be expected of it.
        fresh: Whether its process never had work.
        warm: Whether it has answered.
        held: Chunks sent and not answered, in the order sent: the first is in work, the second waits.
        bytes: Size of the chunks held [byte].
        deadline: When the chunk in work is overdue [s]; it means nothing while nothing is held.
        timer: When the deadline is looked at next [s], or None; never later than the deadline.
        cheap: Whether the chunk in work is short enough to queue another behind it.
        bound: Works that must come here, because their state is here.
    """

    __slots__ = (
        "bound",
        "bytes",
        "cheap",
        "deadline",
        "fresh",
        "held",
        "standing",
        "timer",
        "tram",
        "warm",
    )

    def __init__(self, tram: Tram) -> None:
        self.tram = tram
        self.standing = Standing.WORKING
        self.fresh = True
        self.warm = False
        self.held: list[Assignment] = []
        self.bytes = 0
        self.deadline = 0.0
        self.timer: float | None = None
        self.cheap = False
        self.bound: deque[Batch] = deque()

    def load(self, assignment: Assignment) -> None:
        """Let it hold another chunk."""
        self.held.append(assignment)
        self.bytes += assignment.bytes
        self.fresh = False

    def unload(self, work: WorkId) -> None:
        """Let it hold a chunk no more, if it did."""
        for i, assignment in enumerate(self.held):
            if assignment.work == work:
                del self.held[i]
                self.bytes -= assignment.bytes
                return


class Roster:
    """All workers by seat, those with room in line, and their deadlines.

    Attributes:
        workers: Present worker of each seat.
        empty: WORKING ones that hold nothing, longest idle first.
        fresh: Those of ``empty`` whose process never had work.
        partly: WORKING ones that can queue a second chunk.
        n_working: Number of WORKING workers.
    """

    def __init__(self, rules: Rules) -> None:
        self._rules = rules
        self.workers: dict[int, Worker] = {}
        self.empty: OrderedDict[int, Worker] = OrderedDict()
        self.fresh: OrderedDict[int, Worker] = OrderedDict()
        self.partly: OrderedDict[int, Worker] = OrderedDict()
        self.n_working = 0
        self._timers: list[tuple[float, Tram]] = []  # heap; may hold entries out of use

    def find(self, tram: Tram) -> Worker | None:
        """The worker of this seat and incarnation, if it is here."""
        worker = self.workers.get(tram.seat)
        return worker if worker is not None and worker.tram == tram else None

    def add(self, tram: Tram, fresh: bool) -> Worker:
        """Take in a new worker, fresh or with a past."""
        worker = self.workers[tram.seat] = Worker(tram)
        worker.fresh = fresh
        self.n_working += 1
        self.place(worker)
        return worker

    def remove(self, worker: Worker) -> None:
        """Forget a worker."""
        self.stand(worker, Standing.RETIRED)
        del self.workers[worker.tram.seat]

    def stand(self, worker: Worker, standing: Standing) -> None:
        """Change what may be expected of a worker."""
        if worker.standing is Standing.WORKING and standing is not Standing.WORKING:
            self.n_working -= 1
        worker.standing = standing
        self.place(worker)

    def place(self, worker: Worker) -> None:
        """Put a worker into the lines it belongs to; to be called whenever what it holds has changed."""
        seat = worker.tram.seat
        working = worker.standing is Standing.WORKING
        for line, belongs in (
            (self.empty, working and not worker.held),
            (self.fresh, working and worker.fresh),
            (self.partly, working and self.can_queue(worker)),
        ):
            if not belongs:
                line.pop(seat, None)
            elif seat not in line:
                line[seat] = worker

    def can_queue(self, worker: Worker) -> bool:
        """Whether a worker that holds something can be sent another chunk behind it."""
        return (
            worker.cheap
            and 0 < len(worker.held) < self._rules.credit_chunks
            and 2 * worker.bytes <= self._rules.credit_bytes
        )

    def next_worker(self) -> Worker | None:
        """The worker to be given work next."""
        for line in (self.empty, self.partly):
            if line:
                return next(iter(line.values()))
        return None

    def watch(self, worker: Worker) -> None:
        """See to it that the worker is looked at when its deadline has come."""
        if worker.timer is None or worker.deadline < worker.timer:
            worker.timer = worker.deadline
            self.wake(worker.deadline, worker.tram)

    def wake(self, time: float, tram: Tram) -> None:
        """Ask to be ticked at a time [s]."""
        heapq.heappush(self._timers, (time, tram))

    def next_time(self) -> float | None:
        """When to tick next [s], or None."""
        return self._timers[0][0] if self._timers else None

    def overdue(self, now: float) -> list[Worker]:
        """Workers whose chunk in work is overdue.

        A deadline that has moved on since its timer was set gets a new timer here, and only here: a farm that
        answers in time costs one timer per worker and three seconds, however many chunks that was.
        """
        late = []
        while self._timers and self._timers[0][0] <= now:
            time, tram = heapq.heappop(self._timers)
            worker = self.find(tram)
            if worker is None or worker.timer != time:
                continue
            worker.timer = None
            if not worker.held or worker.standing is Standing.RETIRED:
                continue
            if worker.deadline <= now:
                late.append(worker)
            else:
                self.watch(worker)
        return late
