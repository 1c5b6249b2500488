"""The channel inside one process: no socket, no clock, and faults on demand, for tests.

On a ``LoopbackNetwork`` a message arrives at once, or, on a stepwise one, at the next ``deliver``. What a fault
makes late waits for ``deliver`` on either. Questions are answered at once and suffer no faults but ``cut``.
"""

import heapq
import itertools
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

from tramnet_protocol.channel import Lane, Query
from tramnet_protocol.errors import ChannelClosed, MessageTooLarge, NoAnswer
from tramnet_protocol.faults import Fault
from tramnet_protocol.keys import matches
from tramnet_protocol.limits import MAX_MESSAGE_BYTES


@dataclass(frozen=True, order=True)
class _Post:
    """Something on its way, ordered by when it is due and by when it was sent."""

    due: int
    number: int
    sender: str = field(compare=False)
    receiver: str = field(compare=False)
    deliver: Callable[[], None] = field(compare=False)


class LoopbackNetwork:
    """A network in memory.

    Args:
        faults: What befalls messages; each message suffers the first fault whose pattern it matches.
        seed: Seed of the faults.
        stepwise: Whether everything waits for ``deliver``.
    """

    def __init__(self, faults: Sequence[Fault] = (), seed: int = 0, stepwise: bool = False) -> None:
        self._faults = tuple(faults)
        self._seed = seed
        self._stepwise = stepwise
        self._lock = threading.RLock()
        self._channels: dict[str, LoopbackChannel] = {}
        self._cut: set[str] = set()
        self._silenced: set[str] = set()  # channels whose tokens nobody sees
        self._waiting: list[_Post] = []  # a heap
        self._numbers = itertools.count()
        self._sent: dict[str, int] = {}  # key -> messages sent on it
        self._step = 0

    def open(self, name: str) -> "LoopbackChannel":
        """Return the channel of a new node, or of one that comes back after it was closed or killed."""
        with self._lock:
            assert name not in self._channels, f"{name} is open already"
            self._cut.discard(name)
            self._silenced.discard(name)
            self._channels[name] = LoopbackChannel(self, name)
            return self._channels[name]

    def deliver(self) -> int:
        """Deliver what is due and take one step; what this sends is due at the next one.

        Returns:
            Number of messages and token changes taken from the network, lost to a cut or not.
        """
        with self._lock:
            due = []
            while self._waiting and self._waiting[0].due <= self._step:
                due.append(heapq.heappop(self._waiting))
            self._step += 1
        for post in due:
            self._hand_over(post)
        return len(due)

    def settle(self, limit: int = 10_000) -> int:
        """Deliver until nothing is on its way, and return how many steps that took."""
        for step in range(limit):
            if not self._waiting:
                return step
            self.deliver()
        raise AssertionError(f"the network is not silent after {limit} steps")

    def cut(self, name: str) -> None:
        """Let nothing reach or leave a node any more, its tokens standing: it hangs, or its cable is out."""
        self._cut.add(name)

    def heal(self, name: str) -> None:
        """End a cut; what was sent meanwhile is lost."""
        self._cut.discard(name)

    def lose_tokens(self, name: str) -> None:
        """Let a node's tokens disappear for all others: its lease ran out."""
        self._show_tokens(name, False)

    def restore_tokens(self, name: str) -> None:
        """Let a node's tokens appear again."""
        self._show_tokens(name, True)

    def kill(self, name: str) -> None:
        """End a node as ``kill -9`` does: what it sent and is due later is lost, and its tokens disappear."""
        self.lose_tokens(name)
        self.cut(name)
        with self._lock:
            self._channels.pop(name).closed = True

    # What follows is for the channels.

    def publish(self, sender: "LoopbackChannel", key: str, payload: bytes) -> None:
        """Send a message to all channels that subscribe to its key."""
        with self._lock:
            number = self._sent.get(key, 0)
            self._sent[key] = number + 1
            subscribers = [
                (channel.name, deliver)
                for channel in self._channels.values()
                for pattern, deliver in channel.subscriptions
                if matches(pattern, key)
            ]
        for late in self._fates(key, number):
            for receiver, deliver in subscribers:
                self._send(sender.name, receiver, late, _call(deliver, key, payload))

    def change_token(self, owner: str, key: str, alive: bool) -> None:
        """Tell all who watch a token that it appeared or disappeared."""
        with self._lock:
            watchers = [
                (channel.name, deliver)
                for channel in self._channels.values()
                for pattern, deliver in channel.watches
                if matches(pattern, key)
            ]
        for receiver, deliver in watchers:
            self._send(owner, receiver, 0, _call(deliver, key, alive))

    def show_tokens_to(
        self, watcher: "LoopbackChannel", pattern: str, deliver: Callable[[str, bool], None]
    ) -> None:
        """Tell a new watcher of the tokens that are there."""
        with self._lock:
            tokens = [
                (channel.name, key)
                for channel in self._channels.values()
                for key in sorted(channel.tokens)
                if channel.name not in self._silenced and matches(pattern, key)
            ]
        for owner, key in tokens:
            self._send(owner, watcher.name, 0, _call(deliver, key, True))

    def server(self, asker: "LoopbackChannel", key: str) -> Callable[[Query], None] | None:
        """Return who serves a key and can be reached."""
        with self._lock:
            for channel in self._channels.values():
                for pattern, deliver in channel.services:
                    if matches(pattern, key) and not self._cut & {asker.name, channel.name}:
                        return deliver
            return None

    def forget(self, channel: "LoopbackChannel") -> None:
        """Take a channel that closes off the network."""
        self.lose_tokens(channel.name)
        with self._lock:
            self._channels.pop(channel.name, None)

    def _fates(self, key: str, number: int) -> tuple[int, ...]:
        for fault in self._faults:
            if matches(fault.key, key):
                return fault.fates(self._seed, key, number)
        return (0,)

    def _show_tokens(self, name: str, alive: bool) -> None:
        with self._lock:
            tokens = sorted(self._channels[name].tokens) if name in self._channels else []
            (self._silenced.discard if alive else self._silenced.add)(name)
        for key in tokens:
            self.change_token(name, key, alive)

    def _send(self, sender: str, receiver: str, late: int, deliver: Callable[[], None]) -> None:
        with self._lock:
            post = _Post(self._step + late, next(self._numbers), sender, receiver, deliver)
            if self._stepwise or late:
                heapq.heappush(self._waiting, post)
                return
        self._hand_over(post)

    def _hand_over(self, post: _Post) -> None:
        if not self._cut & {post.sender, post.receiver} and post.receiver in self._channels:
            post.deliver()


class LoopbackChannel:
    """One node's end of a ``LoopbackNetwork``; see ``Channel`` for what its methods promise.

    Attributes:
        name: Name of the node, for cutting and killing it.
        closed: Whether it was closed or killed.
    """

    def __init__(self, network: LoopbackNetwork, name: str) -> None:
        self._network = network
        self.name = name
        self.closed = False
        self.subscriptions: list[tuple[str, Callable[[str, bytes], None]]] = []
        self.watches: list[tuple[str, Callable[[str, bool], None]]] = []
        self.services: list[tuple[str, Callable[[Query], None]]] = []
        self.tokens: set[str] = set()

    def publish(self, key: str, payload: bytes, lane: Lane) -> None:
        """Send a message to whoever subscribes to a key; all lanes are alike here."""
        self._check_open("publish")
        _check_size(payload)
        self._network.publish(self, key, payload)

    def subscribe(self, key: str, deliver: Callable[[str, bytes], None]) -> None:
        """Have messages whose key matches a pattern delivered: key and payload."""
        self._check_open("subscribe")
        self.subscriptions.append((key, deliver))

    def declare_token(self, key: str) -> None:
        """Show presence under a key until it is withdrawn, the channel closes or is killed."""
        self._check_open("declare a token")
        self.tokens.add(key)
        self._network.change_token(self.name, key, True)

    def withdraw_token(self, key: str) -> None:
        """End the presence under a key, if there is one."""
        if key in self.tokens:
            self.tokens.remove(key)
            self._network.change_token(self.name, key, False)

    def watch_tokens(self, key: str, deliver: Callable[[str, bool], None]) -> None:
        """Have the tokens that match a pattern delivered: key, and whether it appears or disappears."""
        self._check_open("watch tokens")
        self.watches.append((key, deliver))
        self._network.show_tokens_to(self, key, deliver)

    def serve(self, key: str, deliver: Callable[[Query], None]) -> None:
        """Have the questions to a key delivered."""
        self._check_open("serve")
        self.services.append((key, deliver))

    def ask(self, key: str, payload: bytes, timeout: float) -> bytes:
        """Ask whoever serves a key, and wait for the answer at most ``timeout`` [s]."""
        self._check_open("ask")
        _check_size(payload)
        deliver = self._network.server(self, key)
        if deliver is None:
            raise NoAnswer(key, f"nobody answers to {key}")
        query = LoopbackQuery(key, payload)
        deliver(query)
        return query.wait(timeout)

    def close(self) -> None:
        """Close the channel; a second call does nothing."""
        if not self.closed:
            self.closed = True
            self._network.forget(self)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _check_open(self, action: str) -> None:
        if self.closed:
            raise ChannelClosed(action)


class LoopbackQuery:
    """A question that arrived inside this process.

    Attributes:
        key: Where it is asked.
        payload: What is asked.
    """

    def __init__(self, key: str, payload: bytes) -> None:
        self.key = key
        self.payload = payload
        self._answer = b""
        self._answered = threading.Event()

    def reply(self, payload: bytes) -> None:
        """Answer the question."""
        _check_size(payload)
        self._answer = payload
        self._answered.set()

    def wait(self, timeout: float) -> bytes:
        """Return the answer, which comes from another thread or has come already."""
        if not self._answered.wait(timeout):
            raise NoAnswer(self.key, f"no answer to {self.key} within {timeout:g} s")
        return self._answer


def _call(deliver: Callable[..., None], *arguments: object) -> Callable[[], None]:
    return lambda: deliver(*arguments)


def _check_size(payload: bytes) -> None:
    if len(payload) > MAX_MESSAGE_BYTES:
        raise MessageTooLarge(len(payload), MAX_MESSAGE_BYTES)
