import io
import json

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from tramnet_master.errors import DamagedFile, InvalidFile
from tramnet_master.traffic import recorder as recorder_module
from tramnet_master.traffic.intake import Arrival, Intake
from tramnet_master.traffic.recorder import Recorder, topic_of
from tramnet_master.traffic.recording import read_recording
from tramnet_master.traffic.schemas import MALFORMED, schema_of
from tramnet_master.traffic.words import complete, summarised
from tramnet_protocol.arrays import Array
from tramnet_protocol.codec import MESSAGES, Header, encode
from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import Evaluate, Evaluated, Kind, Stop, WorkId

KEYS = Keys("net")
ABOUT = {"network": "net", "title": "sphere", "topology": "star"}
SECOND = 10**9

JSON_TYPES = {
    "object": dict, "array": list, "string": str, "boolean": bool, "integer": int,
    "number": (int, float),
}  # fmt: skip


def fits(value, schema):
    """Whether a value is what a schema of the kind we write says."""
    if not isinstance(value, JSON_TYPES[schema["type"]]):
        return False
    if schema["type"] == "array":
        return all(fits(item, schema["items"]) for item in value)
    if schema["type"] == "object":
        known = schema["properties"]
        return set(schema.get("required", ())) <= set(value) and all(
            fits(value[name], known[name]) for name in known if name in value
        )
    return True


def stop(sequence):
    return encode(Header(source=0, destination=1, sequence=sequence), Stop("x"))


def record(path, arrivals, finish=True, arrays=complete):
    with path.open("wb") as file:
        recorder = Recorder(file, ABOUT, arrays)
        for arrival in arrivals:
            recorder.record(arrival)
        if finish:
            recorder.finish()
        else:
            recorder.flush()
    return recorder


def everything(golden):
    return [
        *(Arrival(KEYS.link(0, 1), payload, SECOND) for payload in golden.values()),
        Arrival(KEYS.stats(1), golden["stats"], 2 * SECOND),
        Arrival(KEYS.events, golden["event"], 2 * SECOND),
        Arrival(KEYS.link(1, 0), b"\xc1 rubbish", 3 * SECOND),
        Arrival("nothing/of/ours", b"\xc1 rubbish", 3 * SECOND),
    ]


def test_a_recording_opens_in_mcap_s_own_reader_with_summary_and_index(tmp_path, golden):
    arrivals = everything(golden)
    record(tmp_path / "a.mcap", arrivals)

    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        found = [(channel.topic, message) for _, channel, message in reader.iter_messages()]
        (about, end) = reader.iter_metadata()

    assert summary.statistics.message_count == len(found) == len(arrivals)
    assert summary.chunk_indexes
    assert all(index.message_index_offsets for index in summary.chunk_indexes)
    assert about.metadata == ABOUT
    assert end.metadata == {"frames": str(len(arrivals)), "missed": "0", "dropped": "0"}
    assert [message.log_time for _, message in found] == [arrival.time for arrival in arrivals]
    topics = {topic for topic, _ in found}
    assert topics >= {"/link/0/1/evaluate", "/stats/1", "/events", "/link/1/0/malformed"}


def test_every_message_is_what_its_schema_says(tmp_path, golden):
    record(tmp_path / "a.mcap", everything(golden))

    with (tmp_path / "a.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            assert fits(json.loads(message.data), json.loads(schema.data)), channel.topic


@pytest.mark.parametrize("schema", [MALFORMED, *map(schema_of, MESSAGES)], ids=lambda s: s["title"])
def test_schemas_say_no_more_than_viewers_read(schema):
    """Foxglove reads objects with named properties, scalars, and lists of these, all in place."""

    def check(part):
        assert part["type"] in JSON_TYPES
        if part["type"] == "object":
            for inner in part["properties"].values():
                check(inner)
        if part["type"] == "array":
            assert part["items"]["type"] != "array"
            check(part["items"])

    check(schema)
    assert schema["type"] == "object"


def test_arrays_are_kept_whole_or_summarised():
    array = Array.pack(np.array([1.5, np.inf, -2.0]))

    whole, short = complete(array), summarised(array)

    assert short == {"dtype": "<f8", "shape": [3], "minimum": -2.0, "maximum": 1.5}
    assert whole == {**short, "data": "AAAAAAAA+D8AAAAAAADwfwAAAAAAAADA"}


def test_what_the_recorder_missed_is_counted_and_kept(tmp_path):
    arrivals = [Arrival(KEYS.link(0, 1), stop(n), n * SECOND) for n in (1, 2, 7)]

    recorder = record(tmp_path / "a.mcap", arrivals)

    assert recorder.missed == 4
    assert read_recording(tmp_path / "a.mcap").end["missed"] == "4"


def test_topics_beyond_what_a_file_can_number_are_dropped_and_counted(monkeypatch):
    monkeypatch.setattr(recorder_module, "MAX_CHANNELS", 2)
    recorder = Recorder(io.BytesIO(), ABOUT, summarised)
    for seat in (1, 2, 3, 1):
        recorder.record(Arrival(KEYS.link(0, seat), stop(0), SECOND))

    assert (recorder.frames, recorder.dropped) == (3, 1)


@pytest.mark.parametrize(
    ("key", "tag", "topic"),
    [
        (KEYS.link(3, 0), "evaluated", "/link/3/0/evaluated"),
        (KEYS.stats(2), "stats", "/stats/2"),
        (KEYS.stats(2), "stop", "/stats/2/stop"),
        ("a/b", "stop", "/malformed"),
    ],
)
def test_a_topic_is_a_key_and_a_kind_of_message(key, tag, topic):
    assert topic_of(key, tag) == topic


# Reading back.


def test_what_was_recorded_is_read_back(tmp_path, golden):
    work = WorkId(Kind.EVALUATE, 0, 3, 2, 4)
    genomes = Array.pack(np.zeros((2, 2)))
    asked = encode(Header(source=0, destination=1, sequence=8), Evaluate(work, genomes))
    answer = encode(
        Header(source=1, destination=0, sequence=9), Evaluated(work, Array.pack(np.zeros(2)), 0.25)
    )
    record(
        tmp_path / "a.mcap",
        [
            Arrival(KEYS.link(0, 1), asked, 5 * SECOND),
            Arrival(KEYS.stats(1), golden["stats"], 6 * SECOND),
            Arrival(KEYS.link(1, 0), answer, 7 * SECOND),
        ],
    )

    recording = read_recording(tmp_path / "a.mcap")

    first, last = recording.frames
    assert (recording.complete, recording.seconds, recording.others) == (True, 2.0, 1)
    assert recording.about == ABOUT
    assert (first.tag, first.link, first.bytes, first.time) == ("evaluate", (0, 1), len(asked), 0.0)
    assert (last.source, last.seconds, last.work) == (1, 0.25, first.work)


def test_of_a_killed_recorder_s_file_everything_flushed_is_read(tmp_path):
    path = tmp_path / "a.mcap"
    record(path, [Arrival(KEYS.link(0, 1), stop(n), n * SECOND) for n in range(20)], finish=False)
    whole = path.read_bytes()

    assert len(read_recording(path).frames) == 20
    assert not read_recording(path).complete

    path.write_bytes(whole[:-30])  # torn in the last records

    assert not read_recording(path).complete


@pytest.mark.parametrize(
    "content", [b"", b"not a recording at all", b"\x89MCAP0\r\n\x06" + b"\xff" * 40]
)
def test_what_is_no_recording_is_refused_or_empty(tmp_path, content):
    path = tmp_path / "a.mcap"
    path.write_bytes(content)

    try:
        recording = read_recording(path)
    except DamagedFile:
        return
    assert not recording.frames


def test_a_damaged_recording_is_refused(tmp_path):
    path = tmp_path / "a.mcap"
    record(path, [Arrival(KEYS.link(0, 1), stop(n), n * SECOND) for n in range(200)])
    content = bytearray(path.read_bytes())
    content[400:440] = bytes(40)
    path.write_bytes(content)

    with pytest.raises(DamagedFile, match="damaged"):
        read_recording(path)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InvalidFile, match="no such file"):
        read_recording(tmp_path / "none.mcap")


def test_messages_of_others_in_a_recording_are_refused(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("x", "jsonschema", b"{}")
        channel = writer.register_channel(
            "/x", "json", schema, {"key": KEYS.link(0, 1), "tag": "x"}
        )
        writer.add_message(channel, 0, b'{"key": 3}', 0)
        writer.finish()

    with pytest.raises(DamagedFile, match="key"):
        read_recording(path)


def test_an_intake_drops_and_counts_what_it_has_no_room_for():
    intake = Intake(room=1000)
    for _ in range(5):
        intake.put("k", bytes(300))

    taken = [intake.get(0), intake.get(0)]

    assert all(taken)
    assert intake.dropped == 3
    assert intake.get(0) is None
