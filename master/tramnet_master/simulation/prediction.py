"""How long a run would take with so many workers, and how many are best."""

import math
from collections.abc import Mapping, Sequence

from msgspec import Struct

from tramnet_master.errors import InvalidOption
from tramnet_master.simulation.agenda import SECOND
from tramnet_master.simulation.farm import Lap, VirtualFarm
from tramnet_master.simulation.machines import Machine
from tramnet_master.simulation.network import Traffic, Way
from tramnet_master.simulation.routes import RoundTrip, round_trips
from tramnet_master.simulation.workload import Workload
from tramnet_protocol.limits import MAX_SEATS
from tramnet_protocol.modelled import HEADER_BYTES
from tramnet_protocol.topology import Graph, Shape

MOST_WORKERS = 4096
"""More are not simulated; a real network has seats for one less than that."""

ROUNDS = 4
"""Rounds that are simulated; those after the second, in which costs are known, stand for the rest."""

_SETTLED = 2


class Point(Struct, frozen=True):
    """A run with some number of workers.

    Attributes:
        workers: How many.
        seconds: What it would take [s].
        speed_up: Time of one processor that does all of it alone, over that.
        efficiency: Speed-up over the workers; the root, which only decides, is not counted.
        computing: Share of the time for which a worker computes, on average.
        mean_hops: Links between the root and a worker, on average.
        busiest: The directed link that is busy longest.
        utilisation: Share of the time for which it is.
    """

    workers: int
    seconds: float
    speed_up: float
    efficiency: float
    computing: float
    mean_hops: float
    busiest: Way
    utilisation: float


class Prediction(Struct, frozen=True):
    """Runs with several numbers of workers.

    Attributes:
        workload: What runs.
        machine: On what.
        topology: Name of the shape.
        points: One for each number of workers, ascending.
        message_seconds: Time of a chromosome's way out and its objective's back over the mean hops of the
            best run, the Tc of the master-slave optimum [s].
        optimum: The master-slave optimum, the root included; it knows neither topology nor overlap.
    """

    workload: Workload
    machine: str
    topology: str
    points: list[Point]
    message_seconds: float
    optimum: float

    @property
    def best(self) -> Point:
        """The fastest run; of equals that with the fewest workers."""
        return min(self.points, key=lambda point: (point.seconds, point.workers))


def predict(
    workload: Workload, machine: Machine, shape: Shape, counts: Sequence[int]
) -> Prediction:
    """Predict runs with several numbers of workers.

    Args:
        workload: What runs.
        machine: On what.
        shape: Shape of the network.
        counts: Numbers of workers.

    Raises:
        BadTopology: The shape cannot join as many.
        InvalidOption: They are too many, or none.
    """
    points = [_point(workload, machine, shape, count) for count in sorted(set(counts))]
    if not points:
        raise InvalidOption("--workers", "none", "numbers of workers such as 1,4,16")
    best = min(points, key=lambda point: (point.seconds, point.workers))
    message = best.mean_hops * (
        machine.timing.hop(HEADER_BYTES + workload.work_bytes + workload.genome_bytes)
        + machine.timing.hop(HEADER_BYTES + workload.objective_bytes)
    )
    seconds = (message + machine.sending + machine.receiving) / SECOND
    optimum = master_slave_optimum(workload.population, workload.evaluation, seconds)
    return Prediction(workload, machine.name, shape.name, points, seconds, optimum)


def master_slave_optimum(individuals: int, evaluation: float, message: float) -> float:
    """Return the number of processors P that makes T = P Tc + n Tf / P least: the square root of n Tf / Tc.

    Cantú-Paz, "Designing efficient master-slave parallel genetic algorithms" (1998).

    Args:
        individuals: n.
        evaluation: Tf, the time of an evaluation [s].
        message: Tc, the time of the messages to and from a slave [s].
    """
    return math.sqrt(individuals * evaluation / message)


def usual_counts(population: int, most: int) -> list[int]:
    """Return numbers of workers that show how a run scales: 1, 2, 3, 4, 6, 8, 12 ... up to one an individual."""
    limit = min(population, most)
    counts = {limit}
    power = 1
    while power <= limit:
        counts.update(count for count in (power, power + power // 2) if count <= limit)
        power *= 2
    return sorted(counts)


def lay(shape: Shape, workers: int) -> dict[int, RoundTrip]:
    """Return the ways between the root and so many workers.

    Raises:
        BadTopology: The shape cannot join as many.
        InvalidOption: They are too many, or none.
    """
    if not 1 <= workers <= MOST_WORKERS:
        raise InvalidOption("--workers", str(workers), f"1 to {MOST_WORKERS} workers")
    if shape.max_trams < MAX_SEATS:
        shape.check_room(1 + workers)
    seats = range(1 + workers)
    graph = Graph.of(seats, shape.join(seats))
    if not shape.virtual:
        graph.check_links()
    return round_trips(graph)


def _point(workload: Workload, machine: Machine, shape: Shape, workers: int) -> Point:
    ways = lay(shape, workers)
    simulated = min(ROUNDS, workload.rounds)
    laps = VirtualFarm(workload, machine, ways).run(simulated)
    seconds = _seconds(laps, workload)
    settled = laps[_SETTLED - 1] if simulated > _SETTLED else Lap(0, 0, {})
    span = laps[-1].time - settled.time
    busy = _busy(settled.traffic, laps[-1].traffic)
    busiest = min(busy, key=lambda way: (-busy[way], way))
    speed_up = workload.serial_seconds / seconds
    return Point(
        workers=workers,
        seconds=seconds,
        speed_up=speed_up,
        efficiency=speed_up / workers,
        computing=(laps[-1].computing - settled.computing) / (workers * span),
        mean_hops=sum(len(way.out) - 1 for way in ways.values()) / workers,
        busiest=busiest,
        utilisation=busy[busiest] / span,
    )


def _seconds(laps: Sequence[Lap], workload: Workload) -> float:
    """Time of all rounds: those that were simulated, and the last ones over again for the rest."""
    rest = workload.rounds - len(laps)
    if not rest:
        return laps[-1].time / SECOND
    each = (laps[-1].time - laps[_SETTLED - 1].time) / (len(laps) - _SETTLED)
    return (laps[-1].time + rest * each) / SECOND


def _busy(before: Mapping[Way, Traffic], after: Mapping[Way, Traffic]) -> dict[Way, int]:
    return {
        way: traffic.busy - (before[way].busy if way in before else 0)
        for way, traffic in after.items()
    }
