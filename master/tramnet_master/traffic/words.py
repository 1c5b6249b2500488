"""Frames in plain values: what ``echo`` prints and ``record`` writes of each, whatever its bytes are.

A frame becomes a map of its header and its message, in which identities and links have names and every array
becomes what an ``ArrayWords`` makes of it. What is no frame becomes a map with ``malformed``, the reason, and its
first bytes: nothing that arrives stops a tool that only looks.
"""

import base64
import enum
import math
import re
from collections.abc import Callable
from typing import Any, TypeAlias

import msgspec
import numpy as np
from msgspec import Struct

from tramnet_protocol.arrays import Array
from tramnet_protocol.codec import Frame, decode
from tramnet_protocol.errors import MalformedFrame

ArrayWords: TypeAlias = Callable[[Array], dict[str, object]]

HEAD_BYTES = 32
"""What is shown of a payload that is no frame [B]."""

_CONTROL = re.compile("[\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069]")


def describe(key: str, payload: bytes, arrays: ArrayWords) -> tuple[Frame | None, dict[str, Any]]:
    """Return the frame in a payload, if there is one, and its plain values.

    Args:
        key: Where it was said.
        payload: What was said.
        arrays: What becomes of an array.
    """
    try:
        frame = decode(payload)
        message = plain(frame.message(), arrays)
    except MalformedFrame as error:
        return None, _malformed(key, payload, str(error))
    except RecursionError:
        return None, _malformed(key, payload, "its values are nested too deeply to be shown")
    header = frame.header
    return frame, {
        "key": key,
        "bytes": len(payload),
        "tag": header.tag,
        "from": header.source,
        "to": header.destination,
        "from_incarnation": header.source_incarnation,
        "to_incarnation": header.destination_incarnation,
        "run": header.run,
        "epoch": header.epoch,
        "sequence": header.sequence,
        "message": message,
    }


def shortened(elements: int) -> ArrayWords:
    """Return words for arrays with at most so many of their elements."""

    def words(array: Array) -> dict[str, object]:
        try:
            first = array.unpack().reshape(-1)[:elements].tolist()
        except MalformedFrame as error:
            return {"dtype": array.dtype, "shape": list(array.shape), "malformed": str(error)}
        shown = [plain(value, words) for value in first]
        return {"dtype": array.dtype, "shape": list(array.shape), "first": shown}

    return words


def summarised(array: Array) -> dict[str, object]:
    """Return type, shape and the range of the finite elements of an array."""
    words: dict[str, object] = {"dtype": array.dtype, "shape": list(array.shape)}
    try:
        values = array.unpack()
    except MalformedFrame as error:
        return {**words, "malformed": str(error)}
    finite = values[np.isfinite(values)]
    if finite.size:
        words |= {"minimum": finite.min().item(), "maximum": finite.max().item()}
    return words


def complete(array: Array) -> dict[str, object]:
    """Return the summary of an array and all of its bytes in base64."""
    return {**summarised(array), "data": base64.b64encode(array.data).decode("ascii")}


def plain(value: object, arrays: ArrayWords) -> object:
    """Return a message, or anything in one, in numbers, strings, lists and maps; what is None is left out."""
    match value:
        case Array():
            return arrays(value)
        case Struct():
            return _fields(value, arrays)
        case dict():
            return {str(name): plain(inner, arrays) for name, inner in value.items()}
        case list() | tuple():
            return [plain(inner, arrays) for inner in value]
    return _scalar(value)


def json_line(value: object) -> str:
    """Return plain values as one line of JSON in which nothing steers a terminal."""
    line = msgspec.json.encode(value).decode()
    return _CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", line)


def printable(text: str) -> str:
    """Return text from elsewhere without what would steer a terminal."""
    return "".join(letter if letter.isprintable() else "�" for letter in text)


def _fields(value: Struct, arrays: ArrayWords) -> dict[str, object]:
    named = {name: getattr(value, name) for name in value.__struct_fields__}
    return {
        name: _links(inner) if name == "edges" else plain(inner, arrays)
        for name, inner in named.items()
        if inner is not None
    }


def _scalar(value: object) -> object:
    if isinstance(value, enum.Enum):
        return value.name.lower()
    if isinstance(value, bytes):
        return base64.b64encode(value).decode("ascii")
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)  # JSON has no word for it
    return value


def _links(edges: object) -> object:
    assert isinstance(edges, tuple), "the edges of a wiring are a tuple of pairs"
    return [{"from": a, "to": b} for a, b in edges]


def _malformed(key: str, payload: bytes, reason: str) -> dict[str, Any]:
    head = payload[:HEAD_BYTES].hex(" ")
    return {"key": key, "bytes": len(payload), "malformed": reason, "head": head}
