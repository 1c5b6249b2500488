"""MessagePack with limits: plain values to bytes and back, whatever the bytes are.

The lengths a hostile payload declares are checked before anything is allocated for them, extension types are
refused, and every failure is a ``MalformedFrame``. Lists come back as lists.
"""

import threading
from typing import NoReturn

import msgpack

from tramnet_protocol.errors import BadMessage, MalformedFrame, MessageTooLarge
from tramnet_protocol.limits import MAX_ITEMS, MAX_MESSAGE_BYTES, MAX_STRUCTURE_BYTES

_FIRST_VALUES = 64
"""Values, lists and maps included, among which the binary strings of a large payload lie; no message has more."""

_BAD_BYTES = (
    ValueError,
    TypeError,  # a list or map as a key
    IndexError,
    OverflowError,
    RecursionError,
    msgpack.UnpackException,
)


class _Packer(threading.local):
    """A packer for each thread: making one costs as much as packing a small message."""

    def __init__(self) -> None:
        self.pack = msgpack.Packer(use_bin_type=True).pack


_PACKER = _Packer()


def pack(value: object) -> bytes:
    """Return the MessagePack of a plain value.

    Raises:
        BadMessage: Something in it is no number, string, binary string, list or map.
        MessageTooLarge: The result is above the limit.
    """
    try:
        packed: bytes = _PACKER.pack(value)
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
    except _BAD_BYTES as error:
        raise MalformedFrame(f"no MessagePack within the limits arrived: {error}") from error


def _refuse_extension(code: int, _: bytes) -> NoReturn:
    raise ValueError(f"extension type {code} is not allowed")


def _check_structure(packed: bytes) -> None:
    """Refuse bytes of which more than ``MAX_STRUCTURE_BYTES`` lie outside binary strings."""
    structure = len(packed) - _binary_bytes(packed)
    if structure > MAX_STRUCTURE_BYTES:
        raise ValueError(
            f"{structure} bytes outside binary strings; expected at most {MAX_STRUCTURE_BYTES}"
        )


def _binary_bytes(packed: bytes) -> int:
    """Count the bytes in binary strings among the first values [B], making no objects of any."""
    unpacker = msgpack.Unpacker(max_buffer_size=MAX_MESSAGE_BYTES)
    unpacker.feed(packed)
    expected, binary = 1, 0
    for _ in range(_FIRST_VALUES):
        if not expected:
            break
        expected -= 1
        start = unpacker.tell()
        first = packed[start]
        if 0x80 <= first <= 0x8F or 0xDE <= first <= 0xDF:
            expected += 2 * unpacker.read_map_header()
        elif 0x90 <= first <= 0x9F or 0xDC <= first <= 0xDD:
            expected += unpacker.read_array_header()
        else:
            unpacker.skip()
            binary += unpacker.tell() - start if 0xC4 <= first <= 0xC6 else 0
    return binary
