"""Answers whoever comes to the root: workers that ask for a seat, and people who steer."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tramnet_master.farm.membership import Member, Membership, Process
from tramnet_protocol.codec import Header, decode, encode
from tramnet_protocol.errors import BadTopology, MalformedFrame
from tramnet_protocol.messages import (
    PROTOCOL_VERSION,
    ControlReply,
    ControlRequest,
    JoinReply,
    JoinRequest,
    Message,
    Pace,
    Refusal,
    Setup,
)
from tramnet_protocol.topology import ALL_SEATS

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class House:
    """What the root tells everybody who joins, and what it expects of them.

    Attributes:
        run: Number of the run.
        root_incarnation: Incarnation of the root.
        setup: The problem.
        fingerprint: Fingerprint of the root's own arithmetic.
        allow_mixed: Whether workers of another fingerprint are let in.
        pace: Speed of the links whose pace frames shall have [Mbaud], or 0 for their own.
        seats: Seats that each certificate's name may take, or None where nobody needs one.
    """

    run: int
    root_incarnation: int
    setup: Setup
    fingerprint: str
    allow_mixed: bool = False
    pace: Pace = 0
    seats: Mapping[str, range] | None = None


class Reception:
    """Lets workers in or says why not.

    Args:
        house: What is told and expected.
        membership: The seats.

    Attributes:
        mixed: Whether a worker of another fingerprint was let in.
        refused: Number of workers turned away.
    """

    def __init__(self, house: House, membership: Membership) -> None:
        self._house = house
        self._membership = membership
        self._banned: set[object] = set()  # names of certificates, or processes
        self.mixed = False
        self.refused = 0

    def join(self, payload: bytes, now: float, name: str | None = None) -> bytes:
        """Answer a worker that asks for a seat.

        Args:
            payload: Its question.
            now: Monotonic time [s].
            name: Name of its certificate, as the transport has seen it, or None where it showed none.
        """
        try:
            request = decode(payload).message()
        except MalformedFrame as error:
            return self._refuse(str(error))
        if not isinstance(request, JoinRequest):
            return self._refuse(f"found a {type(request).__name__}, expected a JoinRequest")
        seats = self._seats_of(name)
        reason = self._objection(request) if seats else f"no seat is for {name or 'the nameless'}"
        if self._banned & {name, Process.of(request)}:
            reason = "it answered what is not so, and is expelled"
        if reason:
            return self._refuse(reason)
        try:
            member = self._membership.admit(request, now, seats, name)
        except BadTopology as error:
            return self._refuse(str(error), final=False)
        reply = JoinReply(
            self._house.run,
            member.tram.seat,
            member.tram.incarnation,
            self._house.root_incarnation,
            self._house.setup,
            self._membership.wiring,
            self._house.pace,
        )
        return self._frame(reply)

    def ban(self, member: Member) -> None:
        """Let nobody in any more who has a member's certificate or, where there are none, is its process."""
        own = Process.of(member.request)
        self._banned.add(member.name if member.name is not None else own)

    def control(self, payload: bytes, act: Callable[[ControlRequest], ControlReply]) -> bytes:
        """Answer somebody who steers.

        Args:
            payload: The question.
            act: Does what is asked and returns what to say; raises ValueError to refuse.
        """
        try:
            request = decode(payload).message()
            if not isinstance(request, ControlRequest):
                raise ValueError(f"found a {type(request).__name__}, expected a ControlRequest")
            return self._frame(act(request))
        except (MalformedFrame, ValueError) as error:
            return self._frame(Refusal(str(error), final=True))

    def _seats_of(self, name: str | None) -> range:
        if self._house.seats is None:
            return ALL_SEATS
        return self._house.seats.get(name or "", range(0))

    def _objection(self, request: JoinRequest) -> str:
        if request.protocol != PROTOCOL_VERSION:
            return (
                f"found protocol version {request.protocol}, expected {PROTOCOL_VERSION}; "
                "install the same tramnet on all nodes"
            )
        if request.fingerprint == self._house.fingerprint:
            return ""
        if self._house.allow_mixed:
            self.mixed = True
            _log.warning("%s computes differently: the result is not reproducible", request.host)
            return ""
        return (
            f"found the arithmetic fingerprint {request.fingerprint[:16]}, expected "
            f"{self._house.fingerprint[:16]}: this machine computes other last digits than the root's; "
            "use the same versions and kind of processor, or start the root with --allow-mixed"
        )

    def _refuse(self, reason: str, final: bool = True) -> bytes:
        self.refused += 1
        _log.warning("turned a worker away: %s", reason)
        return self._frame(Refusal(reason, final))

    def _frame(self, message: Message) -> bytes:
        header = Header(
            run=self._house.run,
            epoch=self._membership.wiring.epoch,
            source=0,
            source_incarnation=self._house.root_incarnation,
        )
        return encode(header, message)
