import itertools
import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.duplex import NEVER, DuplexLink, Gone
from tramnet_protocol.errors import BadLink
from tramnet_protocol.links import SPEEDS, LinkTiming

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "link_vectors.json").read_text())
VECTORS = {vector["id"]: vector for vector in GOLDEN["vectors"]}

# INMOS Transputer Databook, 3rd edition, table 8.1 [kB/s]: one way, and both ways together.
TABLE_8_1 = {5: (450, 670), 10: (910, 1250), 20: (1740, 2350)}

TWENTY = LinkTiming.of(20)
sizes = st.integers(1, 100_000)
speeds = st.sampled_from(SPEEDS)
switches = st.integers(0, 3)
messages = st.lists(
    st.tuples(st.integers(0, 1), st.integers(1, 3000), st.integers(0, 5_000_000)), max_size=12
)


def play(timing: LinkTiming, offers: list[tuple[int, int, int]]) -> list[Gone[int]]:
    """Offer messages (way, size, when) to a link; what became of them, in the order of their ends."""
    link: DuplexLink[int] = DuplexLink(timing)
    gone = []
    for i in sorted(range(len(offers)), key=lambda i: offers[i][2]):
        way, size, now = offers[i]
        gone += link.advance(now)
        link.offer(way, i, size, now)
    while link.next_time < NEVER:
        gone += link.advance(link.next_time)
    return gone


def arrivals(timing: LinkTiming, offers: list[tuple[int, int, int]]) -> list[int]:
    """When the receivers of messages run, in the order of the offers [ns]."""
    ends = {done.item: done.ended + timing.wake_up for done in play(timing, offers)}
    return [ends[i] for i in range(len(offers))]


def test_the_constants_are_those_of_the_facts():
    constants = GOLDEN["constants_ns"]
    switched = LinkTiming.of(20, switches=1)

    assert (
        LinkTiming(
            constants["byte_uni"],
            constants["byte_bi"],
            constants["t_out"],
            constants["t_in"],
            constants["t_route"],
        )
        == TWENTY
    )
    assert switched.byte_alone == constants["byte_uni_1c004"]
    assert switched.byte_opposed == constants["byte_bi_1c004"]


@pytest.mark.parametrize("name", VECTORS)
def test_every_vector_comes_out_to_the_nanosecond(name):
    vector = VECTORS[name]

    assert time_of(vector) == vector["expect_ns"]


def time_of(vector: dict[str, object]) -> object:
    n, header = vector["n"], vector.get("H", 0)
    timing = LinkTiming.of(20, vector.get("c004", 0))
    match vector["mode"]:
        case "store_forward" if "bits_per_byte" in vector:
            return LinkTiming.to_host().store_and_forward(n, vector["hops"])
        case "store_forward":
            return timing.store_and_forward(n + header, vector["hops"])
        case "packet_pipelined":
            return timing.in_packets(n, vector["hops"], vector["P"], header)
        case "opposed":
            return arrivals(timing, [(0, n[0], 0), (1, n[1], 0)])
        case "fifo":
            return arrivals(timing, [(0, n[0], 0), (0, n[1], 0)])
    raise AssertionError(f"unknown mode {vector['mode']}")


@pytest.mark.parametrize("mbaud", SPEEDS)
def test_both_columns_of_table_8_1_come_out_within_one_and_a_half_per_cent(mbaud):
    timing, (one_way, both_ways) = LinkTiming.of(mbaud), TABLE_8_1[mbaud]

    assert 1e6 / timing.byte_alone == pytest.approx(one_way, rel=0.015)
    assert 2e6 / timing.byte_opposed == pytest.approx(both_ways, rel=0.015)


@pytest.mark.parametrize(("mbaud", "switches"), [(15, 0), (0, 0), (20, -1)])
def test_a_link_that_no_transputer_has_is_refused(mbaud, switches):
    with pytest.raises(BadLink, match="expected 5, 10, 20 Mbaud"):
        LinkTiming.of(mbaud, switches)


@given(sizes, st.integers(1, 20), speeds, switches)
def test_more_bytes_or_more_links_take_longer(size, hops, mbaud, switches):
    timing = LinkTiming.of(mbaud, switches)

    assert timing.store_and_forward(size, hops) < timing.store_and_forward(size + 1, hops)
    assert timing.store_and_forward(size, hops) < timing.store_and_forward(size, hops + 1)


@given(sizes, st.integers(1, 8), st.integers(1, 512), st.integers(0, 16))
def test_packets_over_one_link_never_save_time(size, hops, payload, header):
    packets = -(-size // payload)

    assert TWENTY.in_packets(size, 1, payload, header) >= TWENTY.hop(size)
    assert TWENTY.in_packets(size, hops, payload, header) >= packets * TWENTY.occupied(payload)


@given(messages, speeds, switches)
def test_every_message_arrives_once_and_those_of_a_way_in_order(offers, mbaud, switches):
    gone = play(LinkTiming.of(mbaud, switches), offers)

    assert sorted(done.item for done in gone) == list(range(len(offers)))
    assert [done.ended for done in gone] == sorted(done.ended for done in gone)
    for way in (0, 1):
        on_way = [done for done in gone if done.way == way]
        assert [done.offered for done in on_way] == sorted(done.offered for done in on_way)
        for before, after in itertools.pairwise(on_way):
            assert after.began == max(after.offered, before.ended)


@given(messages, speeds, switches)
def test_messages_the_other_way_never_make_one_faster(offers, mbaud, switches):
    timing = LinkTiming.of(mbaud, switches)
    outward = [offer for offer in offers if offer[0] == 0]
    order = [i for i, offer in enumerate(offers) if offer[0] == 0]

    alone = arrivals(timing, outward)
    together = arrivals(timing, offers)

    assert all(together[i] >= alone[j] for j, i in enumerate(order))


@given(messages, speeds, switches)
def test_a_message_takes_between_its_time_alone_and_its_time_opposed(offers, mbaud, switches):
    timing = LinkTiming.of(mbaud, switches)

    for done in play(timing, offers):
        moving = done.ended - done.began - timing.set_up
        assert done.size * timing.byte_alone <= moving <= done.size * timing.byte_opposed


@given(messages, speeds)
def test_no_way_carries_more_than_table_8_1_says(offers, mbaud):
    timing = LinkTiming.of(mbaud)
    gone = play(timing, offers)
    if not gone:
        return
    end = gone[-1].ended

    one_way = [sum(done.size for done in gone if done.way == way) for way in (0, 1)]

    assert max(one_way) * timing.byte_alone <= end
    assert sum(one_way) * timing.byte_opposed <= 2 * end  # 2,353 kB/s at 20 Mbaud


@given(messages)
def test_the_two_ways_are_alike(offers):
    swapped = [(1 - way, size, now) for way, size, now in offers]

    assert arrivals(TWENTY, offers) == arrivals(TWENTY, swapped)


def test_a_message_that_meets_another_on_its_way_is_slowed_for_as_long_as_that_moves():
    half = 512 * 575  # the first one is half over when the second one's first byte moves

    first, second = arrivals(TWENTY, [(0, 1024, 0), (1, 100, half)])

    assert second == half + 760 + 100 * 850 + 760
    slowed = -(
        -(100 * 850 * 575) // 850
    )  # bytes' worth of time alone that the first moved meanwhile
    assert first == 760 + 1024 * 575 + (100 * 850 - slowed) + 760


def test_looking_at_a_link_changes_nothing():
    offers = [(0, 1024, 0), (1, 77, 300_001), (0, 5, 300_002)]
    link: DuplexLink[int] = DuplexLink(TWENTY)
    gone = []

    for now in range(0, 900_000, 777):
        for i, (way, size, when) in enumerate(offers):
            if now - 777 < when <= now:
                gone += link.advance(when)
                link.offer(way, i, size, when)
        gone += link.advance(now)

    assert gone == play(TWENTY, offers)
