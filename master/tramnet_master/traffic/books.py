"""The link books of a run: what its network would have been like if it had been made of transputers.

``LinkBooks`` listens to the farm, and books and drops each round when it is over, so its memory does not grow with
the run. Rounds that are alike are booked once. So that no run waits for its books, they take at most a fiftieth of
its time; rounds beyond that are counted and left out. They say nothing of real time, and no result depends on them.
"""

import time
from collections import Counter
from collections.abc import Callable, Mapping

import msgspec

from tramnet_master.farm.events import Tram
from tramnet_master.results import Booked
from tramnet_master.simulation.agenda import SECOND
from tramnet_master.simulation.machines import Machine, factor
from tramnet_master.simulation.routes import RoundTrip, round_trips
from tramnet_master.traffic.booking import Round, book
from tramnet_master.traffic.totals import Totals
from tramnet_master.traffic.trace import Shipment, Stated, Trace
from tramnet_protocol.messages import Kind, Outcome, PopulationSnapshot, Wiring, Work
from tramnet_protocol.topology import graph_of

SHARE = 0.02
"""Most of a run's time that its books may take."""

ALLOWANCE = 0.1
"""What they may take in any case [s]."""

MOST_SHIPMENTS = 50_000
"""A round with more is cut here."""

_REMEMBERED = 256  # short rounds, for the next ones may be like them
_SHORT = 64  # shipments of such a round
_EACH = 30e-6  # what booking a shipment takes, before any was booked [s]
_EARLY = 16  # rounds from which costs are taken; a short run keeps its books when it is over


class LinkBooks:
    """Keeps the books of a run.

    Args:
        machine: What would have computed.
        clock: Tells how long the books themselves take [s].
    """

    def __init__(self, machine: Machine, clock: Callable[[], float] = time.perf_counter) -> None:
        self._machine = machine
        self._clock = clock
        self._wiring: Wiring | None = None
        self._ways: Mapping[int, RoundTrip] | None = None
        self._trace = Trace()
        self._over: list[Trace] = []  # rounds that are over and not looked at yet
        self._costs: dict[Kind, int] = {}  # of a slot [ns]
        self._stated: dict[Kind, Stated] = {}  # where the cost is not fixed yet
        self._early: list[tuple[Shipment, ...]] = []  # rounds that wait for their costs
        self._known: dict[tuple[Shipment, ...], Round] = {}
        self._times: Counter[tuple[Shipment, ...]] = Counter()  # of the known, not in the totals
        self._totals = Totals()
        self._began = clock()
        self._spent = 0.0
        self._each = _EACH

    @property
    def totals(self) -> Totals:
        """All that was booked."""
        self._look_at_rounds()
        self._catch_up()
        self._settle()
        return self._totals

    def summary(self, mbaud: int) -> Booked:
        """Return the books in a few numbers.

        Args:
            mbaud: Speed of the links they were kept for [Mbaud].
        """
        totals = self.totals
        costs = {kind.name.lower(): cost / SECOND for kind, cost in self._costs.items()}
        return totals.summary(self._machine.name, mbaud, costs)

    def rewired(self, wiring: Wiring) -> None:
        """Send by another wiring from now on."""
        self._wiring, self._ways = wiring, None

    def sent(self, tram: Tram, work: Work) -> None:
        """Note a chunk that was sent."""
        self._look_at_rounds()
        if self._ways is None:
            assert self._wiring is not None, "nobody is sent work who is not wired in"
            self._ways = round_trips(graph_of(self._wiring))
        self._trace.sent(tram, work, self._ways[tram.seat])

    def answered(self, tram: Tram, outcome: Outcome, snapshot: PopulationSnapshot | None) -> None:
        """Note an answer."""
        self._trace.answered(tram, outcome, snapshot)
        if len(self._trace) > MOST_SHIPMENTS:
            self.idle()

    def idle(self) -> None:
        """End a round; it is looked at when the next one has begun, so that no worker waits for that."""
        if len(self._trace):
            self._over.append(self._trace)
            self._trace = Trace()

    def state(self) -> dict[str, object]:
        """Return the books so far in plain values, to go on with them."""
        totals = self.totals
        costs = {kind.name: cost for kind, cost in self._costs.items()}
        return {"costs": costs, **totals.state()}

    def restore(self, state: Mapping[str, object]) -> None:
        """Go on with books that ``state`` returned."""
        costs = msgspec.convert(state["costs"], dict[str, int])
        self._costs = {Kind[name]: cost for name, cost in costs.items()}
        self._totals = Totals.restored(state)

    def _look_at_rounds(self) -> None:
        for trace in self._over:
            self._totals.rounds += 1
            self._learn(trace)
            self._early.append(trace.round())
            if self._totals.rounds >= _EARLY:
                self._catch_up()
        self._over.clear()

    def _learn(self, trace: Trace) -> None:
        """Take what a slot of a kind of work costs from the largest chunk of the first rounds with any."""
        for kind, stated in trace.stated.items():
            if kind not in self._costs:
                self._stated[kind] = stated.or_better(self._stated.get(kind))

    def _catch_up(self) -> None:
        """Book what was not, at the costs known by now, in two digits and for good."""
        for kind, stated in self._stated.items():
            there = SECOND * factor(self._machine.name) * stated.seconds / stated.slots
            self._costs[kind] = max(1, round(float(f"{there:.1e}")))
        self._stated.clear()
        early, self._early = self._early, []
        for shipments in early:
            if shipments in self._known:
                self._times[shipments] += 1
            elif self._has_time_for(shipments):
                self._book(shipments)

    def _has_time_for(self, shipments: tuple[Shipment, ...]) -> bool:
        allowed = ALLOWANCE + SHARE * (self._clock() - self._began)
        return self._spent + len(shipments) * self._each <= allowed

    def _book(self, shipments: tuple[Shipment, ...]) -> None:
        """Book a round that is like none before it; a short one is remembered, for the next may be like it."""
        began = self._clock()
        found = book(shipments, self._machine.timing, self._costs)
        took = self._clock() - began
        self._spent += took
        self._each = took / len(shipments)
        if len(shipments) > _SHORT:
            self._totals.add(found, 1)
            return
        if len(self._known) >= _REMEMBERED:
            self._settle()
            self._known.clear()
        self._known[shipments] = found
        self._times[shipments] = 1

    def _settle(self) -> None:
        for shipments, times in self._times.items():
            self._totals.add(self._known[shipments], times)
        self._times.clear()
