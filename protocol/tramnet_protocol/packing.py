"""MessagePack with limits: plain values to bytes and back, whatever the bytes are.

The lengths a hostile payload declares are checked before anything is allocated for them, extension types are
refused, and every failure is a ``MalformedFrame``. Lists come back as lists.
"""

from typing import NoReturn

import msgpack

from tramnet_protocol.errors import BadMessage, MalformedFrame, MessageTooLarge
from tramnet_protocol.limits import MAX_ITEMS, MAX_MESSAGE_BYTES, MAX_STRUCTURE_BYTES

_LEVELS = 3
"""Levels of nesting at which binary strings may lie: a message's map, and its arrays' maps."""


def pack(value: object) -> bytes:
    """Return the MessagePack of a plain value.

    Raises:
        BadMessage: Something in it is no number, string, binary string, list or map.
        MessageTooLarge: The result is above the limit.
    """
    try:
        packed: bytes = msgpack.packb(value, use_bin_type=True)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise BadMessage(
            f"cannot pack the message: {error}; only numbers, strings, bytes, lists and maps may travel"
        ) from error
    if len(packed) > MAX_MESSAGE_BYTES:
        raise MessageTooLarge(len(packed), MAX_MESSAGE_BYTES)
    return packed


def unpack(packed: bytes) -> object:
    """Return the plain value in some MessagePack.

    Raises:
        MalformedFrame: It is no MessagePack, or it is above a limit.
    """
    if len(packed) > MAX_MESSAGE_BYTES:
        raise MalformedFrame(f"{len(packed)} bytes arrived; expected at most {MAX_MESSAGE_BYTES}")
    try:
        if len(packed) > MAX_STRUCTURE_BYTES:
            _check_structure(packed)
        return msgpack.unpackb(
            packed,
            raw=False,
            use_list=True,
            strict_map_key=False,
            max_array_len=MAX_ITEMS,
            max_map_len=MAX_ITEMS,
            max_ext_len=0,
            ext_hook=_refuse_extension,
        )
    except (ValueError, TypeError, OverflowError, RecursionError, msgpack.UnpackException) as error:
        raise MalformedFrame(f"no MessagePack within the limits arrived: {error}") from error


def _refuse_extension(code: int, _: bytes) -> NoReturn:
    raise ValueError(f"extension type {code} is not allowed")


def _check_structure(packed: bytes) -> None:
    """Refuse bytes of which more than ``MAX_STRUCTURE_BYTES`` lie outside binary strings."""
    unpacker = msgpack.Unpacker(max_buffer_size=MAX_MESSAGE_BYTES)
    unpacker.feed(packed)
    binary = _binary_bytes(unpacker, packed, _LEVELS)
    if len(packed) - binary > MAX_STRUCTURE_BYTES:
        raise ValueError(
            f"{len(packed) - binary} bytes outside binary strings; expected at most {MAX_STRUCTURE_BYTES}"
        )


def _binary_bytes(unpacker: msgpack.Unpacker, packed: bytes, levels: int) -> int:
    """Pass over one value without making objects of it, and count its bytes in binary strings [B]."""
    start = unpacker.tell()
    first = packed[start] if start < len(packed) else 0
    if levels and (0x80 <= first <= 0x9F or 0xDC <= first <= 0xDF):
        return sum(
            _binary_bytes(unpacker, packed, levels - 1)
            for _ in range(_read_length(unpacker, first))
        )
    unpacker.skip()
    return unpacker.tell() - start if 0xC4 <= first <= 0xC6 else 0


def _read_length(unpacker: msgpack.Unpacker, first: int) -> int:
    """Enter a list or map and return how many values it holds, keys included."""
    is_map = 0x80 <= first <= 0x8F or first >= 0xDE
    length = 2 * unpacker.read_map_header() if is_map else unpacker.read_array_header()
    if length > 2 * MAX_ITEMS:
        raise ValueError(f"{length} entries; expected at most {MAX_ITEMS}")
    return int(length)
