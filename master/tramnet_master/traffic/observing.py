"""What all tools that watch a network have in common: where they attach, and when they end.

They attach at the root's endpoint for observers, where the root drops rather than waits. They end when somebody
wants it (Ctrl-C, SIGTERM, a closed terminal: a second one ends the process at once) or when the root is gone for
good. Nothing here asks the root for anything but its status.
"""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from tramnet_master import networks
from tramnet_master.control import locate, question
from tramnet_master.errors import NoNetwork, RunFailed
from tramnet_master.signals import ending
from tramnet_master.traffic.status import read_status
from tramnet_protocol.channel import Channel
from tramnet_protocol.errors import ChannelClosed, NoAnswer
from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import ROOT, ControlRequest
from tramnet_protocol.security import Credentials
from tramnet_protocol.settings import protocol_of
from tramnet_protocol.transport import open_observer

GRACE = 1.0
"""Time in which a root whose token disappeared may be back: its connection broke, it did not end [s]."""

START_UP = 120.0
"""Longest wait for the first answer of a root of this machine, which may be compiling [s]."""

PATIENCE = 5.0
"""Longest wait for an answer [s]."""

PERIOD = 1.0
"""Time between two questions for the status [s]."""


class Observation:
    """A network that is watched.

    Args:
        live: Where it is.
        channel: The observer's end of it.

    Attributes:
        live: Where it is.
        channel: The observer's end of it.
        keys: Its keys.
        stopped: Set when somebody wants the tool to end.
    """

    def __init__(self, live: networks.LiveNetwork, channel: Channel) -> None:
        self.live = live
        self.channel = channel
        self.keys = Keys(live.network)
        self.stopped = threading.Event()
        self._vanished: float | None = None
        channel.watch_tokens(self.keys.alive(ROOT), self._watch_root)

    @property
    def ended(self) -> bool:
        """Whether the root is gone for good."""
        vanished = self._vanished
        return vanished is not None and time.monotonic() - vanished > GRACE

    @property
    def over(self) -> bool:
        """Whether to end."""
        return self.stopped.is_set() or self.ended

    def status(self, timeout: float = PATIENCE) -> dict[str, object]:
        """Return what the root says of itself.

        Raises:
            NoAnswer: It does not answer.
            RunFailed: It refuses.
        """
        return question(self.channel, self.keys, ControlRequest("status"), timeout).status

    def in_the_way(self, said: dict[str, object]) -> bool:
        """Return whether this is where workers attach: whoever is stopped there can hold the network up.

        Args:
            said: What the root says of itself.
        """
        places = {protocol_of(place) for place in read_status(said).observers}
        return bool(places) and protocol_of(self.live.observers) not in places

    def first_status(self) -> dict[str, object]:
        """Return the status of a root that may still be starting.

        Raises:
            NoAnswer: It does not answer, or the tool is to end.
        """
        end = time.monotonic() + START_UP
        while True:
            try:
                return self.status()
            except NoAnswer:
                if time.monotonic() > end or self.over or not self._is_live_here():
                    raise
            self.stopped.wait(0.1)

    def _is_live_here(self) -> bool:
        try:
            return bool(self.live.pid) and networks.find(self.live.network).pid == self.live.pid
        except NoNetwork:
            return False

    def _watch_root(self, _: str, alive: bool) -> None:
        self._vanished = None if alive else time.monotonic()


class StatusPoll(threading.Thread):
    """Asks the root for its status once a second, beside whatever the tool does.

    Args:
        observation: The network.
        first: The status to begin with.

    Attributes:
        latest: The last status that came.
    """

    def __init__(self, observation: Observation, first: dict[str, object]) -> None:
        super().__init__(name="status", daemon=True)
        self.latest = first
        self._observation = observation
        self._heard = time.monotonic()
        self._closed = threading.Event()

    @property
    def silent_for(self) -> float:
        """Time since the root answered last [s]."""
        return time.monotonic() - self._heard

    def run(self) -> None:
        """Ask until the tool ends."""
        while not self._closed.wait(PERIOD):
            try:
                self.latest = self._observation.status()
            except (NoAnswer, ChannelClosed, RunFailed):
                continue  # it is shown how long the root has been silent
            self._heard = time.monotonic()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closed.set()
        self.join()


@contextmanager
def observe(
    connect: str | None, network: str | None, tls: Path | None = None
) -> Iterator[Observation]:
    """Attach to a network until the block ends; Ctrl-C and SIGTERM set ``stopped`` meanwhile.

    Args:
        connect: Endpoint of the root for observers, or None.
        network: Name of the network, or None for the only live one.
        tls: Folder with the root's certificate, for a root elsewhere that asks for one.

    Raises:
        NoNetwork: None is alive here, or none of that name.
        AmbiguousNetwork: Several are alive and no name was given.
        CannotConnect: Nobody listens there.
    """
    live = locate(connect, network)
    with open_observer(live.observers, Credentials.load(tls) if tls else None) as channel:
        observation = Observation(live, channel)
        with ending(observation.stopped.set):
            yield observation
