"""Everything that can go wrong in the protocol.

* ProtocolError
  + LocalProtocolError: this side asked for something it may not have
    - BadKey: a network name or seat from which no key can be built
    - BadArray: an array that may not travel
    - BadMessage: a message that MessagePack cannot hold
    - MessageTooLarge: a payload above the limit
    - BadTopology: a shape that is unknown or cannot join these TRAMs
    - BadLink: a link that no transputer has
    - BadEndpoint: an endpoint that cannot be listened on
      · AddressInUse: somebody listens there already
    - BadCredentials: certificates, a key or a list of seats that cannot be used
    - ChannelClosed: the channel was closed before
  + RemoteProtocolError: another side misbehaved, or is not there
    - MalformedFrame: bytes that are no frame of ours
      · UnsupportedVersion: a frame of another version of the protocol
    - UnknownKey: a key outside the scheme of ``keys.py``
    - CannotConnect: nobody listens at the endpoint, or refuses us
    - NoAnswer: a question that nobody answered in time

Each message says what was found, what was expected and, where there is one, what would work.
"""

from pathlib import Path


class ProtocolError(Exception):
    """Anything that went wrong in the protocol."""


class LocalProtocolError(ProtocolError):
    """This side asked for something it may not have."""


class RemoteProtocolError(ProtocolError):
    """Another side misbehaved, or is not there."""


class BadKey(LocalProtocolError):
    """A network name or a seat from which no key can be built."""


class BadArray(LocalProtocolError):
    """An array that may not travel."""


class BadMessage(LocalProtocolError):
    """A message that MessagePack cannot hold."""


class MessageTooLarge(LocalProtocolError):
    """A payload above the limit.

    Attributes:
        size: Its size [B].
        limit: The limit [B].
    """

    def __init__(self, size: int, limit: int) -> None:
        super().__init__(
            f"the message has {size} bytes, and at most {limit} may travel; send it in smaller chunks"
        )
        self.size = size
        self.limit = limit


class BadTopology(LocalProtocolError):
    """A shape that is unknown, or that cannot join these TRAMs."""


class BadLink(LocalProtocolError):
    """A link that no transputer has."""

    def __init__(self, mbaud: int, switches: int, speeds: tuple[int, ...]) -> None:
        known = ", ".join(map(str, speeds))
        super().__init__(
            f"found a link of {mbaud} Mbaud with {switches} switches; expected {known} Mbaud and 0 or more"
        )


class BadEndpoint(LocalProtocolError):
    """An endpoint that cannot be listened on.

    Attributes:
        endpoint: The endpoint.
    """

    def __init__(self, endpoint: str, message: str) -> None:
        super().__init__(message)
        self.endpoint = endpoint


class AddressInUse(BadEndpoint):
    """Somebody listens at this endpoint already."""

    def __init__(self, endpoint: str) -> None:
        super().__init__(
            endpoint,
            f"somebody listens at {endpoint} already; stop that process, or choose another "
            "address (port 0 takes a free one)",
        )


class BadCredentials(LocalProtocolError):
    """Certificates, a key or a list of seats that cannot be used.

    Attributes:
        path: The file or folder.
    """

    def __init__(self, path: Path, message: str) -> None:
        super().__init__(f"{path}: {message}; see docs/security.md")
        self.path = path


class ChannelClosed(LocalProtocolError):
    """The channel was closed before."""

    def __init__(self, action: str) -> None:
        super().__init__(f"cannot {action}: the channel is closed; open another one")


class MalformedFrame(RemoteProtocolError):
    """Bytes that are no frame of ours."""


class UnsupportedVersion(MalformedFrame):
    """A frame of another version of the protocol.

    Attributes:
        found: The frame's version.
        expected: Ours.
    """

    def __init__(self, found: int, expected: int) -> None:
        super().__init__(
            f"the frame has protocol version {found}, this node speaks {expected}; "
            "install the same tramnet on all nodes"
        )
        self.found = found
        self.expected = expected


class UnknownKey(RemoteProtocolError):
    """A key outside the scheme of ``keys.py``.

    Attributes:
        key: The key.
    """

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key


class CannotConnect(RemoteProtocolError):
    """Nobody listens at the endpoint, or refuses us.

    Attributes:
        endpoint: The endpoint.
    """

    def __init__(self, endpoint: str, message: str) -> None:
        super().__init__(message)
        self.endpoint = endpoint


class NoAnswer(RemoteProtocolError):
    """A question that nobody answered in time.

    Attributes:
        key: The key that was asked.
    """

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key
