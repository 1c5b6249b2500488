"""Frames in words: what ``tramnet echo`` prints of each, arrays cut short."""

import msgspec
from msgspec import Struct

from tramnet_protocol.arrays import Array
from tramnet_protocol.codec import Frame, decode
from tramnet_protocol.errors import MalformedFrame, ProtocolError
from tramnet_protocol.keys import PREFIX, Topic, parse
from tramnet_protocol.messages import Message
from tramnet_protocol.sequences import SequenceChecker

SHOWN = 6
"""Elements of an array that are shown."""


def full_pattern(network: str, key: str) -> str:
    """Return the key pattern that a user means by a short one, such as ``link/**``."""
    return key if key.startswith(f"{PREFIX}/") else f"{PREFIX}/{network}/{key.strip('/')}"


class Echo:
    """Turns payloads into plain values, and counts what an observer has missed.

    Attributes:
        missed: Frames that links carried and this observer did not see.
    """

    def __init__(self) -> None:
        self.missed = 0
        self._checkers: dict[str, SequenceChecker] = {}

    def describe(self, key: str, payload: bytes) -> dict[str, object]:
        """Return a frame as plain values; what is no frame is described as such."""
        try:
            frame = decode(payload)
            message: object = _plain(frame.message())
        except MalformedFrame as error:
            return {"key": key, "bytes": len(payload), "malformed": str(error)}
        self._watch(key, frame)
        header = frame.header
        return {
            "key": key,
            "bytes": len(payload),
            "tag": header.tag,
            "from": header.source,
            "to": header.destination,
            "epoch": header.epoch,
            "sequence": header.sequence,
            "message": message,
        }

    def _watch(self, key: str, frame: Frame) -> None:
        try:
            if parse(key).topic is not Topic.LINK:
                return
        except ProtocolError:
            return
        checker = self._checkers.setdefault(key, SequenceChecker(from_start=False))
        self.missed += checker.arrived(frame.header.sequence).missed


def _plain(value: Message | object) -> object:
    if isinstance(value, Array):
        return _short(value)
    if isinstance(value, Struct):
        if value.__struct_config__.array_like:
            return msgspec.to_builtins(value)
        return {name: _plain(getattr(value, name)) for name in value.__struct_fields__}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def _short(array: Array) -> dict[str, object]:
    try:
        first = array.unpack().reshape(-1)[:SHOWN].tolist()
    except ProtocolError as error:
        first = str(error)
    return {"dtype": array.dtype, "shape": list(array.shape), "first": first}
