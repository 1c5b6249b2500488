import threading

import pytest

from tramnet_protocol.codec import Header, decode, encode
from tramnet_protocol.exchange import Exchange, Identity
from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import Stop, Wiring
from tramnet_workers.node import router
from tramnet_workers.node.router import Arrived, Router, Transit

KEYS = Keys("net")
WIRING = Wiring(4, "pipeline", {0: 9, 1: 3, 2: 4}, ((0, 1), (1, 2)))
NEXT = Wiring(5, "pipeline", {0: 9, 1: 3, 2: 4, 3: 1}, ((0, 1), (1, 2), (2, 3)))


@pytest.fixture
def exchange():
    return Exchange(KEYS, Identity(5, 1, 3), WIRING)


def arrived(exchange, epoch, destination=2, number=0, hop=0):
    header = Header(run=5, epoch=epoch, destination=destination, destination_incarnation=3,
                    sequence=number)  # fmt: skip
    payload = encode(header, Stop(f"{number}"))
    key = KEYS.link(hop, 1)
    return Arrived(key, exchange.incoming(key, payload), len(payload))


class Restless:
    """Routes to which a wiring comes as soon as they have been looked at."""

    def __init__(self):
        self.wirings = [NEXT, WIRING]

    @property
    def wiring(self):
        return self.wirings.pop() if len(self.wirings) > 1 else NEXT

    def knows(self, epoch):
        return epoch <= self.wiring.epoch


def test_what_goes_by_a_known_wiring_goes_on_at_once(exchange):
    frame = arrived(exchange, 4)

    assert Transit(exchange).ready(frame) == [frame]


def test_what_goes_by_a_wiring_to_come_waits_for_it_in_order(exchange):
    transit = Transit(exchange)
    frames = [arrived(exchange, epoch, number=i) for i, epoch in enumerate((5, 5, 6, 4))]

    assert [transit.ready(frame) for frame in frames] == [[], [], [], [frames[3]]]
    exchange.rewire(NEXT)
    last = arrived(exchange, 5, number=9)
    assert transit.ready(last) == [*frames[:2], last]
    assert transit.ready(None) == []


@pytest.mark.parametrize("bound", ["MOST_WAITING", "MOST_WAITING_BYTES"])
def test_what_waits_is_bounded(exchange, monkeypatch, bound):
    frames = [arrived(exchange, 5, number=i) for i in range(5)]
    monkeypatch.setattr(router, bound, 3 if bound == "MOST_WAITING" else 3 * frames[0].size)
    transit = Transit(exchange)

    for frame in frames:
        transit.ready(frame)
    exchange.rewire(NEXT)

    assert transit.ready(None) == frames[2:]
    assert transit.overflown == 2
    assert next(iter(exchange.counters())).dropped == 2


def test_a_flood_of_a_wiring_that_never_comes_holds_up_nobody_whose_wiring_is_known(
    exchange, monkeypatch
):
    monkeypatch.setattr(router, "MOST_WAITING", 3)
    transit = Transit(exchange)
    for i in range(3):
        transit.ready(arrived(exchange, 4_000_000_000, number=i))

    frame = arrived(exchange, 4)

    assert transit.ready(frame) == [frame]
    assert transit.overflown == 0


@pytest.mark.parametrize("bound", ["MOST_WAITING", "MOST_WAITING_BYTES"])
def test_a_flood_on_one_link_pushes_out_nothing_of_another(exchange, monkeypatch, bound):
    flood = [arrived(exchange, 4_000_000_000, number=i) for i in range(9)]
    patient = [arrived(exchange, 5, number=i, hop=2) for i in range(2)]
    monkeypatch.setattr(router, bound, 4 if bound == "MOST_WAITING" else 4 * flood[0].size)
    transit = Transit(exchange)

    for frame in (*flood[:5], patient[0], *flood[5:], patient[1]):
        transit.ready(frame)
    exchange.rewire(NEXT)

    assert transit.ready(None) == patient


def test_a_wiring_that_comes_while_others_are_looked_at_loses_no_frame(exchange):
    transit = Transit(exchange)
    frames = [arrived(exchange, 5, number=i) for i in range(2)]
    for frame in frames:
        transit.ready(frame)
    exchange.routes = Restless()

    assert transit.ready(None) + transit.ready(None) == frames


def test_the_thread_passes_on_what_is_for_others_and_takes_what_is_for_this_one(exchange):
    passed, taken, done = [], [], threading.Event()
    mine, other = arrived(exchange, 5, destination=1), arrived(exchange, 4)

    def take(frame):
        taken.append(frame)
        done.set()

    thread = Router(exchange, lambda key, frame: passed.append((key, frame)), take)
    for one in (mine, other):
        thread.put(*one)
    exchange.rewire(NEXT)
    thread.rewired()
    assert done.wait(10.0)
    thread.close()

    assert passed == [(KEYS.link(0, 1), other.frame)]
    assert taken == [mine.frame]


def test_a_frame_that_cannot_be_passed_on_does_not_end_the_thread(exchange, caplog):
    seen = []

    def pass_on(key, frame):
        seen.append(frame)
        if len(seen) == 1:
            raise OSError("the cable is out")

    thread = Router(exchange, pass_on, seen.append)
    frames = [arrived(exchange, 4, number=i) for i in range(2)]
    for one in frames:
        thread.put(*one)
    thread.close()

    assert [decode(encode(f.header, f.message())).header.sequence for f in seen] == [0, 1]
    assert "the cable is out" in caplog.text
