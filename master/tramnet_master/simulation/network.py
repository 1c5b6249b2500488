"""Messages over the links of a network, hop by hop, in virtual time.

Every TRAM on the way takes a message in whole before it passes it on (store and forward), and always has room for
it. A link's two ways are those of ``DuplexLink``; different links know nothing of each other.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from tramnet_master.simulation.agenda import Agenda
from tramnet_protocol.duplex import NEVER, DuplexLink
from tramnet_protocol.links import LinkTiming

Way: TypeAlias = tuple[int, int]
"""A directed link: from which TRAM, to which."""


@dataclass(slots=True)
class Traffic:
    """What a directed link has carried.

    Attributes:
        frames: Messages.
        bytes: Their modelled length [B].
        busy: Time in which it was set up or moved [ns].
        waited: Time for which messages waited for it, added up [ns].
    """

    frames: int = 0
    bytes: int = 0
    busy: int = 0
    waited: int = 0

    def add(self, other: "Traffic", times: int = 1) -> None:
        """Count what another one has carried as well, so many times."""
        self.frames += other.frames * times
        self.bytes += other.bytes * times
        self.busy += other.busy * times
        self.waited += other.waited * times

    def copy(self) -> "Traffic":
        """Return what it has carried until now."""
        return Traffic(self.frames, self.bytes, self.busy, self.waited)


class _Journey:
    """A message on its way.

    Attributes:
        leg: Index of the TRAM it leaves next.
    """

    __slots__ = ("arrived", "leg", "route", "size")

    def __init__(self, route: Sequence[int], size: int, arrived: Callable[[], None]) -> None:
        self.route = route
        self.size = size
        self.arrived = arrived
        self.leg = 0


class _Cable:
    """A link with its two ends.

    Attributes:
        link: Its two ways.
        traffic: What each has carried.
        wake: When it is looked at next [ns], or ``NEVER``.
    """

    __slots__ = ("link", "traffic", "wake")

    def __init__(self, timing: LinkTiming, traffic: tuple[Traffic, Traffic]) -> None:
        self.link: DuplexLink[_Journey] = DuplexLink(timing)
        self.traffic = traffic
        self.wake = NEVER


class Network:
    """The links between TRAMs; each comes into being with its first message.

    Args:
        agenda: Where the network plans what happens.
        timing: What a message costs on any link.

    Attributes:
        traffic: What each directed link has carried; both ways of a link are there or none.
    """

    def __init__(self, agenda: Agenda, timing: LinkTiming) -> None:
        self.traffic: dict[Way, Traffic] = {}
        self._agenda = agenda
        self._timing = timing
        self._cables: dict[Way, tuple[_Cable, int]] = {}

    def send(self, route: Sequence[int], size: int, arrived: Callable[[], None]) -> None:
        """Send a message now.

        Args:
            route: The TRAMs it passes, both ends included; two at least.
            size: Its length [B].
            arrived: Called when the process that receives it runs.
        """
        self._offer(_Journey(route, size, arrived))

    def _offer(self, journey: _Journey) -> None:
        start, end = journey.route[journey.leg : journey.leg + 2]
        cable, way = self._cables.get((start, end)) or self._lay(start, end)
        now = self._agenda.now
        self._collect(cable, now)
        cable.link.offer(way, journey, journey.size, now)
        self._watch(cable, now)

    def _lay(self, start: int, end: int) -> tuple[_Cable, int]:
        there = self.traffic[start, end] = Traffic()
        back = self.traffic[end, start] = Traffic()
        cable = _Cable(self._timing, (there, back))
        self._cables[start, end], self._cables[end, start] = (cable, 0), (cable, 1)
        return cable, 0

    def _watch(self, cable: _Cable, now: int) -> None:
        """See to it that the link is looked at when something changes on it."""
        time = cable.link.next_time
        if time < cable.wake:
            cable.wake = time
            self._agenda.after(time - now, self._wake, cable)

    def _wake(self, cable: _Cable) -> None:
        now = self._agenda.now
        if cable.wake == now:  # and no earlier look was planned since
            cable.wake = NEVER
            self._collect(cable, now)
            self._watch(cable, now)

    def _collect(self, cable: _Cable, now: int) -> None:
        """Count what has gone over a link, and pass it on."""
        for gone in cable.link.advance(now):
            traffic = cable.traffic[gone.way]
            traffic.frames += 1
            traffic.bytes += gone.size
            traffic.busy += gone.ended - gone.began
            traffic.waited += gone.began - gone.offered
            journey = gone.item
            journey.leg += 1
            if journey.leg == len(journey.route) - 1:
                self._agenda.after(self._timing.wake_up, _arrive, journey)
            else:
                delay = self._timing.wake_up + self._timing.routing
                self._agenda.after(delay, self._offer, journey)


def _arrive(journey: _Journey) -> None:
    journey.arrived()
