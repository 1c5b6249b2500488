import errno
import hashlib
import os
import shutil
import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tramnet_master.checkpoints import (
    Checkpoint,
    CheckpointStore,
    decode_checkpoint,
    encode_checkpoint,
)
from tramnet_master.errors import CannotWrite, DamagedCheckpoint, UnknownCheckpointVersion

SOMEWHERE = Path("checkpoint-00000007.tramnet")

plain = st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.text() | st.binary()
numbers = plain | st.floats(allow_nan=False)
values = st.recursive(
    numbers,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)
arrays = hnp.arrays(
    st.sampled_from([np.float64, np.float32, np.int16, np.uint64, np.bool_, np.complex128]),
    hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=4),
)


def state_at(generation: int) -> dict[str, object]:
    return {"generation": generation, "genomes": np.full((4, 6), generation, dtype=np.int16)}


@pytest.fixture
def messages() -> list[str]:
    return []


@pytest.fixture
def store(tmp_path: Path, messages: list[str]) -> CheckpointStore:
    return CheckpointStore(tmp_path, messages.append)


@given(state=st.dictionaries(st.text(), values | arrays, max_size=5), generation=st.integers(0, 9))
def test_a_state_comes_back_as_it_was_saved(state, generation):
    content = encode_checkpoint(Checkpoint(generation, state))

    found = decode_checkpoint(content, SOMEWHERE)

    assert found.generation == generation
    assert list(found.state) == sorted(state)
    for name, value in state.items():
        np.testing.assert_equal(found.state[name], value)
        if isinstance(value, np.ndarray):
            assert found.state[name].dtype == value.dtype
            assert found.state[name].shape == value.shape


@given(bits=st.data())
def test_any_flipped_bit_is_noticed(bits):
    content = bytearray(encode_checkpoint(Checkpoint(7, state_at(7))))
    position = bits.draw(st.integers(0, len(content) * 8 - 1))
    content[position // 8] ^= 1 << position % 8

    with pytest.raises(DamagedCheckpoint, match=r"checkpoint-00000007\.tramnet: damaged: found"):
        decode_checkpoint(bytes(content), SOMEWHERE)


@given(bits=st.data())
def test_any_truncation_is_noticed(bits):
    content = encode_checkpoint(Checkpoint(7, state_at(7)))
    length = bits.draw(st.integers(0, len(content) - 1))

    with pytest.raises(DamagedCheckpoint):
        decode_checkpoint(content[:length], SOMEWHERE)


def test_equal_states_have_equal_bytes_whatever_the_order_of_their_names():
    one = Checkpoint(3, {"a": 1, "b": {"y": 2.0, "x": np.arange(3)}})
    other = Checkpoint(3, {"b": {"x": np.arange(3), "y": 2.0}, "a": 1})

    assert encode_checkpoint(one) == encode_checkpoint(other)


def test_arrays_of_any_memory_layout_and_byte_order_come_back_equal(store):
    array = np.arange(24, dtype=">i4").reshape(4, 6)

    store.save({"fortran": np.asfortranarray(array), "strided": array[:, ::2]}, 1)

    latest = store.load_latest()
    assert latest is not None
    np.testing.assert_array_equal(latest.state["fortran"], array)
    np.testing.assert_array_equal(latest.state["strided"], array[:, ::2])


def test_arrays_from_a_checkpoint_cannot_be_altered(store):
    store.save(state_at(1), 1)

    latest = store.load_latest()

    assert latest is not None
    with pytest.raises(ValueError, match="read-only"):
        latest.state["genomes"][0, 0] = 5


@pytest.mark.parametrize(
    "value",
    [object(), {1, 2}, np.array([object()]), np.array(["a"]), {1: "a"}, lambda: None],
    ids=["object", "set", "object array", "text array", "number as a key", "function"],
)
def test_what_would_need_unpickling_is_not_saved(store, value, tmp_path):
    with pytest.raises(TypeError, match="checkpoint"):
        store.save({"value": value}, 1)

    assert list(tmp_path.iterdir()) == []


def test_an_empty_folder_has_no_checkpoint(store):
    assert store.load_latest() is None
    assert store.refused == []


def test_the_last_two_checkpoints_are_kept(store, tmp_path):
    for generation in (10, 20, 30, 40):
        store.save(state_at(generation), generation)

    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "checkpoint-00000030.tramnet",
        "checkpoint-00000040.tramnet",
    ]


def test_the_newest_checkpoint_is_loaded(store):
    store.save(state_at(30), 30)
    store.save(state_at(40), 40)

    latest = store.load_latest()

    assert latest is not None
    assert latest.generation == 40
    assert latest.state["generation"] == 40


def test_a_damaged_checkpoint_is_refused_with_a_message_and_the_one_before_it_is_used(
    store, messages
):
    store.save(state_at(30), 30)
    path = store.save(state_at(40), 40)
    path.write_bytes(path.read_bytes()[:-1])

    latest = store.load_latest()

    assert latest is not None
    assert latest.generation == 30
    assert [error.path for error in store.refused] == [path]
    assert len(messages) == 1
    assert "checkpoint-00000040.tramnet: damaged" in messages[0]
    assert "the checkpoint before it is used" in messages[0]


def damages(content: bytes) -> Iterator[bytes]:
    """The content cut at every byte, and with every bit flipped."""
    yield from (content[:length] for length in range(len(content)))
    for bit in range(8 * len(content)):
        flipped = bytearray(content)
        flipped[bit // 8] ^= 1 << bit % 8
        yield bytes(flipped)


def test_whatever_byte_a_checkpoint_is_cut_at_or_bit_is_flipped_the_one_before_it_is_used(
    store, messages
):
    store.save({"genomes": np.arange(3)}, 30)
    path = store.save({"genomes": np.arange(4)}, 40)

    for n, damaged in enumerate(damages(path.read_bytes()), start=1):
        path.write_bytes(damaged)
        latest = store.load_latest()
        assert latest is not None
        assert latest.generation == 30
        assert len(messages) == n


def test_a_damaged_checkpoint_is_set_aside_and_told_of_once(store, messages):
    store.save(state_at(30), 30)
    path = store.save(state_at(40), 40)
    path.write_bytes(b"")
    store.load_latest()

    store.load_latest()

    assert len(messages) == 1
    assert path.with_name("checkpoint-00000040.tramnet.damaged").exists()


def test_with_every_checkpoint_damaged_there_is_none(store, messages):
    for generation in (30, 40):
        store.save(state_at(generation), generation)
    for path in store.folder.iterdir():
        path.write_bytes(b"nonsense" * 20)

    assert store.load_latest() is None
    assert len(messages) == 2


def test_a_future_overtaken_by_a_resume_is_dropped(store):
    for generation in (30, 40):
        store.save(state_at(generation), generation)

    store.save(state_at(35), 35)

    assert sorted(store.generations()) == [30, 35]


def test_a_checkpoint_of_another_format_is_refused_and_left_alone(store, messages, monkeypatch):
    store.save(state_at(30), 30)
    with monkeypatch.context() as newer:
        newer.setattr("tramnet_master.checkpoints.FORMAT_VERSION", 2)
        path = store.save(state_at(40), 40)

    latest = store.load_latest()

    assert latest is not None
    assert latest.generation == 30
    assert isinstance(store.refused[0], UnknownCheckpointVersion)
    assert "found checkpoint format 2, expected 1" in messages[0]
    assert path.exists()


def test_saving_the_same_generation_again_replaces_it(store):
    store.save({"value": 1}, 10)
    store.save({"value": 2}, 10)

    latest = store.load_latest()

    assert latest is not None
    assert latest.state["value"] == 2


def test_a_full_disk_is_told_of_and_leaves_the_earlier_checkpoint(store, monkeypatch, tmp_path):
    store.save(state_at(30), 30)

    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as disk:
        disk.setattr("tramnet_master.files.os.fsync", full)
        with pytest.raises(CannotWrite, match="No space left on device") as caught:
            store.save(state_at(40), 40)

    assert caught.value.path.name == "checkpoint-00000040.tramnet"
    assert [path.name for path in tmp_path.iterdir()] == ["checkpoint-00000030.tramnet"]


def test_a_folder_that_vanished_is_told_of():
    folder = Path(tempfile.mkdtemp())
    shutil.rmtree(folder)

    with pytest.raises(CannotWrite, match="No such file or directory"):
        CheckpointStore(folder).save(state_at(1), 1)


def test_a_half_written_file_of_a_killed_process_is_swept_up(store, tmp_path):
    (tmp_path / "checkpoint-00000020.tramnet.writing").write_bytes(b"half")

    store.save(state_at(30), 30)

    assert [path.name for path in tmp_path.iterdir()] == ["checkpoint-00000030.tramnet"]


def test_clearing_removes_every_checkpoint_and_nothing_else(store, tmp_path):
    (tmp_path / "history.csv").write_text("generation\n")
    for name in ("checkpoint-00000010.tramnet.damaged", "checkpoint-00000020.tramnet.writing"):
        (tmp_path / name).write_bytes(b"")
    store.save(state_at(30), 30)

    store.clear()

    assert [path.name for path in tmp_path.iterdir()] == ["history.csv"]


@pytest.mark.parametrize(
    "array",
    [["|O", [1], b"\0" * 8], ["<f8", [2], b"\0" * 8], ["<f8", [-1], b""], ["nonsense", [0], b""]],
    ids=["objects", "too few bytes", "negative length", "unknown type"],
)
def test_a_forged_array_is_refused(array):
    forged = msgpack.ExtType(1, msgpack.packb(array))
    content = encode_checkpoint(Checkpoint(1, {"a": b""}))
    body = msgpack.packb({"generation": 1, "state": {"a": forged}})

    with pytest.raises(DamagedCheckpoint):
        decode_checkpoint(resealed(content, body), SOMEWHERE)


def resealed(content: bytes, body: bytes) -> bytes:
    """The file ``content`` with another body and a digest that fits it."""
    head = content[:12] + struct.pack("<Q", len(body))
    return head + hashlib.sha256(head + body).digest() + body
