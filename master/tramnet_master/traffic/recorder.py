"""Frames into an MCAP file, as JSON with the schemas of the messages, so that standard tools open it.

A topic is a key and the kind of message on it (``/link/0/1/evaluate``), for a topic of MCAP has one schema. Time is
the time of arrival at the recorder; frames carry none of their own.

``flush`` ends a chunk: what was recorded until then can be read back even if this process is killed later. The
file then lacks its index and what came since: ``mcap recover``, readers that stream, and ``tramnet traffic`` read
it. ``finish`` writes the index.
"""

from collections.abc import Mapping
from importlib.metadata import version
from typing import IO, Any

import msgspec

from tramnet_master.traffic.intake import Arrival
from tramnet_master.traffic.schemas import MALFORMED, Schema, schema_of
from tramnet_master.traffic.words import ArrayWords, describe
from tramnet_protocol.codec import Frame
from tramnet_protocol.errors import UnknownKey
from tramnet_protocol.keys import Topic, parse
from tramnet_protocol.sequences import SequenceChecker

METADATA = "tramnet"
END = "tramnet end"
CHUNK_BYTES = 1024 * 1024
MAX_CHANNELS = 60_000
"""Channels of a file: MCAP has numbers for 65,535."""

_UNKNOWN = "/malformed"
_USUAL = {Topic.STATS: "stats", Topic.EVENTS: "event", Topic.WIRING: "wiring"}


class Recorder:
    """Writes what arrives into an open file.

    Args:
        file: The file.
        about: Facts about the network, kept in the file.
        arrays: What to write of an array.

    Attributes:
        frames: Frames written, and what was none.
        missed: Frames that links carried and that never arrived here.
        dropped: Arrivals for whose topic the file has no number left.
    """

    def __init__(self, file: IO[bytes], about: Mapping[str, str], arrays: ArrayWords) -> None:
        from mcap.writer import Writer  # noqa: PLC0415  slow to import, and only recorders need it

        self.frames = self.missed = self.dropped = 0
        self._arrays = arrays
        self._schemas: dict[str, int] = {}
        self._channels: dict[tuple[str, str], int] = {}
        self._checkers: dict[str, SequenceChecker] = {}
        self._writer = Writer(file, chunk_size=CHUNK_BYTES)
        self._writer.start(library=f"tramnet {version('tramnet')}, mcap {version('mcap')}")
        self._writer.add_metadata(METADATA, dict(about))

    def record(self, arrival: Arrival) -> None:
        """Write a frame, or what is none."""
        frame, values = describe(arrival.key, arrival.payload, self._arrays)
        tag = frame.header.tag if frame is not None else "malformed"
        channel = self._channel(arrival.key, tag)
        if channel is None:
            self.dropped += 1
            return
        self.frames += 1
        self._writer.add_message(
            channel_id=channel,
            log_time=arrival.time,
            publish_time=arrival.time,
            data=msgspec.json.encode(values),
            sequence=self._sequence(arrival.key, frame) % 2**32,
        )

    def flush(self) -> None:
        """Write out what was recorded so far."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def finish(self) -> None:
        """Write the index; the file is complete then."""
        end = {"frames": self.frames, "missed": self.missed, "dropped": self.dropped}
        self.flush()  # metadata stands between chunks
        self._writer.add_metadata(END, {name: str(n) for name, n in end.items()})
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _sequence(self, key: str, frame: Frame | None) -> int:
        if frame is None:
            return 0
        if "/link/" in key:
            checker = self._checkers.setdefault(key, SequenceChecker(from_start=False))
            self.missed += checker.arrived(frame.header.sequence).missed
        return frame.header.sequence

    def _channel(self, key: str, tag: str) -> int | None:
        known = self._channels.get((key, tag))
        if known is None and len(self._channels) < MAX_CHANNELS:
            known = self._channels[key, tag] = self._writer.register_channel(
                topic=topic_of(key, tag),
                message_encoding="json",
                schema_id=self._schema(tag),
                metadata={"key": key, "tag": tag},
            )
        return known

    def _schema(self, tag: str) -> int:
        if tag not in self._schemas:
            schema: Schema = MALFORMED if tag == "malformed" else schema_of(tag)
            self._schemas[tag] = self._writer.register_schema(
                name=schema["title"], encoding="jsonschema", data=msgspec.json.encode(schema)
            )
        return self._schemas[tag]


def topic_of(key: str, tag: str) -> str:
    """Return the topic in a recording of messages of one kind on one key."""
    try:
        address = parse(key)
    except UnknownKey:
        return _UNKNOWN
    words: list[Any] = [address.topic.value, *address.seats]
    if tag != _USUAL.get(address.topic):
        words.append(tag)
    return "/" + "/".join(map(str, words))
