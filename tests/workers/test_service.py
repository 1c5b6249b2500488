"""A worker's shell over a network in memory: how it meets a root, loses it and leaves."""

import pytest

from tramnet_protocol.codec import Header, encode
from tramnet_protocol.keys import Keys
from tramnet_protocol.loopback import LoopbackNetwork
from tramnet_protocol.messages import PROTOCOL_VERSION, Refusal
from tramnet_protocol.packing import pack, unpack
from tramnet_workers.node import service
from tramnet_workers.node.service import Home, Service
from tramnet_workers.node.supervisor import GAVE_UP

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
