"""Checkpoints: the state of a run as one checked file, of which the last two are kept.

A file is a head of fixed length and a body:

    bytes  0..7   ``TRAMCKPT``
    bytes  8..11  version of this format, unsigned, little-endian
    bytes 12..19  length of the body, unsigned, little-endian
    bytes 20..51  SHA-256 of bytes 0..19 and the body
    then          the body: MessagePack of the map {generation, state}

The state is a map of plain values (None, bool, int, float, str, bytes, lists and maps of these) and
arrays of numbers; an array is MessagePack's extension 1, itself the list [dtype, shape, bytes].
Nothing is ever unpickled. A damaged file is set aside with a message and the one before it is used.
"""

import hashlib
import logging
import re
import struct
from collections.abc import Callable, Mapping
from math import prod
from pathlib import Path
from typing import NamedTuple

import msgpack
import numpy as np
from numpy.typing import NDArray

from tramnet_master.errors import DamagedCheckpoint, UnknownCheckpointVersion
from tramnet_master.files import TEMPORARY_SUFFIX, write_atomically, writing

FORMAT_VERSION = 1
KEPT = 2

_MAGIC = b"TRAMCKPT"
_HEAD = struct.Struct("<8sIQ")
_DIGEST_SIZE = hashlib.sha256().digest_size
_ARRAY = 1
_NUMBERS = "biufc"  # kinds of array elements that are plain bytes: no objects
_NAME = re.compile(r"checkpoint-(\d{8,})\.tramnet")

_log = logging.getLogger(__name__)


class Checkpoint(NamedTuple):
    """State of a run at the end of a generation.

    Attributes:
        generation: Number of the last generation in it.
        state: Plain values and read-only arrays by name.
    """

    generation: int
    state: dict[str, object]


class CheckpointStore:
    """The checkpoints of one run folder.

    Attributes:
        folder: Where they lie.
        refused: What was wrong with each file that the last ``load_latest`` did not use.
    """

    def __init__(self, folder: Path, report: Callable[[str], None] = _log.warning) -> None:
        self.folder = folder
        self.refused: list[DamagedCheckpoint | UnknownCheckpointVersion] = []
        self._report = report

    def save(self, state: Mapping[str, object], generation: int) -> Path:
        """Write a checkpoint and drop all but it and the one before it.

        Args:
            state: Plain values and arrays of numbers by name.
            generation: Number of the generation just finished, >= 0.

        Returns:
            The file.

        Raises:
            CannotWrite: The disk refuses; the earlier checkpoints are untouched.
            TypeError: A value is neither plain nor an array of numbers.
        """
        path = self.folder / f"checkpoint-{generation:08d}.tramnet"
        write_atomically(path, encode_checkpoint(Checkpoint(generation, dict(state))))
        self._drop_all_but(generation)
        return path

    def load_latest(self) -> Checkpoint | None:
        """The newest checkpoint that is whole, or None where there is none.

        A damaged file is reported, renamed to ``*.damaged`` and passed over.
        """
        self.refused = []
        for generation in sorted(self.generations(), reverse=True):
            path = self.folder / f"checkpoint-{generation:08d}.tramnet"
            try:
                return decode_checkpoint(path.read_bytes(), path)
            except (DamagedCheckpoint, UnknownCheckpointVersion) as error:
                self._refuse(path, error)
        return None

    def generations(self) -> list[int]:
        """Generations of which there is a file, in no order."""
        names = (_NAME.fullmatch(path.name) for path in self.folder.glob("checkpoint-*"))
        return [int(name[1]) for name in names if name]

    def forget_after(self, generation: int) -> None:
        """Remove the checkpoints of later generations."""
        with writing(self.folder):
            for later in (g for g in self.generations() if g > generation):
                (self.folder / f"checkpoint-{later:08d}.tramnet").unlink(missing_ok=True)

    def clear(self) -> None:
        """Remove every checkpoint, damaged and half-written ones too."""
        with writing(self.folder):
            for path in self.folder.glob("checkpoint-*.tramnet*"):
                path.unlink(missing_ok=True)

    def _refuse(self, path: Path, error: DamagedCheckpoint | UnknownCheckpointVersion) -> None:
        self.refused.append(error)
        self._report(f"{error}; the checkpoint before it is used")
        if isinstance(error, DamagedCheckpoint):
            with writing(path):
                path.rename(path.with_name(path.name + ".damaged"))

    def _drop_all_but(self, generation: int) -> None:
        # Files of later generations belong to a future that this save has just overtaken.
        earlier = sorted(g for g in self.generations() if g <= generation)
        kept = {f"checkpoint-{g:08d}.tramnet" for g in earlier[-KEPT:]}
        with writing(self.folder):
            for path in self.folder.glob("checkpoint-*.tramnet"):
                if path.name not in kept:
                    path.unlink(missing_ok=True)
            for path in self.folder.glob(f"checkpoint-*{TEMPORARY_SUFFIX}"):
                path.unlink(missing_ok=True)


def encode_checkpoint(checkpoint: Checkpoint) -> bytes:
    """The bytes of a checkpoint's file; equal checkpoints have equal bytes."""
    document = {"generation": checkpoint.generation, "state": _plain(checkpoint.state)}
    body: bytes = msgpack.packb(document, strict_types=True)
    head = _HEAD.pack(_MAGIC, FORMAT_VERSION, len(body))
    return head + hashlib.sha256(head + body).digest() + body


def decode_checkpoint(content: bytes, path: Path) -> Checkpoint:
    """The checkpoint in ``content``.

    Args:
        content: All bytes of the file.
        path: Its name, for messages.

    Raises:
        DamagedCheckpoint: It is truncated or altered.
        UnknownCheckpointVersion: It is whole, but of another format.
    """
    body_start = _HEAD.size + _DIGEST_SIZE
    if len(content) < body_start:
        raise DamagedCheckpoint(path, f"{len(content)} bytes", f"at least {body_start}")
    magic, version, length = _HEAD.unpack_from(content)
    if magic != _MAGIC:
        raise DamagedCheckpoint(path, f"{magic!r} at its head", f"{_MAGIC!r}")
    digest, body = content[_HEAD.size : body_start], memoryview(content)[body_start:]
    if len(body) != length:
        raise DamagedCheckpoint(path, f"a body of {len(body)} bytes", f"{length}")
    found = hashlib.sha256(content[: _HEAD.size])
    found.update(body)
    if found.digest() != digest:
        raise DamagedCheckpoint(
            path, f"SHA-256 {found.hexdigest()[:16]}..", f"{digest.hex()[:16]}.."
        )
    if version != FORMAT_VERSION:
        raise UnknownCheckpointVersion(path, version, FORMAT_VERSION)
    return _unpack(body, path)


def _unpack(body: memoryview, path: Path) -> Checkpoint:
    try:
        document = msgpack.unpackb(body, ext_hook=_array_of)
        generation, state = document["generation"], document["state"]
    except (ValueError, KeyError, TypeError, msgpack.UnpackException) as error:
        raise DamagedCheckpoint(
            path, f"a body that says {error!r}", "generation and state"
        ) from error
    return Checkpoint(generation, state)


def _plain(value: object) -> object:
    """``value`` as msgpack packs it, arrays as extensions, maps with their keys in order."""
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value):
            raise TypeError(f"a checkpoint's maps are keyed by strings: found {list(value)[:5]!r}")
        return {key: _plain(value[key]) for key in sorted(value)}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return _extension_of(value)
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, bool | int | float | str | bytes):
        return value
    raise TypeError(f"a checkpoint holds plain values and arrays: found {type(value).__name__}")


def _extension_of(array: NDArray[np.generic]) -> msgpack.ExtType:
    if array.dtype.kind not in _NUMBERS:
        raise TypeError(f"a checkpoint's arrays hold numbers: found elements of type {array.dtype}")
    little = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
    content = [little.dtype.str, list(array.shape), little.tobytes()]
    return msgpack.ExtType(_ARRAY, msgpack.packb(content))


def _array_of(code: int, content: bytes) -> NDArray[np.generic]:
    if code != _ARRAY:
        raise ValueError(f"extension {code}")
    name, shape, elements = msgpack.unpackb(content)
    dtype = np.dtype(name)
    if dtype.kind not in _NUMBERS or len(elements) != dtype.itemsize * prod(shape):
        raise ValueError(f"array of type {name}, shape {shape} and {len(elements)} bytes")
    return np.frombuffer(elements, dtype=dtype).reshape(shape)
