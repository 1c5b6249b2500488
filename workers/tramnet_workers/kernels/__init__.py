"""Numba kernels: arrays and floats in, arrays and floats out; no objects, no libm, no fastmath.

Importing this package points Numba's cache at a private folder before any kernel is compiled.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

import numba
from llvmlite import binding  # type: ignore[import-untyped]

from tramnet_workers.kernels.cache import open_cache_folder

F = TypeVar("F", bound=Callable[..., object])

numba.config.CACHE_DIR = str(  # type: ignore[attr-defined]
    open_cache_folder(Path(__file__).parents[1])
)

# LLVM unrolls a short loop over lanes completely before it would vectorise it, and then does not;
# with this it leaves every loop of more than eight turns whole.
binding.set_option("tramnet", "-unroll-full-max-count=8")


def kernel(function: F) -> F:
    """Compile a function that Python calls: cached on disk, and run without the interpreter lock.

    Divisions follow IEEE 754 (a zero divisor gives an infinity, not an exception): the test for it
    would be a branch, and branches keep loops from being vectorised.
    """
    return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def device(function: F) -> F:
    """Compile a function whose code takes the place of each call in a kernel.

    LLVM vectorises no loop that still contains a call, and a call with arrays counts references.
    """
    compiled = numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(function)
    return cast(F, compiled)


__all__ = ["device", "kernel"]
