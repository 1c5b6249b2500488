from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.simulation.agenda import Agenda
from tramnet_master.simulation.network import Network
from tramnet_protocol.links import LinkTiming

TWENTY = LinkTiming.of(20)
Sending = tuple[tuple[int, ...], int, int]


def play(sendings: list[Sending]) -> tuple[Network, list[int]]:
    """Send messages (route, size, when); the network, and when each arrived [ns]."""
    agenda = Agenda()
    network = Network(agenda, TWENTY)
    arrived: dict[int, int] = {}

    def send(i: int) -> None:
        route, size, _ = sendings[i]
        network.send(route, size, lambda: arrived.update({i: agenda.now}))

    for i, (_, _, when) in enumerate(sendings):
        agenda.after(when, send, i)
    agenda.run()
    return network, [arrived[i] for i in range(len(sendings))]


def routes(trams: tuple[int, ...]) -> st.SearchStrategy[tuple[int, ...]]:
    """Ways along a line of TRAMs, in either direction."""
    ends = st.tuples(st.integers(0, len(trams) - 1), st.integers(0, len(trams) - 1))

    def between(ends: tuple[int, int]) -> tuple[int, ...]:
        a, b = min(ends), max(ends)
        way = trams[a : b + 1]
        return way if ends[0] < ends[1] else way[::-1]

    return ends.filter(lambda e: e[0] != e[1]).map(between)


def sendings(trams: tuple[int, ...]) -> st.SearchStrategy[list[Sending]]:
    one = st.tuples(routes(trams), st.integers(1, 2000), st.integers(0, 2_000_000))
    return st.lists(one, max_size=10)


@given(st.integers(1, 5000), st.integers(1, 12))
def test_a_message_alone_takes_the_time_of_store_and_forward(size, hops):
    _, (arrived,) = play([(tuple(range(hops + 1)), size, 0)])

    assert arrived == TWENTY.store_and_forward(size, hops)


@given(sendings((0, 1, 2, 3, 4)))
def test_bytes_on_links_are_bytes_of_messages_times_their_hops(sent):
    network, _ = play(sent)

    on_links = sum(traffic.bytes for traffic in network.traffic.values())
    frames = sum(traffic.frames for traffic in network.traffic.values())

    assert on_links == sum(size * (len(route) - 1) for route, size, _ in sent)
    assert frames == sum(len(route) - 1 for route, _, _ in sent)


@given(sendings((0, 1, 2, 3, 4)))
def test_no_message_arrives_sooner_than_it_would_alone(sent):
    _, arrived = play(sent)

    for (route, size, when), time in zip(sent, arrived, strict=True):
        assert time >= when + TWENTY.store_and_forward(size, len(route) - 1)


@given(sendings((0, 1, 2)), sendings((5, 6, 7)))
def test_links_that_share_no_tram_do_not_know_of_each_other(here, there):
    _, together = play(here + there)
    _, swapped = play(there + here)

    assert together == play(here)[1] + play(there)[1]
    assert swapped == together[len(here) :] + together[: len(here)]


@given(sendings((0, 1, 2, 3)))
def test_no_direction_carries_more_than_it_can(sent):
    network, arrived = play(sent)

    for traffic in network.traffic.values():
        assert traffic.bytes * TWENTY.byte_alone <= traffic.busy <= max(arrived)


def test_messages_for_the_same_link_wait_for_each_other_where_they_meet():
    network, (first, second) = play([((0, 1, 2), 1000, 0), ((0, 1, 2), 1000, 0)])

    assert second == first + TWENTY.occupied(1000)
    assert network.traffic[0, 1].waited == TWENTY.occupied(1000)
    assert network.traffic[1, 2].waited == 0
