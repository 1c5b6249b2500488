"""Recordings read back: the frames of a file that ``tramnet record`` wrote, whole or cut off by a kill.

A recording is a file from anywhere, so its sizes are checked before anything is unpacked, and each message where it
is read. The file is read from front to back, as far as it goes: what a killed recorder left is a recording too.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import msgspec
import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, Footer, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk
from msgspec import Struct

from tramnet_master.errors import DamagedFile, InvalidFile
from tramnet_master.traffic.recorder import END, METADATA
from tramnet_protocol.errors import UnknownKey
from tramnet_protocol.keys import Topic, parse

MAX_RECORD_BYTES = 256 * 1024 * 1024
"""Largest record or chunk that is unpacked [B]; ours are a hundredth of that."""

_BAD_BYTES = (McapError, zstandard.ZstdError, struct.error, ValueError, KeyError, RuntimeError)


class RecordedWork(Struct, frozen=True, order=True):
    """Identity of a piece of work."""

    kind: str
    population: int
    step: int
    first: int
    last: int


class _RecordedMessage(Struct, frozen=True):
    work: RecordedWork | None = None
    seconds: float | None = None


class _Recorded(Struct, frozen=True, rename={"source": "from", "destination": "to"}):
    key: str
    bytes: int
    tag: str = ""
    source: int = -1
    destination: int = -1
    sequence: int = 0
    message: _RecordedMessage = _RecordedMessage()


class SeenFrame(Struct, frozen=True):
    """A frame on a link.

    Attributes:
        time: When it was seen [s since the first message of the recording].
        link: Sending and receiving TRAM of the link.
        source: TRAM that made it.
        destination: TRAM it is meant for.
        tag: Kind of its message.
        bytes: Length of its payload [B].
        sequence: Its number on the link.
        work: The work it asks for or answers, or None.
        seconds: Compute time that it tells [s], or None.
    """

    time: float
    link: tuple[int, int]
    source: int
    destination: int
    tag: str
    bytes: int
    sequence: int
    work: RecordedWork | None = None
    seconds: float | None = None


@dataclass
class Recording:
    """What a file holds.

    Attributes:
        path: The file.
        about: Facts about the network.
        end: What the recorder counted, where it could still say so.
        frames: Frames on links, in the order of arrival.
        others: Messages beside them: statistics, events and what was no frame.
        seconds: Time between the first message and the last [s].
        complete: Whether the recorder finished the file.
    """

    path: Path
    about: dict[str, str] = field(default_factory=dict)
    end: dict[str, str] = field(default_factory=dict)
    frames: list[SeenFrame] = field(default_factory=list)
    others: int = 0
    seconds: float = 0.0
    complete: bool = False


def read_recording(path: Path) -> Recording:
    """Read a recording.

    Raises:
        InvalidFile: It cannot be opened.
        DamagedFile: It is no recording, or a record of it cannot be what it says.
    """
    recording = Recording(path)
    try:
        with path.open("rb") as file:
            try:
                _read(file, recording)
            except _BAD_BYTES as error:
                if file.read(1):
                    expected = "a recording as `tramnet record` makes one"
                    raise DamagedFile(path, str(error), expected) from error
                # The file ends in the middle: its recorder was killed. What came before is whole.
    except OSError as error:
        found = (error.strerror or str(error)).lower()
        raise InvalidFile(path, "", found, "a file of `tramnet record`") from error
    return recording


def _read(file: BinaryIO, recording: Recording) -> None:
    channels: dict[int, Channel] = {}
    first: int | None = None
    for record in _records(file):
        match record:
            case Channel():
                channels[record.id] = record
            case Metadata() if record.name == METADATA:
                recording.about = record.metadata
            case Metadata() if record.name == END:
                recording.end = record.metadata
            case Message():
                first = record.log_time if first is None else first
                seconds = (record.log_time - first) / 1e9
                recording.seconds = max(recording.seconds, seconds)
                _take(recording, channels[record.channel_id], record, seconds)
            case Footer():
                recording.complete = True


def _records(file: BinaryIO) -> Iterator[McapRecord]:
    reader = StreamReader(file, emit_chunks=True, record_size_limit=MAX_RECORD_BYTES)
    for record in reader.records:
        if not isinstance(record, Chunk):
            yield record
            continue
        if record.uncompressed_size > MAX_RECORD_BYTES:
            raise ValueError(
                f"a chunk of {record.uncompressed_size} bytes, of which {MAX_RECORD_BYTES} are taken"
            )
        yield from breakup_chunk(record, validate_crc=True)


def _take(recording: Recording, channel: Channel, message: Message, seconds: float) -> None:
    link = _link_of(channel.metadata.get("key", ""))
    if link is None or channel.metadata.get("tag") == "malformed":
        recording.others += 1
        return
    found = msgspec.json.decode(message.data, type=_Recorded)
    recording.frames.append(
        SeenFrame(
            seconds, link, found.source, found.destination, found.tag, found.bytes,
            found.sequence, found.message.work, found.message.seconds,
        )
    )  # fmt: skip


def _link_of(key: str) -> tuple[int, int] | None:
    try:
        address = parse(key)
    except UnknownKey:
        return None
    if address.topic is not Topic.LINK:
        return None
    source, destination = address.seats
    return source, destination
