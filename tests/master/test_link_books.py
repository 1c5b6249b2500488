import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tramnet_master.farm.events import Tram
from tramnet_master.simulation.machines import T805, machine
from tramnet_master.simulation.routes import round_trips
from tramnet_master.traffic.booking import book
from tramnet_master.traffic.books import ALLOWANCE, LinkBooks
from tramnet_master.traffic.totals import Totals
from tramnet_master.traffic.trace import Shipment, Trace
from tramnet_protocol.arrays import Array
from tramnet_protocol.links import LinkTiming
from tramnet_protocol.messages import Evaluate, Evaluated, Kind, Wiring, WorkId
from tramnet_protocol.topology import SHAPES, connect

TWENTY = LinkTiming.of(20)
COST = 1_000_000
COSTS = {Kind.EVALUATE: COST}
STAR = round_trips(connect("star", range(16)))


def shipment(seat: int, size: int = 1, after: int = 0, ways=STAR, back: int = 24) -> Shipment:
    return Shipment(seat, Kind.EVALUATE, size, ways[seat], 16 + 180 * size, back, after)


@st.composite
def rounds(draw) -> tuple[Shipment, ...]:
    """Rounds of up to 12 workers in any shape, each with one chunk in work and at most one waiting."""
    topology = draw(st.sampled_from(sorted(SHAPES)))
    ways = round_trips(connect(topology, range(draw(st.integers(2, 13)))))
    found = []
    for seat in ways:
        sizes = draw(st.lists(st.integers(1, 9), max_size=4))
        ahead = draw(st.integers(0, 1))
        found += [shipment(seat, size, max(0, i - ahead), ways) for i, size in enumerate(sizes)]
    return tuple(found)


def test_one_chunk_takes_its_way_its_computing_and_its_way_back():
    found = book([shipment(1, size=5)], TWENTY, COSTS)

    assert found.time == TWENTY.hop(16 + 900) + 5 * COST + TWENTY.hop(24)
    assert found.computing == 5 * COST


def test_workers_on_links_of_their_own_do_not_wait_for_each_other():
    found = book([shipment(seat) for seat in range(1, 8)], TWENTY, COSTS)

    assert found.time == TWENTY.hop(196) + COST + TWENTY.hop(24)
    assert all(traffic.waited == 0 for traffic in found.traffic.values())


def test_what_was_sent_after_an_answer_is_sent_after_it_in_the_books():
    found = book([shipment(1), shipment(1, after=1)], TWENTY, COSTS)

    assert found.time == 2 * (TWENTY.hop(196) + COST + TWENTY.hop(24))


def test_a_chunk_that_was_queued_hides_the_way_of_the_next_one():
    found = book([shipment(1), shipment(1), shipment(1, after=1)], TWENTY, COSTS)

    assert found.time == TWENTY.hop(196) + 3 * COST + TWENTY.hop(24)


def test_messages_sent_together_leave_in_the_order_of_seats():
    ways = round_trips(connect("pipeline", range(3)))
    near, far = shipment(1, 9, ways=ways), shipment(2, 1, ways=ways)

    found = book([near, far], TWENTY, COSTS)

    assert found.traffic[0, 1].waited == TWENTY.occupied(
        16 + 9 * 180
    )  # TRAM 2's waits for TRAM 1's


def test_a_chunk_that_nobody_answered_is_carried_and_not_computed():
    found = book([shipment(1, back=0), shipment(2)], TWENTY, COSTS)

    assert found.computing == COST
    assert found.traffic[0, 1].frames == 1
    assert found.traffic[1, 0].frames == 0


@settings(max_examples=60)
@given(rounds())
def test_bytes_on_links_are_bytes_of_messages_times_hops(shipments):
    found = book(shipments, TWENTY, COSTS)

    hops = [(len(one.ways.out) - 1, len(one.ways.back) - 1) for one in shipments]
    sent = sum(
        one.out_bytes * out + one.back_bytes * back
        for one, (out, back) in zip(shipments, hops, strict=True)
    )
    assert sum(traffic.bytes for traffic in found.traffic.values()) == sent
    assert found.computing == sum(one.size * COST for one in shipments)


@settings(max_examples=60)
@given(rounds(), st.sampled_from([5, 10]))
def test_slower_links_and_dearer_slots_take_longer(shipments, mbaud):
    found = book(shipments, TWENTY, COSTS)

    slower = book(shipments, LinkTiming.of(mbaud), COSTS)

    assert slower.time >= found.time
    assert slower.computing == found.computing
    for way, traffic in found.traffic.items():
        assert traffic.bytes * TWENTY.byte_alone <= traffic.busy <= found.time
        assert slower.traffic[way].bytes == traffic.bytes


def test_every_link_of_a_real_shape_is_one_of_its_edges():
    graph = connect("torus", range(13))
    ways = round_trips(graph)

    found = book([shipment(seat, ways=ways) for seat in ways], TWENTY, COSTS)

    assert {(min(way), max(way)) for way in found.traffic} <= set(graph.edges)


# The books of a run.

WIRING = Wiring(1, "star", {0: 1, 1: 1, 2: 1}, ((0, 1), (0, 2)))


def evaluate(step: int, first: int, last: int) -> Evaluate:
    genomes = Array.pack(np.zeros((last - first, 90), np.int16))
    return Evaluate(WorkId(Kind.EVALUATE, 0, step, first, last), genomes)


def answer(asked: Evaluate, seconds: float) -> Evaluated:
    return Evaluated(asked.work, Array.pack(np.zeros(asked.work.size)), seconds)


def play(books: LinkBooks, steps: range, each: float = 0.001, lead: int = 5) -> None:
    """Generations of ten, of which TRAM 1 evaluates the first ``lead`` and TRAM 2 the rest."""
    for step in steps:
        parts = {1: evaluate(step, 0, lead), 2: evaluate(step, lead, 10)}
        for seat, part in parts.items():
            books.sent(Tram(seat, 1), part)
        for seat, part in parts.items():
            books.answered(Tram(seat, 1), answer(part, each * part.work.size), None)
        books.idle()


@pytest.fixture
def books() -> LinkBooks:
    found = LinkBooks(machine(T805, 20))
    found.rewired(WIRING)
    return found


def test_a_run_is_booked_round_by_round(books):
    play(books, range(1, 11))

    found = books.summary(20)
    cost = round(found.seconds_each["evaluate"] * 1e9)
    one = TWENTY.hop(16 + 900) + 5 * cost + TWENTY.hop(16 + 40)
    assert (found.rounds, found.booked) == (10, 10)
    assert found.seconds == pytest.approx(10 * one / 1e9)
    assert found.frames == 40
    assert found.bytes == 10 * (2 * 16 + 1800 + 2 * 16 + 80)
    assert found.busiest == (0, 1)


def test_costs_are_those_of_the_largest_chunk_of_the_first_rounds(books):
    play(books, range(1, 2), each=0.5, lead=1)
    play(books, range(2, 30), each=0.5, lead=9)

    first, second = books.summary(20), LinkBooks(machine(T805, 20))
    second.rewired(WIRING)
    play(second, range(1, 30), each=0.5, lead=9)

    assert first.seconds_each == second.summary(20).seconds_each


def test_an_answer_to_nothing_that_was_sent_is_not_booked(books):
    books.answered(Tram(1, 1), answer(evaluate(1, 0, 5), 0.1), None)
    books.idle()

    assert books.totals.rounds == 0


def test_a_rewired_network_is_booked_on_its_new_links(books):
    play(books, range(1, 4))
    books.rewired(Wiring(2, "pipeline", {0: 1, 1: 1, 2: 1}, ((0, 1), (1, 2))))
    play(books, range(4, 6))

    traffic = books.totals.traffic
    assert traffic[0, 2].frames == 3
    assert traffic[1, 2].frames == 2
    assert traffic[0, 1].frames == 3 + 2 * 2


def test_books_that_take_too_long_leave_rounds_out_and_count_them():
    ticks = itertools.count()
    books = LinkBooks(
        machine(T805, 20), lambda: ALLOWANCE * next(ticks)
    )  # so long each seems to take
    books.rewired(WIRING)
    for lead in range(1, 10):
        play(books, range(lead, lead + 1), lead=lead)

    found = books.summary(20)
    assert found.rounds == 9
    assert 0 < found.booked < 9


def test_alike_rounds_add_up_as_if_each_had_been_booked():
    trace = Trace()
    for seat in (1, 2):
        part = evaluate(1, 5 * seat - 5, 5 * seat)
        trace.sent(Tram(seat, 1), part, STAR[seat])
        trace.answered(Tram(seat, 1), answer(part, 0.1), None)
    once = book(trace.round(), TWENTY, COSTS)
    totals, sums = Totals(), Totals()

    totals.add(once, 3)
    for _ in range(3):
        sums.add(once, 1)

    assert totals.state() == sums.state()


def test_books_go_on_after_a_checkpoint_as_if_nothing_had_happened(books):
    play(books, range(1, 6))
    resumed = LinkBooks(machine(T805, 20))
    resumed.rewired(WIRING)

    resumed.restore(books.state())
    for kept in (books, resumed):
        play(kept, range(6, 9))

    assert resumed.summary(20) == books.summary(20)
    assert resumed.state() == books.state()


def test_long_rounds_are_booked_as_short_ones_are(books):
    for step in range(1, 5):
        for i in range(40):  # 80 chunks a round: more than are remembered
            parts = {
                1: evaluate(step, 20 * i, 20 * i + 9),
                2: evaluate(step, 20 * i + 9, 20 * i + 20),
            }
            for seat, part in parts.items():
                books.sent(Tram(seat, 1), part)
            for seat, part in parts.items():
                books.answered(Tram(seat, 1), answer(part, 0.1), None)
        books.idle()

    found = books.summary(20)

    assert (found.rounds, found.booked) == (4, 4)
    assert found.frames == 4 * 40 * 4
