"""A worker's shell over a network in memory: how it meets a root, loses it and leaves."""

import threading

import pytest

from tramnet_protocol.codec import Header, encode
from tramnet_protocol.keys import Keys
from tramnet_protocol.loopback import LoopbackNetwork
from tramnet_protocol.messages import (
    PROTOCOL_VERSION,
    Failed,
    JoinReply,
    Kind,
    Refusal,
    Setup,
    Wiring,
    WorkId,
)
from tramnet_protocol.packing import pack, unpack
from tramnet_workers.node import service, states
from tramnet_workers.node.service import Home, Service
from tramnet_workers.node.states import Membership
from tramnet_workers.node.supervisor import GAVE_UP, TOLD_TO_END

KEYS = Keys("net")


@pytest.fixture(autouse=True)
def quick_fingerprint(monkeypatch):
    monkeypatch.setattr(service, "kernel_fingerprint", lambda: "f" * 64)


@pytest.fixture
def network():
    return LoopbackNetwork()


def home(network):
    return Home("net", "supervisor", 10.0, lambda: network.open("worker"))


def of_another_version(payload):
    return pack([PROTOCOL_VERSION + 1, *unpack(payload)[1:]])


def test_a_worker_of_another_version_leaves_and_says_what_would_work(network, caplog):
    refusal = encode(Header(), Refusal("found another version", final=True))
    root = network.open("root")
    root.serve(KEYS.join, lambda query: query.reply(of_another_version(refusal)))

    assert Service(home(network)).run() == GAVE_UP

    expected = (
        f"version {PROTOCOL_VERSION + 1}, this node speaks {PROTOCOL_VERSION}; install the same"
    )
    assert expected in caplog.text


def test_a_worker_leaves_a_root_whose_answer_is_no_frame(network, caplog):
    network.open("root").serve(KEYS.join, lambda query: query.reply(b"hello"))

    assert Service(home(network)).run() == GAVE_UP

    assert "cannot understand the root" in caplog.text


class Root:
    """Gives everybody who asks the same seat, and another incarnation of it."""

    def __init__(self, network):
        self.incarnations = 0
        self.present = threading.Event()
        self.channel = network.open("root")
        self.channel.serve(KEYS.join, self.answer)
        self.channel.watch_tokens(KEYS.alive(1), lambda *_: self.present.set())
        self.sent = []
        self.channel.subscribe(KEYS.all_links, lambda key, _: self.sent.append(key))

    def answer(self, query):
        self.incarnations += 1
        wiring = Wiring(1, "star", {0: 9, 1: self.incarnations}, ((0, 1),))
        reply = JoinReply(5, 1, self.incarnations, 9, Setup("sphere", {}), wiring, 0)
        query.reply(encode(Header(run=5, source=0), reply))


def test_a_worker_whose_channel_closes_while_it_builds_its_problem_joins_again(
    network, monkeypatch
):
    root = Root(network)

    def build(_):
        if root.incarnations == 1:
            network.kill("worker")

    monkeypatch.setattr(service, "Evaluator", build)
    worker = Service(home(network))
    leave = threading.Thread(target=lambda: root.present.wait(10.0) and worker.stop("enough"))
    leave.start()

    assert worker.run() == TOLD_TO_END

    leave.join()
    assert root.incarnations == 2


@pytest.mark.parametrize("membership", [Membership(9, 1, 7), Membership(8, 1, 1)])
def test_what_was_decided_for_another_membership_is_not_carried_out(
    network, monkeypatch, membership
):
    root, worker = Root(network), Service(home(network))
    failed = Failed(WorkId(Kind.EVALUATE, 0, 0, 0, 1), "too late", 0.0)
    late = [states.Announce(membership), states.Answer(membership, failed)]

    def build(_):
        with monkeypatch.context() as moment:
            moment.setattr(worker._states, "handle", lambda _: late)
            worker._apply(states.RootLost())
        raise ValueError("no such problem")

    monkeypatch.setattr(service, "Evaluator", build)

    assert worker.run() == GAVE_UP

    assert root.sent == []
    assert not root.present.is_set()


def test_what_was_decided_for_a_root_that_is_gone_is_not_carried_out(network, monkeypatch):
    worker = Service(home(network))
    monkeypatch.setattr(worker._states, "handle", lambda _: [states.Announce(Membership(9, 1, 1))])

    assert worker._apply(states.RootLost()) is False
