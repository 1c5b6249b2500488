"""Workers' links over a network in memory: which topics a frame appears on, and what becomes of it."""

from collections import Counter

import pytest

from tramnet_protocol.arrays import Array
from tramnet_protocol.channel import Lane
from tramnet_protocol.exchange import Exchange, Identity
from tramnet_protocol.keys import Keys
from tramnet_protocol.loopback import LoopbackNetwork
from tramnet_protocol.messages import (
    Evaluate,
    Evaluated,
    Kind,
    PopulationMeans,
    PopulationSnapshot,
    WorkId,
)
from tramnet_protocol.topology import rewire, shape_named
from tramnet_workers.node.links import Links

KEYS = Keys("net")
EMPTY = Array("<f8", (0,), b"")
WORK = Evaluate(WorkId(Kind.EVALUATE, 0, 0, 0, 1), EMPTY)
ANSWER = Evaluated(WORK.work, EMPTY, 0.0)


class Net:
    """A root, workers in a pipeline, and an observer of all link topics."""

    def __init__(self, n_workers):
        self.network = LoopbackNetwork()
        self.topics = Counter()
        self.taken, self.answers = [], []
        self.wiring = rewire(shape_named("pipeline"), {i: i + 10 for i in range(n_workers + 1)}, 1)
        self.observer = self.network.open("observer")
        self.observer.subscribe(KEYS.all_links, lambda key, _: self.topics.update([key]))
        self.channel = self.network.open("root")
        self.root = Exchange(KEYS, Identity(5, 0, 10), self.wiring)
        self.channel.subscribe(KEYS.links_to(0), self.receive)
        self.links = {seat: self.open(seat) for seat in range(1, n_workers + 1)}

    def open(self, seat):
        return Links(
            self.network.open(f"worker {seat}"),
            KEYS,
            Identity(5, seat, seat + 10),
            self.wiring,
            lambda header, work: self.taken.append((header.destination, work)),
        )

    def receive(self, key, payload):
        self.answers.append(self.root.incoming(key, payload).message())

    def send(self, seat, work=WORK):
        self.channel.publish(*self.root.outgoing((seat, seat + 10), work), Lane.LINK)

    def rewire(self, *seats):
        lives = {seat: seat + 10 for seat in (0, *seats)}
        self.wiring = rewire(shape_named("pipeline"), lives, self.wiring.epoch + 1)
        self.root.rewire(self.wiring)

    def close(self):
        for links in self.links.values():
            links.close()


@pytest.fixture
def net():
    net = Net(4)
    yield net
    net.close()


def close_in_order(net, *seats):
    """Let each of these routers pass on what it has, one after the other."""
    for seat in seats:
        net.links.pop(seat).close()


def test_a_frame_three_hops_away_appears_on_exactly_three_link_topics(net):
    net.send(3)
    close_in_order(net, 1, 2)

    assert net.topics == {KEYS.link(0, 1): 1, KEYS.link(1, 2): 1, KEYS.link(2, 3): 1}
    assert net.taken == [(3, WORK)]


def test_an_answer_three_hops_away_appears_on_exactly_three_link_topics(net):
    net.links[3].send(ANSWER)
    close_in_order(net, 2, 1)

    assert net.topics == {KEYS.link(3, 2): 1, KEYS.link(2, 1): 1, KEYS.link(1, 0): 1}
    assert net.answers == [ANSWER]


def test_messages_that_belong_together_arrive_in_order(net):
    work = WorkId(Kind.EVOLVE, 0, 0, 0, 1)
    snapshot = PopulationSnapshot(work, EMPTY, EMPTY)
    means = PopulationMeans(work, EMPTY, EMPTY, 0.0)

    net.links[4].send(snapshot, means)
    close_in_order(net, 3, 2, 1)

    assert net.answers == [snapshot, means]


def test_both_ends_of_every_link_count_the_same(net):
    for _ in range(3):
        net.send(3)
    close_in_order(net, 1, 2)
    net.links[3].send(ANSWER)

    (counters, tags) = net.links[3].counters()

    assert {(c.source, c.destination): c.frames for c in counters} == {(2, 3): 3, (3, 2): 1}
    assert {(t.tag, t.sent, t.received) for t in tags} == {("evaluate", 0, 3), ("evaluated", 1, 0)}


def test_work_waits_at_its_worker_for_the_wiring_it_came_by_so_that_the_answer_knows_it(net):
    net.rewire(1, 2, 3, 4)
    net.send(1)
    assert net.taken == []

    net.links[1].rewire(net.wiring)
    close_in_order(net, 1)

    assert net.taken == [(1, WORK)]


def test_after_a_loss_frames_go_round_the_gap(net):
    net.network.kill("worker 2")
    net.rewire(1, 3, 4)
    for seat in (1, 3, 4):
        net.links[seat].rewire(net.wiring)

    net.send(3)
    close_in_order(net, 1)

    assert net.topics == {KEYS.link(0, 1): 1, KEYS.link(1, 3): 1}
    assert net.taken == [(3, WORK)]


def test_nothing_is_sent_once_closed(net):
    links = net.links.pop(1)
    links.close()

    links.send(ANSWER)

    assert net.topics == {}
