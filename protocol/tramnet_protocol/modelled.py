"""How long a message would be on a transputer's link: what the link books count, never the frame's own bytes.

An occam program would send a fixed header and then the arrays as they lie in memory; the frame's MessagePack names,
its versions and incarnations are ours. ``protocol/README.md`` has the table.
"""

from collections.abc import Mapping

from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import (
    Evaluate,
    Evaluated,
    Evolve,
    Failed,
    Outcome,
    PopulationMeans,
    PopulationSnapshot,
    Track,
    Tracked,
    Work,
)

HEADER_BYTES = 16
"""Destination 2, source 2, tag 1, kind of work 1, population 2, step 4, first 2, last 2 [B]."""

_ARRAYS: Mapping[type, tuple[str, ...]] = {
    Evaluate: ("genomes",),
    Evaluated: ("objectives",),
    Evolve: ("means", "populations"),
    PopulationMeans: ("means", "ranking"),
    PopulationSnapshot: ("populations", "fitness"),
    Track: ("posture",),
    Tracked: ("path", "cost"),
    Failed: (),
}


def modelled_bytes(message: Work | Outcome | PopulationSnapshot | Failed) -> int:
    """Return the modelled length of a message [B]: header and arrays; no time, text or parameter is sent."""
    size = HEADER_BYTES
    for name in _ARRAYS[type(message)]:
        array: Array | None = getattr(message, name)
        if array is not None:
            size += len(array.data)
    return size
