import enum
import json
import re
import tracemalloc
from pathlib import Path

import msgpack
import msgspec
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from msgspec import inspect

from tramnet_protocol.arrays import Array
from tramnet_protocol.codec import (
    FRAME_LENGTH,
    MESSAGES,
    Frame,
    Header,
    decode,
    encode,
    encode_body,
    encode_raw,
    readdress,
    tag_of,
)
from tramnet_protocol.errors import (
    BadMessage,
    MalformedFrame,
    MessageTooLarge,
    UnsupportedVersion,
)
from tramnet_protocol.limits import MAX_ITEMS, MAX_MESSAGE_BYTES, MAX_STRUCTURE_BYTES
from tramnet_protocol.messages import (
    NOBODY,
    PROTOCOL_VERSION,
    ControlReply,
    ControlRequest,
    Evaluate,
    Evaluated,
    Event,
    Evolve,
    Failed,
    JoinReply,
    JoinRequest,
    Kind,
    LinkCounters,
    PopulationMeans,
    PopulationSnapshot,
    Refusal,
    Setup,
    Stats,
    Stop,
    TagCounters,
    Track,
    Tracked,
    Wiring,
    WorkId,
)

ROOT = Path(__file__).parents[2]
GOLDEN = json.loads((ROOT / "tests/golden/frames.json").read_text())

plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats(allow_nan=False)
    | st.text(max_size=8)
    | st.binary(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4)
    ),
    max_leaves=8,
)


STRATEGIES = {
    inspect.IntType: lambda kind: st.integers(kind.ge or 0, kind.le),
    inspect.FloatType: lambda kind: st.floats(kind.ge, kind.le),
    inspect.StrType: lambda kind: st.text(
        min_size=kind.min_length or 0, max_size=min(kind.max_length or 20, 20)
    ),
    inspect.EnumType: lambda kind: st.sampled_from(kind.cls),
    inspect.LiteralType: lambda kind: st.sampled_from(kind.values),
    inspect.NoneType: lambda _: st.none(),
    inspect.BoolType: lambda _: st.booleans(),
    inspect.CustomType: lambda _: plain,
    inspect.VarTupleType: lambda kind: st.lists(strategy_of(kind.item_type), max_size=4).map(tuple),
    inspect.TupleType: lambda kind: st.tuples(*map(strategy_of, kind.item_types)),
    inspect.DictType: lambda kind: st.dictionaries(
        strategy_of(kind.key_type), strategy_of(kind.value_type), max_size=4
    ),
    inspect.UnionType: lambda kind: st.one_of([strategy_of(option) for option in kind.types]),
    inspect.StructType: lambda kind: struct_of(kind.cls, kind.fields),
}


def strategy_of(kind):
    """Return a strategy for a type of msgspec, within its declared bounds."""
    return STRATEGIES[type(kind)](kind)


def struct_of(cls, fields):
    if cls is Array:
        return st.lists(st.floats(allow_nan=False), max_size=5).map(
            lambda values: Array.pack(np.array(values, np.float64))
        )
    if cls is WorkId:
        parts = [st.integers(0, 2**31)] * 3 + [st.integers(1, 2**31)]
        return st.tuples(st.sampled_from(Kind), *parts).map(
            lambda p: WorkId(p[0], p[1], p[2], p[3], p[3] + p[4])
        )
    return st.builds(cls, **{field.name: strategy_of(field.type) for field in fields})


messages = st.one_of([strategy_of(inspect.type_info(kind)) for kind in MESSAGES.values()])
headers = strategy_of(inspect.type_info(Header))
small_frames = st.builds(
    encode, headers.map(lambda h: msgspec.structs.replace(h, version=PROTOCOL_VERSION)), messages
)

WORK = WorkId(Kind.EVALUATE, 0, 3, 2, 4)
GENOMES = Array.pack(np.array([[1, -2], [300, 4]], np.int16))
WIRING = Wiring(2, "star", {0: 9, 1: 4}, ((0, 1),))
SETUP = Setup("sphere", {"dimension": 2, "shift": [0.5, -1.0]})
EXAMPLES = [
    Evaluate(WORK, GENOMES),
    Evolve(WorkId(Kind.EVOLVE, 1, 9, 0, 2), Array.pack(np.array([[0.5]]))),
    Track(WorkId(Kind.TRACK, 0, 0, 0, 100), Array.pack(np.array([0.25, -1.5]))),
    Evaluated(WORK, Array.pack(np.array([1.5, -0.0])), 0.25),
    PopulationMeans(
        WorkId(Kind.EVOLVE, 1, 9, 0, 1),
        Array.pack(np.array([[1.0]])),
        Array.pack(np.array([[0.5]])),
        2.0,
    ),
    PopulationSnapshot(WorkId(Kind.EVOLVE, 1, 9, 0, 1), GENOMES, Array.pack(np.array([[0.5]]))),
    Tracked(
        WorkId(Kind.TRACK, 0, 0, 0, 1),
        Array.pack(np.array([[0.5, 0.5]])),
        Array.pack(np.array([2.0])),
        1.0,
    ),
    Failed(WORK, "ValueError: q", 0.5),
    SETUP,
    Stop("scaled to 1"),
    Stats(
        1,
        4,
        "busy",
        12.5,
        10.0,
        0.5,
        1000,
        20,
        1,
        0,
        (LinkCounters(1, 0, 20, 4000, queued=1),),
        4242,
        "a",
        (TagCounters("evaluated", 20, 4000, 0, 0),),
    ),
    Event("generation", 1.5, {"number": 7, "objective": 0.431}),
    WIRING,
    JoinRequest(2, "0.1.0", "ab" * 32, "a", 4242, "run"),
    JoinReply(77, 1, 4, 9, SETUP, WIRING, 20),
    Refusal("found version 2, expected 1", True),
    ControlRequest("scale", 6),
    ControlReply("6 workers", {"workers": 6}),
]
HEADER = Header(
    run=77,
    epoch=2,
    source=0,
    source_incarnation=9,
    destination=1,
    destination_incarnation=4,
    sequence=300,
)


@given(headers, messages)
def test_a_message_arrives_as_it_left(header, message):
    sent = msgspec.structs.replace(header, version=PROTOCOL_VERSION)

    frame = decode(encode(sent, message))

    assert frame.header == msgspec.structs.replace(sent, tag=tag_of(message))
    assert frame.message() == message


@given(small_frames, st.integers(0, 2**63 - 1))
def test_a_router_changes_the_sequence_and_nothing_else(payload, sequence):
    before = decode(payload)

    after = decode(readdress(payload, sequence))

    assert after.body == before.body
    assert after.header == msgspec.structs.replace(before.header, sequence=sequence)


def test_a_router_does_not_look_into_the_body():
    payload = encode_raw(Header(tag="of another day"), b"\xc1 no MessagePack")

    assert decode(readdress(payload, 5)).body == b"\xc1 no MessagePack"


def test_a_body_can_be_packed_once_and_framed_many_times():
    body = encode_body(SETUP)

    frame = encode_raw(msgspec.structs.replace(HEADER, tag="setup"), body)

    assert frame == encode(HEADER, SETUP)


def test_scalars_of_numpy_travel_as_plain_numbers():
    event = Event("generation", 0.0, {"best": np.float64(0.5), "at": np.int64(3), "ok": np.True_})

    arrived = decode(encode(HEADER, event)).message()

    assert arrived.detail == {"best": 0.5, "at": 3, "ok": True}
    assert [type(value) for value in arrived.detail.values()] == [float, int, bool]


@pytest.mark.parametrize("message", EXAMPLES, ids=tag_of)
def test_a_frame_is_byte_for_byte_the_one_on_record(message):
    assert encode(HEADER, message).hex() == GOLDEN[tag_of(message)]


@pytest.mark.parametrize("message", EXAMPLES, ids=tag_of)
def test_a_frame_on_record_is_understood(message):
    frame = decode(bytes.fromhex(GOLDEN[tag_of(message)]))

    assert frame.message() == message
    assert frame.header == msgspec.structs.replace(HEADER, tag=tag_of(message))


def test_every_message_is_on_record():
    assert set(GOLDEN) == set(MESSAGES)
    assert {tag_of(message) for message in EXAMPLES} == set(MESSAGES)


def test_the_frames_in_the_specification_are_those_on_record():
    text = (ROOT / "protocol/README.md").read_text()
    blocks = re.findall(r"```hex\n(.*?)```", text, re.DOTALL)
    shown = {"".join(re.sub(r"#.*", "", block).split()) for block in blocks}

    assert shown
    assert shown <= set(GOLDEN.values())


def test_the_specification_describes_every_message_and_field():
    _, text = (ROOT / "protocol/README.md").read_text().split("## Messages")

    for tag, kind in MESSAGES.items():
        row = re.search(rf"^\| `{tag}` \|.*$", text, re.MULTILINE)
        assert row is not None, tag
        for field in kind.__struct_fields__:
            assert f"`{field}`" in row.group(), (tag, field)


# What arrives from anybody.


def is_refused(payload):
    """Return whether bytes are no message, having raised nothing but MalformedFrame."""
    try:
        decode(payload).message()
    except MalformedFrame:
        return True
    return False


@given(st.binary(max_size=300))
@example(b"")
@example(b"\xc1")
@example(b"\x90")
@example(b"\x9a")
def test_random_bytes_are_malformed(payload):
    assert is_refused(payload)


@given(plain | st.lists(plain, max_size=FRAME_LENGTH))
def test_any_other_messagepack_is_malformed(value):
    assert is_refused(msgpack.packb(value))


@given(small_frames, st.data())
def test_a_truncated_frame_is_malformed(payload, data):
    length = data.draw(st.integers(0, len(payload) - 1))

    assert is_refused(payload[:length])
    assert is_refused(payload + b"\x00")


@given(small_frames, st.data())
def test_a_changed_byte_raises_nothing_else(payload, data):
    at = data.draw(st.integers(0, len(payload) - 1))
    changed = bytearray(payload)
    changed[at] = data.draw(st.integers(0, 255))

    is_refused(bytes(changed))


@given(st.sampled_from(EXAMPLES), st.binary(max_size=60), st.data())
def test_a_changed_body_raises_nothing_else(message, noise, data):
    body = encode_body(message)
    start, end = sorted(data.draw(st.lists(st.integers(0, len(body)), min_size=2, max_size=2)))

    is_refused(encode_raw(Header(tag=tag_of(message)), body[:start] + noise + body[end:]))


def evaluate_with(changes):
    fields = msgspec.to_builtins(EXAMPLES[0], builtin_types=(bytes,)) | changes
    return Frame(Header(tag="evaluate"), msgpack.packb(fields))


@pytest.mark.parametrize(
    "changes",
    [
        {"work": [0, 0, 3, 2, 2]},
        {"work": [0, 0, 3, 4, 2]},
        {"work": [9, 0, 3, 2, 4]},
        {"work": [0, 0, -3, 2, 4]},
        {"work": [0, 0, 2**32, 2, 4]},
        {"work": [0, 0, 3, 2]},
        {"work": [0, 0, 3.0, 2, 4]},
        {"work": [False, 0, 3, 2, 4]},
        {"work": None},
        {"genomes": b"\x00"},
        {"genomes": {"dtype": "<f8", "shape": [1], "data": "AAAAAAAAAAA="}},
        {"genomes": {"dtype": "<f8", "shape": [1.5], "data": b""}},
        {"genomes": {"dtype": "<f8", "shape": [1]}},
        {"more": 1},
        {7: 1},
    ],
)
def test_a_field_that_is_not_what_it_should_be_is_malformed(changes):
    assert evaluate_with({}).message() == EXAMPLES[0]
    with pytest.raises(MalformedFrame, match="bad Evaluate"):
        evaluate_with(changes).message()


@pytest.mark.parametrize("seconds", [float("nan"), float("inf"), -1.0, True, "1"])
def test_a_time_that_is_none_is_malformed(seconds):
    body = msgpack.packb({"work": [0, 0, 0, 0, 1], "error": "", "seconds": seconds})

    with pytest.raises(MalformedFrame, match="seconds"):
        Frame(Header(tag="failed"), body).message()


def test_a_frame_of_another_version_says_so_whatever_its_shape():
    with pytest.raises(UnsupportedVersion) as caught:
        decode(msgpack.packb([PROTOCOL_VERSION + 1, {"another": "shape"}]))

    assert (caught.value.found, caught.value.expected) == (PROTOCOL_VERSION + 1, PROTOCOL_VERSION)
    assert "install the same tramnet" in str(caught.value)


@pytest.mark.parametrize("length", [1, 2, 9, 11, 4000])
def test_a_frame_of_another_length_is_malformed(length):
    payload = msgpack.packb([PROTOCOL_VERSION] * length)

    with pytest.raises(MalformedFrame, match=f"expected a frame of {FRAME_LENGTH}"):
        decode(payload)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (1, -1),
        (1, 2**63),
        (2, 2**32),
        (3, NOBODY + 1),
        (7, 1.0),
        (8, "x" * 33),
        (8, b"stop"),
        (9, ""),
    ],
)
def test_a_header_out_of_bounds_is_malformed(place, value):
    fields = msgpack.unpackb(encode(HEADER, EXAMPLES[8]))
    fields[place] = value

    with pytest.raises(MalformedFrame):
        decode(msgpack.packb(fields))


def test_an_unknown_tag_is_malformed_and_the_known_ones_are_named():
    with pytest.raises(MalformedFrame, match="'pickle' arrived; known are evaluate, evolve"):
        decode(encode_raw(Header(tag="pickle"), b"\x80")).message()


@pytest.mark.parametrize(
    "value",
    [msgpack.ExtType(5, b""), msgpack.ExtType(5, b"abcd"), msgpack.Timestamp(1)],
    ids=["empty", "extension", "timestamp"],
)
def test_extension_types_are_malformed(value):
    body = msgpack.packb({"problem": "p", "parameters": {"a": value}})

    with pytest.raises(MalformedFrame):
        Frame(Header(tag="setup"), body).message()


DECLARED = {
    "list": b"\xdd\xff\xff\xff\xff",
    "map": b"\xdf\xff\xff\xff\xff",
    "bytes": b"\xc6\xff\xff\xff\xff",
    "text": b"\xdb\xff\xff\xff\xff",
    "extension": b"\xc9\xff\xff\xff\xff\x05",
    "nested lists": b"\xdc\x10\x00" * 1000,
    "deep lists": b"\x91" * MAX_STRUCTURE_BYTES,
    "deep maps": b"\x81\x01" * (MAX_STRUCTURE_BYTES // 2),
}
FLOODS = {
    "empty maps": b"\xdc\x10\x00" + b"\x80" * MAX_ITEMS,
    "floats": b"\xdc\x10\x00" + b"\xcb\x40\x00\x00\x00\x00\x00\x00\x01" * MAX_ITEMS,
    "short texts": b"\xdc\x10\x00" + b"\xa2ab" * MAX_ITEMS,
}


@pytest.mark.parametrize("start", DECLARED.values(), ids=DECLARED.keys())
def test_lengths_that_are_only_declared_allocate_nothing(start):
    def attack():
        assert is_refused(start + bytes(64))
        assert is_refused(encode_raw(Header(tag="setup"), start + bytes(64)))

    # 1024 levels of lists of MAX_ITEMS is the most that can be declared.
    assert peak_bytes(attack) < 1024 * MAX_ITEMS * 8 + 2**20


@pytest.mark.parametrize("flood", FLOODS.values(), ids=FLOODS.keys())
def test_a_flood_of_small_objects_stays_within_bounds(flood):
    copies = (MAX_MESSAGE_BYTES - 200) // len(flood)
    body = b"\xdc" + copies.to_bytes(2, "big") + flood * copies

    def attack():
        assert is_refused(body)
        assert is_refused(encode_raw(Header(tag="setup"), body))

    # Two copies of the bytes, and the objects of MAX_STRUCTURE_BYTES at 72 bytes each at most.
    assert peak_bytes(attack) < 2 * MAX_MESSAGE_BYTES + 24 * 2**20


def peak_bytes(action):
    tracemalloc.start()
    try:
        action()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


# What this side may not send.


def test_bulk_up_to_the_limit_travels():
    genomes = np.zeros((1, MAX_MESSAGE_BYTES - 200), np.uint8)

    payload = encode(HEADER, Evaluate(WORK, Array.pack(genomes)))

    assert MAX_MESSAGE_BYTES - 200 < len(payload) <= MAX_MESSAGE_BYTES
    assert decode(payload).message().genomes.unpack().shape == genomes.shape


def test_a_message_above_the_limit_does_not_leave():
    two = Array.pack(np.zeros(MAX_MESSAGE_BYTES // 2, np.uint8))

    with pytest.raises(MessageTooLarge) as caught:
        encode(HEADER, PopulationSnapshot(WORK, two, two))

    assert caught.value.size > caught.value.limit == MAX_MESSAGE_BYTES


def test_a_payload_above_the_limit_is_malformed():
    with pytest.raises(MalformedFrame, match=f"at most {MAX_MESSAGE_BYTES}"):
        decode(bytes(MAX_MESSAGE_BYTES + 1))


class Colour(enum.Enum):
    RED = object()


@pytest.mark.parametrize(
    "value", [object(), 2**64, "\ud800", Colour.RED, np.zeros(3), lambda: 1], ids=repr
)
def test_what_may_not_travel_is_refused_before_it_leaves(value):
    with pytest.raises(BadMessage):
        encode(HEADER, Setup("p", {"a": value}))


def test_parameters_without_an_end_are_refused():
    endless = []
    endless.append(endless)

    with pytest.raises(BadMessage):
        encode(HEADER, Setup("p", {"a": endless}))
