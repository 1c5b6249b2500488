"""A node's end of its links: frames numbered and addressed on their way out, checked and counted on their way in.

Pure bookkeeping: no socket and no thread. Whoever owns an exchange keeps its calls apart and does the sending.
"""

import dataclasses
import logging
from collections.abc import Iterator
from typing import NamedTuple

from tramnet_protocol.codec import Frame, Header, decode, encode
from tramnet_protocol.errors import MalformedFrame, ProtocolError, UnknownKey
from tramnet_protocol.keys import Keys, parse
from tramnet_protocol.messages import MAX_WORD, LinkCounters, Message, Wiring
from tramnet_protocol.sequences import SequenceChecker, SequenceCounter
from tramnet_protocol.topology import graph_of

_log = logging.getLogger(__name__)


class Identity(NamedTuple):
    """Who a node is in a run.

    Attributes:
        run: Number of the run.
        seat: Its seat.
        incarnation: Its incarnation.
    """

    run: int
    seat: int
    incarnation: int


@dataclasses.dataclass(slots=True)
class _Traffic:
    frames: int = 0
    bytes: int = 0
    dropped: int = 0


class Exchange:
    """The frames of one node.

    Args:
        keys: Keys of the network.
        identity: Who the node is.
        wiring: The wiring it knows.

    Attributes:
        identity: Who the node is.
        malformed: Payloads that were no frames.
        foreign: Frames of other runs, or for other TRAMs or incarnations.
    """

    def __init__(self, keys: Keys, identity: Identity, wiring: Wiring) -> None:
        self.identity = identity
        self.malformed = 0
        self.foreign = 0
        self._keys = keys
        self._numbers = SequenceCounter()
        self._checkers: dict[int, SequenceChecker] = {}
        self._sent: dict[int, _Traffic] = {}
        self._received: dict[int, _Traffic] = {}
        self.rewire(wiring)

    @property
    def wiring(self) -> Wiring:
        """The wiring in force."""
        return self._wiring

    def rewire(self, wiring: Wiring) -> None:
        """Route by another wiring from now on.

        Raises:
            BadTopology: A link of it joins a TRAM that is not live.
        """
        self._next_hops = graph_of(wiring).next_hops(self.identity.seat)
        self._wiring = wiring

    def outgoing(self, destination: tuple[int, int], message: Message) -> tuple[str, bytes]:
        """Return link topic and payload of a message to a TRAM.

        Args:
            destination: Its seat and incarnation.
            message: What to say.

        Raises:
            MessageTooLarge: The frame is above the limit.
            BadMessage: The message holds something that may not travel.
        """
        seat, incarnation = destination
        hop = self._next_hops.get(seat, seat)
        header = Header(
            run=self.identity.run,
            epoch=self._wiring.epoch,
            source=self.identity.seat,
            source_incarnation=self.identity.incarnation,
            destination=seat,
            destination_incarnation=incarnation,
            sequence=self._numbers.take(hop),
        )
        payload = encode(header, message)
        traffic = self._sent.setdefault(hop, _Traffic())
        traffic.frames += 1
        traffic.bytes += len(payload)
        return self._keys.link(self.identity.seat, hop), payload

    def incoming(self, key: str, payload: bytes) -> Frame | None:
        """Return the frame that arrived on a link, or None for one that is counted and dropped.

        Args:
            key: The link topic.
            payload: What arrived on it.
        """
        try:
            hop = parse(key).seats[0]
        except UnknownKey as error:
            self._refuse(key, error)
            return None
        traffic = self._received.setdefault(hop, _Traffic())
        try:
            frame = decode(payload)
        except MalformedFrame as error:
            traffic.dropped += 1
            self._refuse(key, error)
            return None
        traffic.frames += 1
        traffic.bytes += len(payload)
        self._checkers.setdefault(hop, SequenceChecker(from_start=False)).arrived(
            frame.header.sequence
        )
        if not self._is_ours(frame.header):
            self.foreign += 1
            traffic.dropped += 1
            return None
        return frame

    def counters(self) -> Iterator[LinkCounters]:
        """Yield the counters of every link this node has sent or received on."""
        own = self.identity.seat
        for hop, sent in self._sent.items():
            yield LinkCounters(own, hop, sent.frames, sent.bytes, sent.dropped)
        for hop, got in self._received.items():
            checker = self._checkers.get(hop)
            gaps = min(checker.missed, MAX_WORD) if checker is not None else 0
            yield LinkCounters(hop, own, got.frames, got.bytes, got.dropped, gaps)

    def forget(self, seat: int) -> None:
        """Begin the link with a TRAM anew: another worker will take that seat."""
        self._checkers.pop(seat, None)
        self._numbers.reopen(seat)

    def _refuse(self, key: str, error: ProtocolError) -> None:
        self.malformed += 1
        _log.warning("dropped a frame on %s: %s", key[:120], error)

    def _is_ours(self, header: Header) -> bool:
        return (
            header.run == self.identity.run
            and header.destination == self.identity.seat
            and header.destination_incarnation == self.identity.incarnation
        )
