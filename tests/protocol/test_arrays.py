import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from tramnet_protocol.arrays import DTYPES, MAX_AXES, Array
from tramnet_protocol.errors import BadArray, MalformedFrame
from tramnet_protocol.limits import MAX_MESSAGE_BYTES

arrays = npst.arrays(
    st.sampled_from(sorted(DTYPES)).map(np.dtype),
    npst.array_shapes(min_dims=0, max_dims=MAX_AXES, min_side=0, max_side=5),
)


@given(arrays)
def test_an_array_arrives_as_it_left(array):
    arrived = Array.pack(array).unpack()

    np.testing.assert_array_equal(arrived, array)
    assert arrived.dtype == array.dtype
    assert arrived.shape == array.shape


@given(arrays)
def test_the_order_of_axes_in_memory_does_not_travel(array):
    assert Array.pack(array.T.copy(order="F")) == Array.pack(array.T.copy(order="C"))


def test_an_array_that_arrived_is_read_only_and_no_copy():
    packed = Array.pack(np.arange(6.0).reshape(2, 3))

    arrived = packed.unpack("<f8", (2, None))

    assert not arrived.flags.writeable
    assert np.shares_memory(arrived, np.frombuffer(packed.data))


@pytest.mark.parametrize("dtype", [">f8", ">i2", "O", "?", "<U3", "S3", "<c16", "<M8[s]", "<f2"])
def test_an_element_type_that_may_not_travel_is_refused(dtype):
    with pytest.raises(BadArray, match="allowed are"):
        Array.pack(np.zeros(2, dtype))


def test_too_many_axes_or_bytes_are_refused():
    with pytest.raises(BadArray, match="5 axes"):
        Array.pack(np.zeros((1,) * 5))
    with pytest.raises(BadArray, match="bytes"):
        Array.pack(np.zeros(MAX_MESSAGE_BYTES + 1, np.uint8))


@pytest.mark.parametrize(
    ("dtype", "shape", "data"),
    [
        ("O", (1,), bytes(8)),
        ("|O", (1,), bytes(8)),
        (">f8", (1,), bytes(8)),
        ("<f8,<f8", (1,), bytes(16)),
        ("nonsense" * 100, (1,), bytes(8)),
        ("<f8", (2,), bytes(8)),
        ("<f8", (1,), bytes(9)),
        ("<f8", (-1, -1), bytes(8)),
        ("<f8", (0, 10**30), b""),
        ("<f8", (2**61,), bytes(8)),
        ("<f8", (1,) * 40, bytes(8)),
    ],
)
def test_an_array_that_is_not_what_it_says_is_malformed(dtype, shape, data):
    with pytest.raises(MalformedFrame):
        Array(dtype, shape, data).unpack()


def test_an_array_the_message_does_not_allow_is_malformed():
    packed = Array.pack(np.zeros((2, 3)))

    with pytest.raises(MalformedFrame, match="expected <i2"):
        packed.unpack("<i2")
    with pytest.raises(MalformedFrame, match=r"expected \(2, 4\)"):
        packed.unpack("<f8", (2, 4))
    with pytest.raises(MalformedFrame, match=r"expected \(None,\)"):
        packed.unpack("<f8", (None,))


@given(st.text(max_size=12), st.lists(st.integers(), max_size=6), st.binary(max_size=64))
def test_whatever_arrives_becomes_an_array_or_is_malformed(dtype, shape, data):
    try:
        arrived = Array(dtype, tuple(shape), data).unpack()
    except MalformedFrame:
        return

    assert arrived.tobytes() == data
