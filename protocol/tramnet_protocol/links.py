"""How long messages take over transputer links, in whole nanoseconds of virtual time.

A link is two wires, one each way, and every byte on one is acknowledged on the other. Three times follow: that of a
byte alone, that of a byte while the other way carries bytes too (the acknowledgement waits for the packet on its
own wire), and the fixed ones of a message: set-up of the link engine, wake-up of the receiving process and, in
between TRAMs, routing. Sources: INMOS Transputer Databook (3rd ed., 1992), section 8 and table 8.1; D. Jeffery
(CERN, 1989) on the time to an acknowledgement and from there to the next byte, calibrated here for each speed so
that table 8.1 comes out within 1.5 %. The time to route is our choice.

Times are integers, so that books and tests are exact; what does not come out even is rounded up. ``duplex.py`` has
what happens on one link when several messages meet.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from msgspec import Struct

from tramnet_protocol.errors import BadLink

# All in quarters of a bit, the finest that the numbers need.
_DATA = 44  # start, one, 8 bits, stop
_DATA_AND_ACKNOWLEDGEMENT = 52
_SWITCH = 7  # delay of a C004 on the way
_HOST = (
    100  # a byte over a link adaptor, whose acknowledgements do not overlap: 0.8 MB/s at 20 Mbaud
)


class _Reaction(NamedTuple):
    """How fast the link engines answer each other, in quarters of a bit.

    Attributes:
        acknowledge: From the start of a byte to the start of its acknowledgement.
        resume: From there to the start of the next byte.
    """

    acknowledge: int
    resume: int


_REACTIONS: Mapping[int, _Reaction] = MappingProxyType(
    {20: _Reaction(22, 24), 10: _Reaction(20, 20), 5: _Reaction(16, 16)}
)

SPEEDS = tuple(sorted(_REACTIONS))
"""Speeds a link can be set to [Mbaud]."""

CYCLE = 40
"""A processor cycle of a T805-25 [ns]."""


class LinkTiming(Struct, frozen=True):
    """What a message over a link costs.

    Attributes:
        byte_alone: Time of a byte while the other way is idle [ns].
        byte_opposed: Time of a byte while the other way carries bytes too [ns].
        set_up: From the sender's instruction to the first byte [ns].
        wake_up: From the last acknowledgement until the receiving process runs [ns].
        routing: Time in a TRAM between one link and the next [ns].
    """

    byte_alone: int
    byte_opposed: int
    set_up: int = 19 * CYCLE
    wake_up: int = 19 * CYCLE
    routing: int = 75 * CYCLE

    @classmethod
    def of(cls, mbaud: int = 20, switches: int = 0) -> "LinkTiming":
        """Return the timing between two T805-25.

        Args:
            mbaud: Speed of the link, one of ``SPEEDS`` [Mbaud].
            switches: C004 crossbars it passes.

        Raises:
            BadLink: A T805 has no such speed, or there are less than no switches.
        """
        if mbaud not in _REACTIONS or switches < 0:
            raise BadLink(mbaud, switches, SPEEDS)
        acknowledge, resume = _REACTIONS[mbaud]
        delay = switches * _SWITCH
        alone = max(_DATA, acknowledge + resume + 2 * delay)
        opposed = max(_DATA_AND_ACKNOWLEDGEMENT, max(_DATA, acknowledge + delay) + delay + resume)
        return cls(_nanoseconds(alone, mbaud), _nanoseconds(opposed, mbaud))

    @classmethod
    def to_host(cls) -> "LinkTiming":
        """Return the timing of a 20 Mbaud link to the host's adaptor, which overlaps nothing."""
        byte = _nanoseconds(_HOST, 20)
        return cls(byte, byte)

    def occupied(self, size: int) -> int:
        """Return how long a message of ``size`` bytes keeps its way from others when unopposed [ns]."""
        return self.set_up + size * self.byte_alone

    def hop(self, size: int) -> int:
        """Return the time of a message of ``size`` bytes over one idle link [ns]."""
        return self.occupied(size) + self.wake_up

    def store_and_forward(self, size: int, hops: int) -> int:
        """Return the time of a message of ``size`` bytes over ``hops`` idle links [ns]."""
        return hops * self.hop(size) + (hops - 1) * self.routing

    def in_packets(self, size: int, hops: int, payload: int, header: int) -> int:
        """Return the time of a message over idle links in equal packets that follow each other.

        Args:
            size: Length of the message [B].
            hops: Number of links.
            payload: Bytes of it in a packet; the last packet is filled up.
            header: Bytes of a packet's header.

        Returns:
            The time [ns].
        """
        packets = -(-size // payload)
        each = self.hop(payload + header)
        first = self.store_and_forward(payload + header, hops)
        return first + (packets - 1) * max(each, self.routing)


def _nanoseconds(quarters: int, mbaud: int) -> int:
    return -(-quarters * 1000 // (4 * mbaud))
