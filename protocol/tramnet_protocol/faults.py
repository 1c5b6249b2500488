"""Faults of a simulated network: which messages are late, lost, doubled or overtaken, drawn from keyed streams.

What befalls a message depends on the seed, its key and its number on that key, and on nothing else: neither on
threads nor on what other links carry.
"""

import zlib
from dataclasses import dataclass

import numpy as np

from tramnet_protocol.keys import matches


@dataclass(frozen=True)
class Fault:
    """What may befall messages whose key matches a pattern.

    Attributes:
        key: The pattern.
        drop: Probability that a message is lost.
        duplicate: Probability that it arrives twice.
        delay: Steps by which every message is late.
        reorder: Largest number of further steps by which one is late, drawn for each, so that others overtake it.
    """

    key: str
    drop: float = 0.0
    duplicate: float = 0.0
    delay: int = 0
    reorder: int = 0

    def fates(self, seed: int, key: str, number: int) -> tuple[int, ...]:
        """Return by how many steps each copy of a message is late: no copy, one or two.

        Args:
            seed: Seed of the network.
            key: The message's key.
            number: How many messages came before it on that key.
        """
        if not matches(self.key, key):
            return (0,)
        stream = np.random.Philox(key=[seed, zlib.crc32(key.encode())], counter=[0, 0, 0, number])
        rng = np.random.Generator(stream)
        lost, doubled = rng.random(2) < (self.drop, self.duplicate)
        if lost:
            return ()
        late = self.delay + rng.integers(0, self.reorder, size=2, endpoint=True)
        return (int(late[0]), int(late[1])) if doubled else (int(late[0]),)
