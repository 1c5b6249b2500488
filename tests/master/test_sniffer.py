import pytest

from tramnet_master.traffic.sniffer import Sniffer
from tramnet_protocol.codec import Header, encode
from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import Stop

LINK = Keys("net").link(0, 1)


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


def frame(sequence, length=1):
    return encode(Header(sequence=sequence), Stop("x" * length))


def test_every_frame_is_counted_with_its_size_and_every_gap():
    clock = Clock()
    sniffer = Sniffer(clock, clock)
    payloads = [frame(5), frame(6, 300), frame(9)]
    for payload in payloads:
        sniffer.take(LINK, payload)
    clock.now += 2.0

    (row,) = sniffer.topics()

    sizes = [len(payload) for payload in payloads]
    assert (row.link, row.frames, row.bytes, row.missed) == ("link/0/1", 3, sum(sizes), 2)
    assert (row.least_bytes, row.most_bytes) == (min(sizes), max(sizes))
    assert (row.frames_per_s, row.bytes_per_s) == (1.5, sum(sizes) / 2)


def test_a_rate_is_that_of_the_last_second_and_not_of_all_time():
    clock = Clock()
    sniffer = Sniffer(clock, clock)
    for sequence in range(100):
        sniffer.take(LINK, frame(sequence))
    clock.now += 1.0
    sniffer.topics()
    for sequence in range(100, 104):
        sniffer.take(LINK, frame(sequence))
    clock.now += 1.0

    (row,) = sniffer.topics()

    assert (row.frames, row.frames_per_s) == (104, 4.0)


def test_the_cost_of_sniffing_is_told():
    clock, cpu = Clock(), Clock()
    sniffer = Sniffer(clock, cpu)
    sniffer.take(LINK, payload := frame(0))
    sniffer.take(LINK, b"rubbish")
    clock.now, cpu.now = clock.now + 4.0, cpu.now + 0.1

    cost = sniffer.cost()

    assert (cost.frames, cost.bytes, cost.malformed) == (1, len(payload), 1)
    assert cost.cpu == pytest.approx(0.025)


@pytest.mark.parametrize("key", ["tramnet/v1/net/link/0", "tramnet/v1/net/events", "link/a/b"])
def test_a_frame_on_a_key_that_is_no_link_is_counted_apart(key):
    sniffer = Sniffer()

    sniffer.take(key, frame(0))

    assert not sniffer.topics()
    assert sniffer.cost().malformed == 1
