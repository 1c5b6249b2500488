import numpy as np
import pytest

from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import (
    Evaluate,
    Evaluated,
    Evolve,
    Failed,
    Kind,
    PopulationMeans,
    PopulationSnapshot,
    Track,
    Tracked,
    WorkId,
)
from tramnet_protocol.modelled import HEADER_BYTES, modelled_bytes


def array(*shape: int, dtype: type = np.float64) -> Array:
    return Array.pack(np.zeros(shape, dtype))


WORK = WorkId(Kind.EVALUATE, 0, 1, 0, 10)
SIZES = {
    "ten chromosomes of 6 x 15 levels": (Evaluate(WORK, array(10, 6, 15, dtype=np.int16)), 1800),
    "ten objectives": (Evaluated(WORK, array(10), 0.1), 80),
    "connecting values": (Evolve(WORK, array(4, 5)), 160),
    "connecting values and a snapshot": (
        Evolve(WORK, array(4, 5), populations=array(500, dtype=np.uint8)),
        660,
    ),
    "means and ranking": (PopulationMeans(WORK, array(1, 5), array(1, 8), 0.1), 104),
    "a snapshot": (PopulationSnapshot(WORK, array(500, dtype=np.uint8), array(1, 100)), 1300),
    "a posture": (Track(WORK, array(8)), 64),
    "a path and its costs": (Tracked(WORK, array(10, 8), array(10), 0.1), 720),
    "an error": (Failed(WORK, "a long story"), 0),
}


@pytest.mark.parametrize("name", SIZES)
def test_a_message_is_as_long_as_its_header_and_its_arrays(name):
    message, arrays = SIZES[name]

    assert modelled_bytes(message) == HEADER_BYTES + arrays
