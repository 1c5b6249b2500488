"""How long a message would be on a transputer's link: what the link books count, never the frame's own bytes.

An occam program would send a fixed header and then the arrays as they lie in memory; the frame's MessagePack names,
its versions and incarnations are ours. ``protocol/README.md`` has the table.
"""

from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import (
    Evaluate,
    Evaluated,
    Evolve,
    Evolved,
    Failed,
    Outcome,
    Track,
    Tracked,
    Work,
)

HEADER_BYTES = 16
"""Destination 2, source 2, tag 1, kind of work 1, population 2, step 4, first 2, last 2 [B]."""


def modelled_bytes(message: Work | Outcome | Failed) -> int:
    """Return the modelled length of a message [B]: header and arrays; a time or a text is not sent."""
    match message:
        case Evaluate():
            return HEADER_BYTES + len(message.genomes.data)
        case Evaluated():
            return HEADER_BYTES + len(message.objectives.data)
        case Evolve() | Evolved():
            return HEADER_BYTES + len(message.means.data) + _length(message.populations)
        case Track():
            return HEADER_BYTES + len(message.posture.data)
        case Tracked():
            return HEADER_BYTES + len(message.path.data) + len(message.cost.data)
        case Failed():
            return HEADER_BYTES


def _length(array: Array | None) -> int:
    return 0 if array is None else len(array.data)
