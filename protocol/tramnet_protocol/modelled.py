"""How long a message would be on a transputer's link: what the link books count, never the frame's own bytes.

An occam program would send a fixed header and then the arrays as they lie in memory; the frame's MessagePack names,
its versions and incarnations are ours. ``protocol/README.md`` has the table.
"""

from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Failed, Outcome, PopulationSnapshot, Work

HEADER_BYTES = 16
"""Destination 2, source 2, tag 1, kind of work 1, population 2, step 4, first 2, last 2 [B]."""


def modelled_bytes(message: Work | Outcome | PopulationSnapshot | Failed) -> int:
    """Return the modelled length of a message [B]: header and arrays; no time, text or parameter is sent."""
    fields = (getattr(message, name) for name in message.__struct_fields__)
    return HEADER_BYTES + sum(len(field.data) for field in fields if isinstance(field, Array))
