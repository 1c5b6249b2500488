"""A farm in virtual time: the root's own scheduler, workers that take the time they are said to take, and links.

The scheduler is that of a real run (``farm/scheduler.py``) with its rules; only the clock, the network and the
workers are not real. Nothing is ever lost here, so nothing is timed.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from tramnet_master.farm.events import (
    Answered,
    Event,
    Resolved,
    Send,
    Tram,
    WorkerReady,
    WorkSubmitted,
)
from tramnet_master.farm.rules import Rules
from tramnet_master.farm.scheduler import Scheduler
from tramnet_master.simulation.agenda import SECOND, Agenda
from tramnet_master.simulation.machines import Machine
from tramnet_master.simulation.network import Network, Traffic, Way
from tramnet_master.simulation.routes import RoundTrip
from tramnet_master.simulation.workload import Grain, Workload
from tramnet_protocol.messages import WorkId
from tramnet_protocol.modelled import HEADER_BYTES


@dataclass(slots=True)
class _Worker:
    tram: Tram
    ways: RoundTrip
    busy: bool = False
    waiting: deque[WorkId] = field(default_factory=deque)


@dataclass(frozen=True)
class Lap:
    """What had happened when a round was complete.

    Attributes:
        time: When that was [ns].
        computing: Time the workers had computed until then, added up [ns].
        traffic: What each directed link had carried.
    """

    time: int
    computing: int
    traffic: Mapping[Way, Traffic]


class VirtualFarm:
    """A run of some rounds.

    Args:
        workload: What is evaluated.
        machine: By what.
        ways: The ways to and from each worker.
        rules: The scheduler's rules, or None for those of a real run.
    """

    def __init__(
        self,
        workload: Workload,
        machine: Machine,
        ways: Mapping[int, RoundTrip],
        rules: Rules | None = None,
    ) -> None:
        self._workload = workload
        self._machine = machine
        self._evaluation = round(workload.evaluation * SECOND)
        self._breeding = round(workload.breeding * SECOND)
        self._agenda = Agenda()
        self._network = Network(self._agenda, machine.timing)
        self._scheduler = Scheduler(rules)
        self._workers = {seat: _Worker(Tram(seat, 1), way) for seat, way in ways.items()}
        self._root_free = 0  # when the root's processor has done what it was given [ns]
        self._computing = 0
        self._laps: list[Lap] = []
        self._open = 0  # works of this round
        self._rounds = 0

    def run(self, rounds: int) -> list[Lap]:
        """Run a number of rounds, generations for one; return a lap for each."""
        self._rounds = rounds
        for worker in self._workers.values():
            self._tell(WorkerReady(worker.tram))
        self._submit(1)
        self._agenda.run()
        return self._laps

    # The root.

    def _submit(self, step: int) -> None:
        divisible = self._workload.grain is Grain.INDIVIDUALS
        works = self._workload.works(step, len(self._workers))
        self._open = len(works)
        for work in works:
            each = self._workload.genome_bytes + self._workload.work_bytes // work.size
            self._tell(WorkSubmitted(work, each, divisible))

    def _tell(self, event: Event) -> None:
        for instruction in self._scheduler.handle(event, self._agenda.now / SECOND):
            match instruction:
                case Send(tram, work):
                    self._occupy_root(self._machine.sending)
                    self._agenda.after(self._root_free - self._agenda.now, self._send, (tram, work))
                case Resolved(work):
                    self._open -= 1
                    if not self._open:
                        self._complete(work.step)

    def _occupy_root(self, time: int) -> None:
        self._root_free = max(self._root_free, self._agenda.now) + time

    def _send(self, given: tuple[Tram, WorkId]) -> None:
        tram, work = given
        worker = self._workers[tram.seat]
        own = self._workload.work_bytes
        size = HEADER_BYTES + own + work.size * self._workload.genome_bytes
        self._network.send(worker.ways.out, size, lambda: self._receive(worker, work))

    def _complete(self, step: int) -> None:
        traffic = {way: traffic.copy() for way, traffic in self._network.traffic.items()}
        self._laps.append(Lap(self._agenda.now, self._computing, traffic))
        if step < self._rounds:
            self._occupy_root(self._breeding)
            self._agenda.after(self._root_free - self._agenda.now, self._submit, step + 1)

    # The workers.

    def _receive(self, worker: _Worker, work: WorkId) -> None:
        worker.waiting.append(work)
        if not worker.busy:
            self._begin(worker)

    def _begin(self, worker: _Worker) -> None:
        work = worker.waiting.popleft()
        worker.busy = True
        time = work.size * self._evaluation
        self._computing += time
        self._agenda.after(time, self._finish, (worker, work))

    def _finish(self, given: tuple[_Worker, WorkId]) -> None:
        worker, work = given
        worker.busy = False
        if worker.waiting:
            self._begin(worker)
        size = HEADER_BYTES + work.size * self._workload.objective_bytes
        self._network.send(worker.ways.back, size, lambda: self._take(worker, work))

    def _take(self, worker: _Worker, work: WorkId) -> None:
        seconds = work.size * self._evaluation / SECOND
        self._occupy_root(self._machine.receiving)
        answered = Answered(worker.tram, work, seconds)
        self._agenda.after(self._root_free - self._agenda.now, self._tell, answered)
