import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.errors import BadTopology
from tramnet_protocol.messages import Wiring
from tramnet_protocol.routes import KEPT, Routes, Step
from tramnet_protocol.topology import connect

LINE = Wiring(1, "pipeline", {0: 9, 1: 1, 2: 1, 3: 1}, ((0, 1), (1, 2), (2, 3)))
SHORT = Wiring(2, "pipeline", {0: 9, 1: 1, 3: 1}, ((0, 1), (1, 3)))


def wiring(epoch, topology="pipeline", lives=(1, 2, 3)):
    seats = {0: 9, **dict.fromkeys(lives, 1)}
    return Wiring(epoch, topology, seats, connect(topology, seats).edges)


def test_a_frame_goes_by_the_wiring_it_names():
    routes = Routes(1, LINE)
    routes.adopt(wiring(2, "ring"))

    assert routes.step(1, 3) == Step(2, 1)
    assert routes.step(2, 3) == Step(0, 2)


def test_a_frame_of_a_wiring_that_has_not_come_yet_is_not_known():
    routes = Routes(1, LINE)

    assert not routes.knows(2)
    routes.adopt(SHORT)
    assert routes.knows(2)


def test_there_is_no_step_to_a_tram_that_is_gone():
    routes = Routes(1, LINE)
    routes.adopt(SHORT)

    assert routes.step(1, 3) is None  # through 2, which is lost
    assert routes.step(2, 3) == Step(3, 2)


def test_a_successor_on_a_seat_is_not_the_tram_that_was_there():
    routes = Routes(1, LINE)
    routes.adopt(Wiring(2, "pipeline", {**LINE.incarnations, 2: 5}, LINE.edges))

    assert routes.step(1, 3) is None
    assert routes.step(2, 3) == Step(2, 2)


def test_what_is_older_than_all_that_is_known_goes_by_the_oldest_and_says_so():
    routes = Routes(1, LINE)
    for epoch in range(2, 2 + KEPT):
        routes.adopt(wiring(epoch))

    assert routes.step(1, 3) == Step(2, 2)


def test_a_wiring_that_comes_late_changes_nothing():
    routes = Routes(1, SHORT)

    routes.adopt(LINE)

    assert routes.wiring == SHORT


def test_a_node_that_is_not_wired_in_yet_sends_nobody_anything():
    assert Routes(7, LINE).step(1, 3) is None


def test_a_wiring_with_links_to_nowhere_is_refused():
    routes = Routes(1, LINE)

    with pytest.raises(BadTopology):
        routes.adopt(Wiring(2, "pipeline", {0: 9, 1: 1}, ((0, 2),)))
    assert routes.wiring == LINE


@given(st.lists(st.tuples(st.sampled_from(["pipeline", "ring", "tree", "torus"]),
                          st.sets(st.integers(1, 9), min_size=1)), min_size=1, max_size=12),
       st.data())  # fmt: skip
def test_no_frame_goes_round_for_ever_whatever_each_node_knows(history, data):
    wirings = [wiring(epoch, *one) for epoch, one in enumerate(history)]
    nodes = {}
    for seat in range(10):  # each knows the wirings up to one of its own
        nodes[seat] = Routes(seat, wirings[0])
        for one in wirings[1 : data.draw(st.integers(1, len(wirings)))]:
            nodes[seat].adopt(one)
    epoch, at = data.draw(st.integers(0, len(wirings) - 1)), 0
    destination = data.draw(st.sampled_from(sorted(wirings[epoch].incarnations)))

    for _ in range(10 * len(wirings)):
        if at == destination or not nodes[at].knows(epoch):
            return
        step = nodes[at].step(epoch, destination)
        if step is None:
            return
        assert step.epoch >= epoch
        at, epoch = step

    raise AssertionError("the frame is still under way")


def test_a_frame_comes_on_the_link_of_a_neighbour_and_its_own_on_its_own():
    star, line = Routes(0, wiring(1, "star")), Routes(1, LINE)

    assert star.admits(2, 2)
    assert not star.admits(2, 1)
    assert not star.admits(7, 7)
    assert line.admits(2, 2)
    assert line.admits(2, 3)
    assert not line.admits(2, 0)
    assert not line.admits(3, 3)


def test_a_frame_may_come_by_a_wiring_of_before():
    routes = Routes(1, LINE)
    routes.adopt(SHORT)

    assert routes.admits(2, 3)
    assert routes.admits(3, 3)
    assert not routes.admits(4, 4)
