"""How large a chunk is: measured cost, and the size that follows from it.

A chunk should take long against a round trip, and the last chunks of a generation should end together. Where
a worker's whole share is cheap, the share is one chunk and there is one round trip per generation. Where it is
dear, chunks follow *guided self-scheduling* (Polychronopoulos & Kuck 1987) between a floor and a ceiling: half
of what is left, split evenly, so that they shrink towards the end.
"""

import math

from tramnet_master.farm.rules import Rules
from tramnet_protocol.messages import Kind

# Weight of a new measurement in the running mean: a few chunks of memory.
_WEIGHT = 0.25
# Guided chunks do not shrink below this part of the target time.
_FLOOR = 0.125


class Costs:
    """Running means of the compute time of one slot, by kind of work.

    A worker's first answer contains what happens only once, such as loading compiled code from the disk. It
    serves as the estimate while there is nothing better, and is then replaced.
    """

    def __init__(self) -> None:
        self._mean: dict[Kind, float] = {}  # [s] per slot
        self._settled: set[Kind] = set()  # kinds whose mean holds no first answer

    def each(self, kind: Kind) -> float | None:
        """Compute time of one slot [s], or None before any was measured."""
        return self._mean.get(kind)

    def observe(self, kind: Kind, size: int, seconds: float, warm: bool) -> None:
        """Take a measured chunk into the mean.

        Args:
            kind: Kind of the work.
            size: Number of slots.
            seconds: Compute time of the chunk [s].
            warm: Whether the worker has answered before.
        """
        each = seconds / size
        if kind in self._settled:
            if warm:
                self._mean[kind] += _WEIGHT * (each - self._mean[kind])
        elif warm or kind not in self._mean:
            self._mean[kind] = each
            if warm:
                self._settled.add(kind)


def chunk_size(
    total: int, uncut: int, workers: int, each: float | None, bytes_each: int, rules: Rules
) -> int:
    """Number of slots to cut next from a work; at least 1.

    Args:
        total: Slots of the whole work.
        uncut: Slots of it not yet cut; at least 1.
        workers: Live workers that share it; at least 1.
        each: Measured cost of a slot [s], or None: then it is one slot at a time.
        bytes_each: Size of a slot on the wire [byte].
        rules: Credit and target time.
    """
    if each is None:
        return 1
    share = math.ceil(total / workers)
    if each * share <= rules.chunk_seconds:
        size = share
    else:
        target = rules.chunk_seconds / each
        guided = math.ceil(uncut / (2 * workers)) if workers > 1 else uncut
        size = int(min(target, max(guided, _FLOOR * target)))
    if bytes_each:
        # Half the credit, so that a second chunk can wait behind the first.
        size = min(size, rules.credit_bytes // (2 * bytes_each))
    return max(1, min(size, uncut))
