"""Time the scheduler takes per event: one chunk per generation, and farms of 4 to 4,095 workers.

Run: ``python -m benchmarks.scheduler``. The bar is a ratio: an event may cost four times as much with 4,095
workers as with 4. Microseconds, of processor time, are printed for information.
"""

import time

from tramnet_master.farm.events import Answered, Send, Tram, WorkerReady, WorkSubmitted
from tramnet_master.farm.scheduler import Scheduler
from tramnet_protocol.messages import Kind, WorkId

SIZES = (4, 256, 4095)
COST = 0.001
CHEAP = 0.00001
CHUNKS_EACH = 20
REPEATS = 5  # the best one counts: the others met the machine's other work


def farm(n_workers: int, cost: float) -> tuple[Scheduler, float]:
    """A farm that knows what its work costs, and the time on its clock [s]."""
    scheduler = Scheduler()
    for seat in range(1, n_workers + 1):
        scheduler.handle(WorkerReady(Tram(seat, seat)), 0.0)
    now = 0.0
    for step in range(2):
        now, _ = run(scheduler, WorkId(Kind.EVALUATE, 0, step, 0, n_workers), cost, now)
    return scheduler, now


def run(
    scheduler: Scheduler, work: WorkId, cost: float, now: float
) -> tuple[float, tuple[int, float]]:
    """Work through one submitted work; the clock's time, then events and processor time [s]."""
    seconds = 0.0
    events: list[WorkSubmitted | Answered] = [WorkSubmitted(work, bytes_each=100)]
    for event in events:
        start = time.process_time()
        instructions = scheduler.handle(event, now)
        seconds += time.process_time() - start
        now += cost
        for sent in instructions:
            if isinstance(sent, Send):
                events.append(Answered(sent.tram, sent.work, cost * sent.work.size))
    return now, (len(events), seconds)


def microseconds_per_event(n_workers: int) -> float:
    """Mean over a generation that keeps every worker busy with several chunks [us]."""
    scheduler, now = farm(n_workers, COST)
    size = 15 * CHUNKS_EACH * n_workers
    _, (events, seconds) = run(scheduler, WorkId(Kind.EVALUATE, 0, 9, 0, size), COST, now)
    return 1e6 * seconds / events


def microseconds_per_generation(generations: int = 5_000) -> float:
    """One worker, one chunk of 100: submitting and answering [us]."""
    scheduler, now = farm(1, CHEAP)
    total = 0.0
    for step in range(10, 10 + generations):
        work = WorkId(Kind.EVALUATE, 0, step, 0, 100)
        now, (events, seconds) = run(scheduler, work, CHEAP, now)
        assert events == 2
        total += seconds
    return 1e6 * total / generations


def main() -> None:
    generation = min(microseconds_per_generation() for _ in range(REPEATS))
    print(f"one worker, one chunk: {generation:6.1f} us per generation (2 events)")
    times = {n: min(microseconds_per_event(n) for _ in range(REPEATS)) for n in SIZES}
    for n, each in times.items():
        print(f"{n:5d} workers:         {each:6.1f} us per event")
    ratio = times[SIZES[-1]] / times[SIZES[0]]
    print(f"ratio {SIZES[-1]} : {SIZES[0]} workers = {ratio:.2f} (bar: 4)")


if __name__ == "__main__":
    main()
