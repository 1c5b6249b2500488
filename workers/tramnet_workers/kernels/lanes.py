"""Lane blocks: many individuals side by side, one instruction for several of them.

A *row* holds one number of each of ``LANES`` individuals; rows that belong together lie end to end
in one dimension, where LLVM sees that they do not overlap. Storage begins at a cache line: stores
of whole registers across two lines cost about half of a kernel's speed.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel

#: Number of individuals in a block.
LANES = 16

_LINE = 64  # bytes of a cache line
_DOUBLE = 8  # bytes of a number


@kernel
def new_rows(n_groups: int, n_rows: int) -> NDArray[np.float64]:
    """Return storage for groups of rows, at a cache line and filled with zeros.

    Args:
        n_groups: Number of groups.
        n_rows: Number of rows of each group.

    Returns:
        Storage of shape (n_groups, n_rows * LANES).
    """
    size = n_groups * n_rows * LANES
    numbers = np.zeros(size + _LINE // _DOUBLE)
    first = (-numbers.ctypes.data) % _LINE // _DOUBLE
    return numbers[first : first + size].reshape((n_groups, n_rows * LANES))
