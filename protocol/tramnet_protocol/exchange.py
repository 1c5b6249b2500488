"""A node's end of its links: frames numbered and addressed on their way out, checked and counted on their way in.

Pure bookkeeping: no socket and no thread. Whoever owns an exchange keeps its calls apart and does the sending.
"""

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import msgspec

from tramnet_protocol.codec import MESSAGES, Frame, Header, decode, encode, encode_raw, tag_of
from tramnet_protocol.errors import MalformedFrame, ProtocolError, UnknownKey
from tramnet_protocol.keys import Keys, parse
from tramnet_protocol.messages import MAX_WORD, LinkCounters, Message, TagCounters, Wiring
from tramnet_protocol.routes import Routes
from tramnet_protocol.sequences import SequenceChecker, SequenceCounter

NOTHING_WAITS: Mapping[str, int] = MappingProxyType({})

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


@dataclass(slots=True)
class _Outgoing:
    """What was sent on a link."""

    key: str
    frames: int = 0
    bytes: int = 0


@dataclass(slots=True)
class _Incoming:
    """What arrived on a link."""

    source: int
    frames: int = 0
    bytes: int = 0
    dropped: int = 0
    checker: SequenceChecker = field(default_factory=lambda: SequenceChecker(from_start=False))


@dataclass(slots=True)
class _Tag:
    """Messages of one kind, made here or addressed to this node."""

    sent: int = 0
    sent_bytes: int = 0
    received: int = 0
    received_bytes: int = 0


class Exchange:
    """The frames of one node.

    Args:
        keys: Keys of the network.
        identity: Who the node is.
        wiring: The wiring it knows.

    Attributes:
        identity: Who the node is.
        malformed: Payloads that were no frames.
        foreign: Frames of other runs or for other incarnations, or on links their TRAM does not have.
        stranded: Frames not passed on, for their next TRAM is gone.
        routes: The wirings it knows.
    """

    def __init__(self, keys: Keys, identity: Identity, wiring: Wiring) -> None:
        self.identity = identity
        self.malformed = 0
        self.foreign = 0
        self.stranded = 0
        self.routes = Routes(identity.seat, wiring)
        self._keys = keys
        self._numbers = SequenceCounter()
        self._sent: dict[int, _Outgoing] = {}  # by TRAM
        self._received: dict[str, _Incoming] = {}  # by key, so that a key is parsed once
        self._tags: dict[str, _Tag] = {tag: _Tag() for tag in sorted(MESSAGES)}

    @property
    def wiring(self) -> Wiring:
        """The newest wiring."""
        return self.routes.wiring

    def rewire(self, wiring: Wiring) -> None:
        """Send by a newer wiring from now on; links to seats that others have taken begin anew.

        Raises:
            BadTopology: A link of it joins a TRAM that is not live.
        """
        before = self.wiring.incarnations
        self.routes.adopt(wiring)
        for seat, incarnation in wiring.incarnations.items():
            if before.get(seat) != incarnation:
                self._forget(seat)

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
        step = self.routes.step(self.wiring.epoch, seat)
        assert step is not None, f"TRAM {seat} is not wired in"
        header = Header(
            run=self.identity.run,
            epoch=step.epoch,
            source=self.identity.seat,
            source_incarnation=self.identity.incarnation,
            destination=seat,
            destination_incarnation=incarnation,
            sequence=self._numbers.take(step.hop),
        )
        payload = encode(header, message)
        tag = self._tags[tag_of(message)]
        tag.sent += 1
        tag.sent_bytes += len(payload)
        return self._count(step.hop, payload), payload

    def forward(self, key: str, frame: Frame) -> tuple[str, bytes] | None:
        """Return link topic and payload of a frame for another TRAM, or None where its next TRAM is gone.

        The body is passed on unread. Only the number changes, and the epoch where it is older than all known here.

        Args:
            key: The link topic it came on.
            frame: A frame whose wiring is known.
        """
        step = self.routes.step(frame.header.epoch, frame.header.destination)
        if step is None:
            self.stranded += 1
            self.drop(key)
            return None
        number = self._numbers.take(step.hop)
        header = msgspec.structs.replace(frame.header, epoch=step.epoch, sequence=number)
        payload = encode_raw(header, frame.body)
        return self._count(step.hop, payload), payload

    def incoming(self, key: str, payload: bytes) -> Frame | None:
        """Return the frame that arrived on a link, or None for one that is counted and dropped.

        It may be for another TRAM: see ``is_ours`` and ``forward``.

        Args:
            key: The link topic.
            payload: What arrived on it.
        """
        link = self._received.get(key)
        if link is None:
            try:
                link = self._received[key] = _Incoming(parse(key).seats[0])
            except UnknownKey as error:
                self.refuse(f"on {key[:120]}", error)
                return None
        try:
            frame = decode(payload)
        except MalformedFrame as error:
            link.dropped += 1
            self.refuse(f"on {key[:120]}", error)
            return None
        link.frames += 1
        link.bytes += len(payload)
        link.checker.arrived(frame.header.sequence)
        if not self._is_valid(frame.header):
            self.foreign += 1
            link.dropped += 1
            return None
        tag = self._tags.get(frame.header.tag)
        if tag is not None and self.is_ours(frame):
            tag.received += 1
            tag.received_bytes += len(payload)
        return frame

    def admits(self, key: str, frame: Frame) -> bool:
        """Return whether a frame may have come this way; one that may not is counted and dropped.

        Args:
            key: The link topic it came on.
            frame: A frame whose wiring is known.
        """
        if self.routes.admits(self._received[key].source, frame.header.source):
            return True
        self.foreign += 1
        self.drop(key)
        return False

    def refuse(self, where: str, error: ProtocolError) -> None:
        """Count a frame that cannot be understood, and log the first, second, fourth, ... of them."""
        self.malformed += 1
        if self.malformed.bit_count() == 1:
            _log.warning("dropped frame %d: %s: %s", self.malformed, where, error)

    def is_ours(self, frame: Frame) -> bool:
        """Return whether a frame is for this node, not to be passed on."""
        return frame.header.destination == self.identity.seat

    def is_for_this_life(self, header: Header) -> bool:
        """Return whether a frame is for this node and its present incarnation."""
        return (
            header.destination == self.identity.seat
            and header.destination_incarnation == self.identity.incarnation
        )

    def drop(self, key: str) -> None:
        """Count a frame as dropped that came on a link and goes no further."""
        self._received[key].dropped += 1

    def counters(self, waiting: Mapping[str, int] = NOTHING_WAITS) -> Iterator[LinkCounters]:
        """Yield the counters of every link this node has sent or received on.

        Args:
            waiting: Frames that wait at this node, to be sent or to be taken, by key of their link.
        """
        own = self.identity.seat
        for hop, sent in self._sent.items():
            queued = waiting.get(sent.key, 0)
            yield LinkCounters(own, hop, sent.frames, sent.bytes, queued=queued)
        # Another thread may take the first frame of a link.
        for key, got in tuple(self._received.items()):
            gaps = min(got.checker.missed, MAX_WORD)
            queued = waiting.get(key, 0)
            yield LinkCounters(got.source, own, got.frames, got.bytes, got.dropped, gaps, queued)

    def tags(self) -> Iterator[TagCounters]:
        """Yield the counters of every kind of message this node has made or taken, by tag."""
        for tag, seen in self._tags.items():
            if seen.sent or seen.received:
                yield TagCounters(
                    tag, seen.sent, seen.sent_bytes, seen.received, seen.received_bytes
                )

    def _count(self, hop: int, payload: bytes) -> str:
        """Count a frame that is sent, and return the topic of its link."""
        link = self._sent.get(hop)
        if link is None:
            link = self._sent[hop] = _Outgoing(self._keys.link(self.identity.seat, hop))
        link.frames += 1
        link.bytes += len(payload)
        return link.key

    def _forget(self, seat: int) -> None:
        """Begin the link with a TRAM anew: another worker has taken that seat."""
        link = self._received.get(self._keys.link(seat, self.identity.seat))
        if link is not None:
            link.checker = SequenceChecker(from_start=False)
        self._numbers.reopen(seat)

    def _is_valid(self, header: Header) -> bool:
        """Return whether a frame is of this run and, if for this seat, for who sits here now."""
        return header.run == self.identity.run and (
            header.destination != self.identity.seat or self.is_for_this_life(header)
        )
