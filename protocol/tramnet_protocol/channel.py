"""What a node needs of a transport, whatever carries the bytes: Zenoh or, in tests, this process's memory.

Rules for everybody: a ``deliver`` function runs on a thread of the transport and does no more than take in what
came; it never blocks, computes or calls the channel. ``publish`` reports no loss: work identities, tokens and
deadlines do.
"""

import enum
from collections.abc import Callable
from types import TracebackType
from typing import Protocol, Self


class Lane(enum.Enum):
    """How a message travels.

    Attributes:
        LINK: Frames between TRAMs: the publisher waits for the link, at most ``WAIT_BEFORE_CLOSE_SECONDS``.
        CONTROL: As ``LINK``, overtaking everything else.
        TELEMETRY: Behind everything else, and dropped rather than waited for.
    """

    LINK = "link"
    CONTROL = "control"
    TELEMETRY = "telemetry"


class Query(Protocol):
    """A question that arrived, answered once or not at all; whoever asked learns it either way."""

    @property
    def key(self) -> str:
        """Where it is asked."""

    @property
    def payload(self) -> bytes:
        """What is asked."""

    def reply(self, payload: bytes) -> None:
        """Answer the question.

        Raises:
            MessageTooLarge: The answer is above the limit.
        """


class Publisher(Protocol):
    """What sends."""

    def publish(self, key: str, payload: bytes, lane: Lane) -> None:
        """Send a message to whoever subscribes to a key, if anybody does.

        Raises:
            MessageTooLarge: The payload is above the limit.
            ChannelClosed: The channel was closed.
        """


class Channel(Publisher, Protocol):
    """One node's connection to its network."""

    def subscribe(self, key: str, deliver: Callable[[str, bytes], None]) -> None:
        """Have messages whose key matches a pattern delivered: key and payload."""

    def declare_token(self, key: str) -> None:
        """Show presence under a key until it is withdrawn, the channel closes or the process ends."""

    def withdraw_token(self, key: str) -> None:
        """End the presence under a key."""

    def watch_tokens(self, key: str, deliver: Callable[[str, bool], None]) -> None:
        """Have the tokens that match a pattern delivered: key, and whether it appears or disappears.

        Tokens that are there already are delivered as appearing.
        """

    def serve(self, key: str, deliver: Callable[[Query], None]) -> None:
        """Have the questions to a key delivered."""

    def ask(self, key: str, payload: bytes, timeout: float) -> bytes:
        """Ask whoever serves a key, and wait for the answer.

        Args:
            key: The key.
            payload: The question.
            timeout: Longest wait [s].

        Raises:
            NoAnswer: Nobody serves the key, the one who does ended, or the time is over.
            MessageTooLarge: The question is above the limit.
            ChannelClosed: The channel was closed.
        """

    def close(self) -> None:
        """Close the channel; a second call does nothing."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...
