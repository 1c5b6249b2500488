"""Arrays on the wire: element type, shape and bytes, checked before they become NumPy arrays."""

from msgspec import Struct


class Array(Struct, frozen=True):
    """An array as it travels.

    Attributes:
        dtype: Element type in NumPy's notation, little-endian (``<f8``, ``<i2``, ``|u1``).
        shape: Lengths of its axes.
        data: Its elements in C order.
    """

    dtype: str
    shape: tuple[int, ...]
    data: bytes
