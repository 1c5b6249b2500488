"""Somebody without a seat floods a real run; see ``tests/master/test_hostile_peers.py`` for all it could say."""

import contextlib
import json

import pytest
from undisturbed import SPHERE, assert_undisturbed

from tramnet_master import networks
from tramnet_protocol.channel import Lane
from tramnet_protocol.codec import Header, encode
from tramnet_protocol.errors import NoAnswer
from tramnet_protocol.keys import Keys
from tramnet_protocol.limits import MAX_MESSAGE_BYTES
from tramnet_protocol.messages import PROTOCOL_VERSION, JoinRequest, Stop
from tramnet_protocol.transport import open_worker

pytestmark = pytest.mark.system


@pytest.fixture
def flood(start):
    """A run that waits for its worker, and a function that floods it."""
    run = start(*SPHERE, "--generations", 25, "--workers", 0)
    run.wait_for_generation(0)
    live = networks.find()
    keys = Keys(live.network)
    foreign = encode(Header(run=1, source=7, destination=0), Stop("go"))
    with open_worker(live.endpoint) as channel:

        def pour():
            for number in range(10_000):
                payload = foreign if number % 2 else bytes(200)
                channel.publish(keys.link(number % 50 + 5, 0), payload, Lane.LINK)
            for factor in (1, 2, 16):  # as large as no node of ours would send
                channel._publishers[keys.link(5, 0), Lane.LINK].put(
                    bytes(factor * MAX_MESSAGE_BYTES)
                )
            for number in range(10):
                request = JoinRequest(PROTOCOL_VERSION, "0", "0" * 64, "host", number, "nobody")
                with contextlib.suppress(NoAnswer):  # the run may be over
                    channel.ask(keys.join, encode(Header(), request), 5.0)

        yield run, pour


def test_a_flood_changes_no_result_and_is_told_of(start, flood):
    run, pour = flood
    pour()
    inspect = start("inspect", "--json")
    assert inspect.finish() == 0, inspect.output
    told = json.loads(inspect.output)
    assert start("scale", 1).finish() == 0
    pour()

    assert_undisturbed(run)
    assert told["malformed"] > 0
    assert told["foreign"] > 0
    assert told["over_credit"] + told["malformed"] + told["foreign"] >= 10_000
    assert told["refused"] == 10
