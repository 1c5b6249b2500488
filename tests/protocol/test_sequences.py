from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.sequences import Arrival, Order, SequenceChecker, SequenceCounter


def test_each_link_is_numbered_from_zero():
    numbers = SequenceCounter()

    taken = [numbers.take(1), numbers.take(1), numbers.take(2), numbers.take(1)]

    assert taken == [0, 1, 0, 2]


def test_a_link_that_opens_anew_is_numbered_from_zero_again():
    numbers = SequenceCounter()
    numbers.take(1)
    numbers.take(2)

    numbers.reopen(1)

    assert [numbers.take(1), numbers.take(2)] == [0, 1]


@given(st.integers(1, 300))
def test_numbers_in_order_are_no_event(count):
    checker = SequenceChecker()

    arrivals = {checker.arrived(number) for number in range(count)}

    assert arrivals == {Arrival(Order.IN_ORDER, 0)}
    assert (checker.missed, checker.reopened, checker.repeated) == (0, 0, 0)


@given(st.sets(st.integers(1, 200)))
def test_every_missing_frame_is_counted_once(lost):
    checker = SequenceChecker()
    arriving = [number for number in range(202) if number not in lost]

    arrivals = [checker.arrived(number) for number in arriving]

    assert checker.missed == len(lost)
    assert sum(arrival.missed for arrival in arrivals) == len(lost)
    assert all((arrival.order is Order.GAP) == (arrival.missed > 0) for arrival in arrivals)


def test_the_first_frames_of_a_link_can_be_missing():
    assert SequenceChecker().arrived(3) == Arrival(Order.GAP, 3)


def test_an_observer_that_comes_later_has_missed_nothing():
    checker = SequenceChecker(from_start=False)

    arrivals = [checker.arrived(number) for number in (1000, 1001, 1004)]

    assert [arrival.missed for arrival in arrivals] == [0, 0, 2]


def test_a_frame_that_comes_again_or_late_is_told_apart():
    checker = SequenceChecker()

    arrivals = [checker.arrived(number).order for number in (0, 1, 1, 3, 2, 4)]

    assert arrivals[2] is Order.REPEATED
    assert arrivals[4] is Order.REPEATED
    assert arrivals[5] is Order.IN_ORDER
    assert checker.repeated == 2


def test_a_zero_out_of_turn_is_a_link_opened_again():
    checker = SequenceChecker()

    arrivals = [checker.arrived(number) for number in (0, 1, 2, 0, 1)]

    assert arrivals[3] == Arrival(Order.REOPENED, 0)
    assert arrivals[4] == Arrival(Order.IN_ORDER, 0)
    assert (checker.reopened, checker.missed) == (1, 0)


def test_another_incarnation_opens_a_link_even_where_its_first_frame_is_lost():
    checker = SequenceChecker()
    checker.arrived(50, (1, 1))

    arrival = checker.arrived(2, (1, 2))

    assert arrival == Arrival(Order.REOPENED, 2)
    assert checker.arrived(3, (1, 2)) == Arrival(Order.IN_ORDER, 0)
