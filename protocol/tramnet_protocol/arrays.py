"""Arrays on the wire: element type, shape and bytes, checked before they become NumPy arrays.

An array travels with its elements little-endian and in C order. What arrives is not copied again: the NumPy
array looks into the received bytes and is therefore read-only.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from tramnet_protocol.errors import BadArray, MalformedFrame
from tramnet_protocol.limits import MAX_MESSAGE_BYTES

DTYPES: Mapping[str, np.dtype[np.generic]] = MappingProxyType(
    {
        name: np.dtype(name)
        for name in ("|i1", "|u1", "<i2", "<u2", "<i4", "<u4", "<i8", "<u8", "<f4", "<f8")
    }
)
"""Element types that may travel: integers and floats of 1 to 8 bytes, little-endian; no objects, no text."""

MAX_AXES = 4
"""Largest number of axes of an array on the wire."""


class Array(Struct, frozen=True, forbid_unknown_fields=True):
    """An array as it travels.

    Attributes:
        dtype: Element type in NumPy's notation, little-endian (``<f8``, ``<i2``, ``|u1``).
        shape: Lengths of its axes.
        data: Its elements in C order.
    """

    dtype: str
    shape: tuple[int, ...]
    data: bytes

    @classmethod
    def pack(cls, array: NDArray[np.generic]) -> "Array":
        """Make an array ready to travel.

        Args:
            array: Any array of an allowed element type, with at most ``MAX_AXES`` axes; it need not be contiguous.

        Raises:
            BadArray: Its element type, its number of axes or its size is not allowed.
        """
        if array.dtype.str not in DTYPES:
            raise BadArray(
                f"found elements of type {array.dtype.str!r}; allowed are {', '.join(sorted(DTYPES))}; "
                "convert with .astype() first"
            )
        if array.ndim > MAX_AXES:
            raise BadArray(f"found {array.ndim} axes; at most {MAX_AXES} may travel; reshape first")
        if array.nbytes > MAX_MESSAGE_BYTES:
            raise BadArray(f"found {array.nbytes} bytes; at most {MAX_MESSAGE_BYTES} may travel")
        return cls(array.dtype.str, array.shape, array.tobytes())

    def unpack(
        self, dtype: str | None = None, shape: tuple[int | None, ...] | None = None
    ) -> NDArray[np.generic]:
        """Look at the received bytes as a read-only array.

        Args:
            dtype: The element type the message allows, or None for any allowed one.
            shape: The shape the message allows, None standing for any length of an axis; or None for any shape.

        Raises:
            MalformedFrame: The element type or shape is not allowed, or the bytes are not as many as they say.
        """
        found = DTYPES.get(self.dtype)
        if found is None or (dtype is not None and self.dtype != dtype):
            wanted = dtype or f"one of {', '.join(sorted(DTYPES))}"
            raise MalformedFrame(f"array of type {self.dtype[:12]!r} arrived; expected {wanted}")
        self._check_shape(shape, found.itemsize)
        return np.ndarray(self.shape, found, self.data)

    def _check_shape(self, expected: tuple[int | None, ...] | None, item_bytes: int) -> None:
        if len(self.shape) > MAX_AXES:
            raise MalformedFrame(
                f"array with {len(self.shape)} axes arrived; expected at most {MAX_AXES}"
            )
        if expected is not None and not _fits(self.shape, expected):
            raise MalformedFrame(f"array of shape {self.shape} arrived; expected {expected}")
        size = extent = item_bytes
        for length in self.shape:
            if not 0 <= length <= MAX_MESSAGE_BYTES:
                raise MalformedFrame(
                    f"array with an axis of {length} arrived; expected 0 to {MAX_MESSAGE_BYTES}"
                )
            size *= length
            extent *= length or 1  # an axis of 0 leaves no bytes, whatever the others claim
        if extent > MAX_MESSAGE_BYTES:
            raise MalformedFrame(
                f"array of shape {self.shape} arrived; expected axes that make {MAX_MESSAGE_BYTES} bytes at most"
            )
        if size != len(self.data):
            raise MalformedFrame(
                f"array of shape {self.shape} and type {self.dtype} arrived with {len(self.data)} bytes; "
                f"expected {size}"
            )


def _fits(shape: tuple[int, ...], expected: tuple[int | None, ...]) -> bool:
    return len(shape) == len(expected) and all(
        wanted is None or found == wanted for found, wanted in zip(shape, expected, strict=True)
    )
