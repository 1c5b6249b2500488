"""Values made plain: numbers, strings, lists and maps only, for TOML, JSON and checkpoints."""

from pathlib import PurePath

import msgspec
import numpy as np


def plain(value: object) -> object:
    """``value`` in numbers, strings, lists and maps; None stays.

    Structs and dataclasses become maps, arrays lists, paths strings, enumerations their values.

    Raises:
        TypeError: It holds something else.
    """
    return msgspec.to_builtins(value, enc_hook=plain_leaf)


def plain_leaf(value: object) -> object:
    """What msgspec cannot encode, in what it can."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, PurePath):
        return str(value)
    raise TypeError(f"expected plain values and arrays, found {type(value).__name__}")


def without_none(value: object) -> object:
    """Plain ``value`` without the keys that are None, which TOML cannot say."""
    if isinstance(value, dict):
        return {key: without_none(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list):
        return [without_none(inner) for inner in value]
    return value
