"""Cost of a frame: what encoding and decoding add to each message, as a ratio to a memory copy of the same bytes.

``python -m benchmarks.codec`` prints, for a generation's typical chunk, the time of each step. A bar is a ratio in
one run; microseconds are printed for information.
"""

import timeit
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tramnet_protocol.arrays import Array
from tramnet_protocol.codec import Header, decode, encode, readdress
from tramnet_protocol.messages import Evaluate, Evaluated, Kind, WorkId

_HEADER = Header(run=1, epoch=3, source=0, destination=2, destination_incarnation=1, sequence=1000)
_WORK = WorkId(Kind.EVALUATE, 0, 12, 0, 50)


def microseconds(function: Callable[[], object], number: int = 2000, repeats: int = 7) -> float:
    """Return the least time of a call over some repeats [us]."""
    return min(timeit.repeat(function, number=number, repeat=repeats)) / number * 1e6


def carry(genomes: NDArray[np.int16]) -> NDArray[np.generic]:
    """Encode a chunk as the root does, and decode it as a worker does."""
    payload = encode(_HEADER, Evaluate(_WORK, Array.pack(genomes)))
    message = decode(payload).message()
    assert isinstance(message, Evaluate)
    return message.genomes.unpack("<i2", (_WORK.size, None))


def main() -> None:
    genomes = np.zeros((50, 90), np.int16)
    message = Evaluate(_WORK, Array.pack(genomes))
    answer = Evaluated(_WORK, Array.pack(np.zeros(50)), 0.001)
    payload = encode(_HEADER, message)
    frame = decode(payload)
    steps: dict[str, Callable[[], object]] = {
        "pack, encode, decode, unpack": lambda: carry(genomes),
        "encode": lambda: encode(_HEADER, message),
        "decode the header": lambda: decode(payload),
        "decode the body": frame.message,
        "readdress": lambda: readdress(payload, 7),
        "encode and decode an answer": lambda: decode(encode(_HEADER, answer)).message(),
    }
    copy = microseconds(lambda: bytearray(payload))
    print(f"Evaluate of 50 x 90 int16: {len(payload)} bytes; one copy of them {copy:.2f} us")
    for name, step in steps.items():
        taken = microseconds(step)
        print(f"{name:30s} {taken:6.2f} us, {taken / copy:5.1f} copies")


if __name__ == "__main__":
    main()
