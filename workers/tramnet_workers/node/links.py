"""A worker's links, for as long as it has a seat: what it sends, takes in and passes on.

Frames are taken in on the transport's thread that delivers them, for every other thread that a chunk went through
would cost a generation about a tenth of its round trip; those for other TRAMs, and those that wait for their
wiring, are the router's. Answers and what is passed on share one lock: a frame's number and its place on the link.
"""

import threading
from collections.abc import Callable

from tramnet_protocol.channel import Channel, Lane, Publisher
from tramnet_protocol.codec import Frame, Header
from tramnet_protocol.errors import MalformedFrame
from tramnet_protocol.exchange import Exchange, Identity
from tramnet_protocol.keys import Keys
from tramnet_protocol.links import LinkTiming
from tramnet_protocol.messages import (
    ROOT,
    Failed,
    LinkCounters,
    Outcome,
    PopulationSnapshot,
    TagCounters,
    Wiring,
    Work,
)
from tramnet_protocol.pacing import Pacer
from tramnet_workers.node.router import Router


class Links:
    """The links of one TRAM.

    Args:
        channel: Its end of the network.
        keys: Keys of the network.
        identity: Who it is.
        wiring: The wiring it was told of when it joined.
        take: Takes in work of the root, on a thread of the transport or the router's; it must not wait.
        pace: What a frame costs on a link, or None where links have no pace but their own.

    Attributes:
        exchange: The frames' bookkeeping.
    """

    def __init__(
        self,
        channel: Channel,
        keys: Keys,
        identity: Identity,
        wiring: Wiring,
        take: Callable[[Header, Work], None],
        pace: LinkTiming | None = None,
    ) -> None:
        self.exchange = Exchange(keys, identity, wiring)
        self._pacer = None if pace is None else Pacer(channel, pace)
        self._sender: Publisher = self._pacer or channel
        self._deliver = take
        self._sending = threading.Lock()
        self._open = True
        self._router = Router(self.exchange, self._pass_on, self._take)
        channel.subscribe(keys.links_to(identity.seat), self._arrive)

    def send(self, *messages: Outcome | Failed | PopulationSnapshot) -> None:
        """Send the root messages that belong together, by one wiring; nothing once closed."""
        with self._sending:
            if not self._open:
                return  # the root that asked is gone
            root = (ROOT, self.exchange.wiring.incarnations[ROOT])
            for message in messages:
                key, payload = self.exchange.outgoing(root, message)
                self._sender.publish(key, payload, Lane.LINK)

    def rewire(self, wiring: Wiring) -> None:
        """Send by a newer wiring from now on, and let go on what has waited for it."""
        with self._sending:
            self.exchange.rewire(wiring)
        self._router.rewired()

    def counters(self) -> tuple[tuple[LinkCounters, ...], tuple[TagCounters, ...]]:
        """Return what has passed, by link and by kind of message."""
        with self._sending:
            waiting = self._router.inbox.waiting
            return tuple(self.exchange.counters(waiting)), tuple(self.exchange.tags())

    def close(self) -> None:
        """Pass on what is here, and send nothing more."""
        self._router.close()
        with self._sending:
            self._open = False
        if self._pacer is not None:
            self._pacer.close()

    # Threads of the transport and of the router.

    def _arrive(self, key: str, payload: bytes) -> None:
        frame = self.exchange.incoming(key, payload)
        if frame is None:
            return
        if self.exchange.is_ours(frame) and self.exchange.routes.knows(frame.header.epoch):
            if self.exchange.admits(key, frame):
                self._take(frame)
        else:
            self._router.put(key, frame, len(payload))

    def _pass_on(self, key: str, frame: Frame) -> None:
        with self._sending:
            onward = self.exchange.forward(key, frame)
            if onward is not None and self._open:
                self._sender.publish(*onward, Lane.LINK)

    def _take(self, frame: Frame) -> None:
        try:
            message = frame.message()
        except MalformedFrame as error:
            self.exchange.refuse(f"of TRAM {frame.header.source}", error)
            return
        if frame.header.source == ROOT and isinstance(message, Work):
            self._deliver(frame.header, message)
        else:
            self.exchange.foreign += 1
