"""The workers, what each holds, and who is next to be given work.

A worker is WORKING, DRAINING (it finishes what it holds and is then replaced) or RETIRED (overdue, leaving or
drained: nothing it still holds counts, and nothing more is given). Workers with room stand in line, those that
hold nothing before those that can queue a second chunk, and of them the nearest the root first: every TRAM that a
frame passes costs time. Finding the next one takes O(log N).
"""

import enum
import heapq
from collections import OrderedDict, deque
from collections.abc import Mapping

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
        way: Number of TRAMs that frames pass on their way here.
        place: Place in the line of the idle, or -1.
    """

    __slots__ = (
        "bound",
        "bytes",
        "cheap",
        "deadline",
        "fresh",
        "held",
        "place",
        "standing",
        "timer",
        "tram",
        "warm",
        "way",
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
        self.way = 0
        self.place = -1

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
        self._ways: Mapping[Tram, tuple[Tram, ...]] = {}
        self._near: list[
            tuple[int, int, int]
        ] = []  # heap of way, place and seat; may hold old ones
        self._places = 0
        self._timers: list[tuple[float, Tram]] = []  # heap; may hold entries out of use

    def find(self, tram: Tram) -> Worker | None:
        """The worker of this seat and incarnation, if it is here."""
        worker = self.workers.get(tram.seat)
        return worker if worker is not None and worker.tram == tram else None

    def add(self, tram: Tram, fresh: bool) -> Worker:
        """Take in a new worker, fresh or with a past."""
        worker = self.workers[tram.seat] = Worker(tram)
        worker.fresh = fresh
        worker.way = len(self._ways.get(tram, ()))
        self.n_working += 1
        self.place(worker)
        return worker

    def rewire(self, ways: Mapping[Tram, tuple[Tram, ...]]) -> None:
        """Note the TRAMs that frames pass on their way to each worker."""
        self._ways = ways
        for worker in self.workers.values():
            worker.way = len(ways.get(worker.tram, ()))
        self._sort()

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
        working = worker.standing is Standing.WORKING
        idle = working and not worker.held
        _stand_in(self.empty, worker, idle)
        _stand_in(self.fresh, worker, idle and worker.fresh)
        _stand_in(self.partly, worker, working and self.can_queue(worker))
        if not idle:
            worker.place = -1
        elif worker.place < 0:
            self._queue(worker)

    def can_queue(self, worker: Worker) -> bool:
        """Whether a worker that holds something can be sent another chunk behind it."""
        return (
            worker.cheap
            and 0 < len(worker.held) < self._rules.credit_chunks
            and 2 * worker.bytes <= self._rules.credit_bytes
        )

    def next_worker(self) -> Worker | None:
        """The worker to be given work next."""
        while self._near:
            _, place, seat = self._near[0]
            worker = self.empty.get(seat)
            if worker is not None and worker.place == place:
                return worker
            heapq.heappop(self._near)
        return next(iter(self.partly.values()), None)

    def _queue(self, worker: Worker) -> None:
        if len(self._near) > 2 * len(self.workers):
            self._sort()  # those who are given bound work leave their places behind
        self._places += 1
        worker.place = self._places
        heapq.heappush(self._near, (worker.way, worker.place, worker.tram.seat))

    def _sort(self) -> None:
        idle = (worker for worker in self.empty.values() if worker.place >= 0)
        self._near = sorted((worker.way, worker.place, worker.tram.seat) for worker in idle)

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


def _stand_in(line: OrderedDict[int, Worker], worker: Worker, belongs: bool) -> None:
    """Have a worker stand in a line, or not."""
    seat = worker.tram.seat
    if not belongs:
        line.pop(seat, None)
    elif seat not in line:
        line[seat] = worker
