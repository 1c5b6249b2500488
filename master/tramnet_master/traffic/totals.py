"""What the link books add up to: a few numbers for people, and a row for each directed link."""

from collections.abc import Mapping
from typing import Self

import msgspec
import numpy as np
from msgspec import Struct

from tramnet_master.csv_tables import Column
from tramnet_master.results import Booked
from tramnet_master.simulation.agenda import SECOND
from tramnet_master.simulation.network import Traffic, Way
from tramnet_master.traffic.booking import Round


class _State(Struct, frozen=True):
    rounds: int
    booked: int
    time: int
    computing: int
    links: list[tuple[int, int, int, int, int, int]]


class Totals:
    """Sums over rounds.

    Attributes:
        rounds: Rounds of the run.
        booked: Of these, how many were booked.
        time: Their virtual time, added up [ns].
        computing: Compute time of all workers in it [ns].
        traffic: What each directed link has carried in it.
    """

    def __init__(self) -> None:
        self.rounds = self.booked = 0
        self.time = self.computing = 0
        self.traffic: dict[Way, Traffic] = {}

    def add(self, found: Round, times: int) -> None:
        """Add a round that was booked, so many times."""
        self.booked += times
        self.time += times * found.time
        self.computing += times * found.computing
        for way, traffic in found.traffic.items():
            self.traffic.setdefault(way, Traffic()).add(traffic, times)

    def summary(self, node: str, mbaud: int, seconds_each: Mapping[str, float]) -> Booked:
        """Return the few numbers."""
        busiest = min(self.traffic, key=lambda way: (-self.traffic[way].busy, way), default=None)
        return Booked(
            node=node,
            mbaud=mbaud,
            rounds=self.rounds,
            booked=self.booked,
            seconds_each=dict(seconds_each),
            seconds=self.time / SECOND,
            computing_seconds=self.computing / SECOND,
            frames=sum(traffic.frames for traffic in self.traffic.values()),
            bytes=sum(traffic.bytes for traffic in self.traffic.values()),
            busiest=busiest,
            utilisation=self.traffic[busiest].busy / self.time if busiest is not None else 0.0,
        )

    def columns(self) -> dict[str, Column]:
        """Return a row for each directed link, in the order of seats, as columns of a table."""
        rows = sorted(self.traffic.items())
        traffic = [traffic for _, traffic in rows]
        busy = np.array([one.busy for one in traffic], dtype=np.float64) / SECOND
        return {
            "source": np.array([way[0] for way, _ in rows], dtype=np.int64),
            "destination": np.array([way[1] for way, _ in rows], dtype=np.int64),
            "frames": np.array([one.frames for one in traffic], dtype=np.int64),
            "bytes": np.array([one.bytes for one in traffic], dtype=np.int64),
            "busy_s": busy,
            "waited_s": np.array([one.waited for one in traffic], dtype=np.float64) / SECOND,
            "utilisation": busy / max(self.time / SECOND, 1e-9),
        }

    def state(self) -> dict[str, object]:
        """Return the sums in plain values."""
        links = [
            (*way, one.frames, one.bytes, one.busy, one.waited) for way, one in self.traffic.items()
        ]
        state = _State(self.rounds, self.booked, self.time, self.computing, links)
        return dict(msgspec.to_builtins(state))

    @classmethod
    def restored(cls, state: Mapping[str, object]) -> Self:
        """Return the sums of which ``state`` returned the plain values."""
        read = msgspec.convert(dict(state), _State)
        totals = cls()
        totals.rounds, totals.booked = read.rounds, read.booked
        totals.time, totals.computing = read.time, read.computing
        totals.traffic = {(row[0], row[1]): Traffic(*row[2:]) for row in read.links}
        return totals
