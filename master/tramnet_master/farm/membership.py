"""Who sits where: seats, incarnations and the wiring over them. Pure bookkeeping.

A worker that asks to join is given the lowest free seat and a new incarnation, and is *expected*. It is *live*
once its token appears, which it declares last, when it can take work. The seat is free again when the token is
gone, so a token never belongs to two lives of a seat.
"""

from dataclasses import dataclass

from tramnet_master.farm.events import Tram
from tramnet_protocol.messages import ROOT, JoinRequest, Stats, Wiring
from tramnet_protocol.topology import ALL_SEATS, lowest_free_seat, rewire

EXPECTED_FOR = 600.0
"""Time a worker may take from its seat to its token: kernels may have to be compiled [s]."""


@dataclass(slots=True)
class Member:
    """A worker with a seat.

    Attributes:
        tram: Its seat and incarnation.
        request: What it said of itself.
        since: When it was given its seat [s].
        live: Whether its token has appeared.
        stats: Its last heartbeat.
        heard: When that came [s].
        fresh: Whether its process has joined for the first time.
    """

    tram: Tram
    request: JoinRequest
    since: float
    live: bool = False
    stats: Stats | None = None
    heard: float = 0.0
    fresh: bool = True


class Membership:
    """The seats of one network.

    Args:
        topology: Name of the shape the TRAMs are wired in.
        root_incarnation: Incarnation of the root.

    Attributes:
        wiring: The wiring in force.
        joined: Number of workers that ever became live.
    """

    def __init__(self, topology: str, root_incarnation: int) -> None:
        self._topology = topology
        self._root_incarnation = root_incarnation
        self._members: dict[int, Member] = {}
        self._incarnations = 0
        self._processes: set[tuple[str, int]] = set()  # host and process id of all that were live
        self.joined = 0
        self.wiring: Wiring = rewire(topology, {ROOT: root_incarnation}, 0)

    @property
    def members(self) -> list[Member]:
        """The workers with a seat, in the order of seats."""
        return [self._members[seat] for seat in sorted(self._members)]

    @property
    def live(self) -> list[Member]:
        """The workers that can take work, in the order of seats."""
        return [member for member in self.members if member.live]

    def admit(self, request: JoinRequest, now: float, seats: range = ALL_SEATS) -> Member:
        """Give a worker a seat and wire it in.

        Args:
            request: Its question.
            now: Monotonic time [s].
            seats: Seats it may have.

        Raises:
            BadTopology: The shape has no room for it, or none of these is free.
        """
        self._forget_the_never_seen(now)
        seat = lowest_free_seat(self._members, seats)
        self._incarnations += 1
        member = Member(Tram(seat, self._incarnations), request, now)
        self._members[seat] = member
        try:
            self._rewire()
        except Exception:
            del self._members[seat]
            raise
        return member

    def appeared(self, seat: int) -> Member | None:
        """Note a token; return the member that became live by it, if one did."""
        member = self._members.get(seat)
        if member is None or member.live:
            return None
        member.live = True
        self.joined += 1
        process = (member.request.host, member.request.pid)
        member.fresh = process not in self._processes
        self._processes.add(process)
        return member

    def vanished(self, seat: int) -> Member | None:
        """Free the seat of a token that is gone; return the member that was live there."""
        member = self._members.get(seat)
        if member is None or not member.live:
            return None
        del self._members[seat]
        self._rewire()
        return member

    def abandon(self, pid: int, host: str) -> None:
        """Free the seat of a process that ended before its token appeared."""
        for seat, member in list(self._members.items()):
            if not member.live and (member.request.pid, member.request.host) == (pid, host):
                del self._members[seat]

    def heard(self, stats: Stats, now: float) -> None:
        """Note a heartbeat."""
        member = self.find(Tram(stats.seat, stats.incarnation))
        if member is not None:
            member.stats, member.heard = stats, now

    def find(self, tram: Tram) -> Member | None:
        """Return a worker by seat and incarnation, if it has its seat still."""
        member = self._members.get(tram.seat)
        return member if member is not None and member.tram == tram else None

    def _forget_the_never_seen(self, now: float) -> None:
        for seat, member in list(self._members.items()):
            if not member.live and now - member.since > EXPECTED_FOR:
                del self._members[seat]

    def _rewire(self) -> None:
        incarnations = {seat: member.tram.incarnation for seat, member in self._members.items()}
        self.wiring = rewire(
            self._topology, {ROOT: self._root_incarnation, **incarnations}, self.wiring.epoch + 1
        )
