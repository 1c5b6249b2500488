"""Who sits where: seats, incarnations and the wiring over them. Pure bookkeeping.

A worker that asks to join is given the lowest free seat and a new incarnation, and is *expected*. It is *live*
once its token appears, which it declares last, when it can take work and pass on that of others: only then is it
wired in, for one that still compiles would hold up those behind it. One that has fallen silent is *out*: no longer
wired in, until its token is gone. Then the seat is free again, so a token never belongs to two lives of a seat.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import NamedTuple

from tramnet_master.farm.events import Tram
from tramnet_protocol.errors import BadTopology
from tramnet_protocol.limits import MAX_ITEMS
from tramnet_protocol.messages import ROOT, JoinRequest, Stats, Wiring
from tramnet_protocol.topology import ALL_SEATS, Shape, lowest_free_seat, rewire

SILENCE = 2.5
"""Time without a heartbeat, which is due every second, after which a TRAM counts as silent [s]."""

EXPECTED_FOR = 600.0
"""Time a worker may take from its seat to its token: kernels may have to be compiled [s]."""

DUMB = 60.0
"""Time without a heartbeat after which a worker on its way loses its seat to one that finds no other [s].

Heartbeats begin with the seat, and a worker that compiles is late by a tenth of a second. Still, one that hangs
for long and goes on would find itself a member of nothing, so no seat is taken away that nobody needs.
"""

MOST_EXPECTED = 512
"""Workers that may have a seat and not be there yet: whoever only asks cannot take all seats."""


@dataclass(slots=True)
class Member:
    """A worker with a seat.

    Attributes:
        tram: Its seat and incarnation.
        request: What it said of itself.
        since: When it was given its seat [s].
        live: Whether it can take work, and belongs into the wiring.
        out: Whether it was wired out while its token stands.
        stats: Its last heartbeat.
        heard: When that came [s], or its question or its token.
        fresh: Whether its process has joined for the first time.
        name: Name of its certificate, or None where it showed none.
    """

    tram: Tram
    request: JoinRequest
    since: float
    live: bool = False
    out: bool = False
    stats: Stats | None = None
    heard: float = 0.0
    fresh: bool = True
    name: str | None = None


class Process(NamedTuple):
    """What tells a worker process from all others.

    Host and process id alone do not: containers may have the same name, and in each the ids begin anew.
    """

    host: str
    pid: int
    supervisor: str

    @classmethod
    def of(cls, request: JoinRequest) -> "Process":
        """Return the process that asks for a seat."""
        return cls(request.host, request.pid, request.supervisor)


class Membership:
    """The seats of one network.

    Args:
        shape: What the TRAMs are wired in.
        root_incarnation: Incarnation of the root.

    Attributes:
        wiring: The wiring in force.
        joined: Number of workers that ever became live.
    """

    def __init__(self, shape: Shape, root_incarnation: int) -> None:
        self._shape = shape
        self._root_incarnation = root_incarnation
        self._members: dict[int, Member] = {}
        self._incarnations = 0
        self._processes: set[Process] = set()  # all that were live
        self.joined = 0
        self.wiring: Wiring = rewire(shape, {ROOT: root_incarnation}, 0)

    def rewire(self) -> Wiring:
        """Make a new wiring over the workers that are live now, and return it."""
        lives = {member.tram.seat: member.tram.incarnation for member in self.live}
        epoch = self.wiring.epoch + 1
        self.wiring = rewire(self._shape, {ROOT: self._root_incarnation, **lives}, epoch)
        return self.wiring

    @property
    def members(self) -> list[Member]:
        """The workers with a seat, in the order of seats."""
        return [self._members[seat] for seat in sorted(self._members)]

    @property
    def live(self) -> list[Member]:
        """The workers that can take work, in the order of seats."""
        return [member for member in self.members if member.live]

    def admit(
        self, request: JoinRequest, now: float, seats: range = ALL_SEATS, name: str | None = None
    ) -> Member:
        """Give a worker a seat; it is wired in when its token appears.

        Args:
            request: Its question.
            now: Monotonic time [s].
            seats: Seats it may have.
            name: Name of its certificate, or None where it showed none.

        Raises:
            BadTopology: The shape has no room for it, none of these is free, or too many are on their way.
        """
        self._forget(member for member in self._expected if now - member.since > EXPECTED_FOR)
        for member in self._expected:
            if (Process.of(member.request), member.name) == (Process.of(request), name):
                member.heard = now
                return member  # it did not hear the answer
        try:
            seat = self._find_seat(seats)
        except BadTopology:
            self._forget(member for member in self._expected if now - member.heard > DUMB)
            seat = self._find_seat(seats)
        self._incarnations += 1
        member = Member(Tram(seat, self._incarnations), request, now, heard=now, name=name)
        self._members[seat] = member
        return member

    def appeared(self, seat: int, now: float) -> Member | None:
        """Note a token; return the member that became live by it, if one did.

        Args:
            seat: Whose token.
            now: Monotonic time [s].
        """
        member = self._members.get(seat)
        if member is None or member.live or member.out:
            return None
        member.live = True
        member.heard = now
        self.joined += 1
        process = Process.of(member.request)
        member.fresh = process not in self._processes
        self._processes.add(process)
        return member

    def vanished(self, seat: int) -> Member | None:
        """Free the seat of a token that is gone; return the member that was live there."""
        member = self._members.get(seat)
        if member is None or not (member.live or member.out):
            return None
        del self._members[seat]
        if member.out:
            return None
        return member

    def expel(self, tram: Tram) -> Member | None:
        """Wire a worker out whose token stands; return it, if it was live."""
        member = self.find(tram)
        if member is None or not member.live:
            return None
        member.live, member.out = False, True
        return member

    def silent(self, now: float) -> frozenset[Tram]:
        """Return the live workers whose heartbeat is missing."""
        return frozenset(
            member.tram
            for member in self._members.values()
            if member.live and now - member.heard > SILENCE
        )

    def abandon(self, pid: int, host: str) -> None:
        """Free the seat of a process that ended before its token appeared."""
        wanted = (pid, host)
        self._forget(
            member
            for member in self._expected
            if (member.request.pid, member.request.host) == wanted
        )

    def heard(self, stats: Stats, now: float) -> None:
        """Note a heartbeat."""
        member = self.find(Tram(stats.seat, stats.incarnation))
        if member is not None:
            member.stats, member.heard = stats, now

    def find(self, tram: Tram) -> Member | None:
        """Return a worker by seat and incarnation, if it has its seat still."""
        member = self._members.get(tram.seat)
        return member if member is not None and member.tram == tram else None

    def _check_links(self, seats: Collection[int]) -> None:
        """Check that a wiring can tell of all links; with up to half as many TRAMs it always can."""
        if len(seats) <= MAX_ITEMS // 2:
            return
        n_links = len(self._shape.connect(seats).edges)
        if n_links > MAX_ITEMS:
            raise BadTopology(
                f"found {n_links} links of a {self._shape.name} over {len(seats)} TRAMs, and a message "
                f"tells of {MAX_ITEMS} at most; use tree for more"
            )

    def _find_seat(self, seats: range) -> int:
        n_expected = len(self._expected)
        if n_expected >= MOST_EXPECTED:
            raise BadTopology(f"found {n_expected} workers on their way here; ask again later")
        self._shape.check_room(len(self._members) + 2)
        seat = lowest_free_seat(self._members, seats)
        self._check_links({ROOT, seat, *self._members})
        return seat

    @property
    def _expected(self) -> list[Member]:
        return [member for member in self._members.values() if not (member.live or member.out)]

    def _forget(self, members: Iterable[Member]) -> None:
        for member in members:
            del self._members[member.tram.seat]
