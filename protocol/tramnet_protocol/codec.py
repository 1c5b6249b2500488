"""Frames: a message with the header that says what it is, from whom, to whom and on which wiring.

A frame is one MessagePack list of ten,

    [version, run, epoch, source, source incarnation, destination, destination incarnation, sequence, tag, body]

whose body is a binary string, itself a MessagePack map of the message's fields: a router reads the header and
passes the body on without looking inside. ``protocol/README.md`` is the normative description.

Rules of this file: whatever the bytes, ``decode`` and ``Frame.message`` raise nothing but ``MalformedFrame`` (or
``UnsupportedVersion``, its kin); nothing is executed; nothing is allocated beyond the declared limits.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, TypeVar

import msgspec
import numpy as np
from msgspec import Meta, Struct

from tramnet_protocol.errors import BadMessage, MalformedFrame, UnsupportedVersion
from tramnet_protocol.messages import (
    NOBODY,
    PROTOCOL_VERSION,
    ControlReply,
    ControlRequest,
    Count,
    Evaluate,
    Evaluated,
    Event,
    Evolve,
    Failed,
    JoinReply,
    JoinRequest,
    Message,
    PopulationMeans,
    PopulationSnapshot,
    Refusal,
    Seat,
    Setup,
    Stats,
    Stop,
    Track,
    Tracked,
    Wiring,
    Word,
)
from tramnet_protocol.packing import pack, unpack

FRAME_LENGTH = 10
"""Entries of a frame: nine of the header, and the body."""

MESSAGES: Mapping[str, type[Message]] = MappingProxyType(
    {
        "evaluate": Evaluate,
        "evolve": Evolve,
        "track": Track,
        "evaluated": Evaluated,
        "population-means": PopulationMeans,
        "population-snapshot": PopulationSnapshot,
        "tracked": Tracked,
        "failed": Failed,
        "setup": Setup,
        "stop": Stop,
        "stats": Stats,
        "event": Event,
        "wiring": Wiring,
        "join": JoinRequest,
        "joined": JoinReply,
        "refusal": Refusal,
        "control": ControlRequest,
        "controlled": ControlReply,
    }
)
"""The messages by their tags."""

_TAGS = MappingProxyType({kind: tag for tag, kind in MESSAGES.items()})
_Value = TypeVar("_Value")


class Header(Struct, frozen=True, array_like=True, kw_only=True, forbid_unknown_fields=True):
    """What stands before the body of a frame, in the order of the wire.

    Attributes:
        version: Version of the protocol.
        run: Number of the run; frames of other runs are dropped.
        epoch: Wiring that routes this frame; it selects routes, never validity.
        source: TRAM that made the frame.
        source_incarnation: Its incarnation.
        destination: TRAM it is meant for, or ``NOBODY`` in particular.
        destination_incarnation: Its incarnation.
        sequence: Number of the frame on its directed link, from 0.
        tag: Name of the message; ``encode`` writes the message's own.
    """

    version: Count = PROTOCOL_VERSION
    run: Word = 0
    epoch: Count = 0
    source: Seat = NOBODY
    source_incarnation: Count = 0
    destination: Seat = NOBODY
    destination_incarnation: Count = 0
    sequence: Word = 0
    tag: Annotated[str, Meta(max_length=32)] = ""


class Frame(Struct, frozen=True):
    """A frame as it arrived, its body still packed.

    Attributes:
        header: Its header, checked.
        body: The message's fields in MessagePack.
    """

    header: Header
    body: bytes

    def message(self) -> Message:
        """Return the message in the body.

        Raises:
            MalformedFrame: The tag is unknown, or the body does not hold such a message.
        """
        kind = MESSAGES.get(self.header.tag)
        if kind is None:
            raise MalformedFrame(
                f"a frame with tag {self.header.tag!r} arrived; known are {', '.join(MESSAGES)}"
            )
        fields = unpack(self.body)
        if not isinstance(fields, dict):
            raise MalformedFrame(f"the body of {self.header.tag!r} is no map of fields")
        return _convert(fields, kind)


def tag_of(message: Message) -> str:
    """Return the name under which a message travels."""
    return _TAGS[type(message)]


def encode(header: Header, message: Message) -> bytes:
    """Return the frame of a message, under the message's own tag.

    Raises:
        MessageTooLarge: The frame is above the limit.
        BadMessage: A field holds something that may not travel.
    """
    return _frame(header, tag_of(message), encode_body(message))


def encode_body(message: Message) -> bytes:
    """Return the packed fields of a message, to be framed once or many times.

    Raises:
        MessageTooLarge: The body is above the limit.
        BadMessage: A field holds something that may not travel.
    """
    return pack(_plain(message))


def encode_raw(header: Header, body: bytes) -> bytes:
    """Return the frame of a packed body, under the header's tag.

    Raises:
        MessageTooLarge: The frame is above the limit.
    """
    return _frame(header, header.tag, body)


def decode(payload: bytes) -> Frame:
    """Return the frame in a payload, its header checked and its body still packed.

    Raises:
        MalformedFrame: The payload is no frame.
        UnsupportedVersion: It is a frame of another version.
    """
    fields = unpack(payload)
    if not isinstance(fields, list) or not fields or type(fields[0]) is not int:
        raise MalformedFrame("no list that begins with a version arrived")
    if fields[0] != PROTOCOL_VERSION:
        raise UnsupportedVersion(fields[0], PROTOCOL_VERSION)
    if len(fields) != FRAME_LENGTH:
        raise MalformedFrame(f"a list of {len(fields)} arrived; expected a frame of {FRAME_LENGTH}")
    body = fields.pop()
    if not isinstance(body, bytes):
        raise MalformedFrame(f"the last entry of a frame is {type(body).__name__}; expected bytes")
    return Frame(_convert(fields, Header), body)


def readdress(payload: bytes, sequence: int) -> bytes:
    """Return the same frame for the next link of its route, the body untouched.

    Args:
        payload: A frame.
        sequence: Its number on that link.

    Raises:
        MalformedFrame: The payload is no frame.
    """
    frame = decode(payload)
    return encode_raw(msgspec.structs.replace(frame.header, sequence=sequence), frame.body)


def _frame(header: Header, tag: str, body: bytes) -> bytes:
    return pack((*msgspec.structs.astuple(header)[:-1], tag, body))


def _plain(message: Message) -> object:
    try:
        return msgspec.to_builtins(message, builtin_types=(bytes,), enc_hook=_plain_scalar)
    except (TypeError, RecursionError) as error:
        raise BadMessage(
            f"cannot encode {type(message).__name__}: {error}; only numbers, strings, bytes, "
            "lists and maps may travel"
        ) from error


def _plain_scalar(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"found a {type(value).__name__}")


def _convert(fields: object, kind: type[_Value]) -> _Value:
    try:
        return msgspec.convert(fields, kind, strict=True, builtin_types=(bytes,))
    except (msgspec.ValidationError, RecursionError) as error:
        raise MalformedFrame(f"a bad {kind.__name__} arrived: {error}") from error
