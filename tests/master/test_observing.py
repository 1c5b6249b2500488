"""Where tools that watch a network attach, over a network inside this process."""

import pytest

from tramnet_master.networks import LiveNetwork
from tramnet_master.traffic.observing import Observation
from tramnet_protocol.codec import Header, encode
from tramnet_protocol.keys import Keys
from tramnet_protocol.loopback import LoopbackNetwork
from tramnet_protocol.messages import ControlReply


@pytest.fixture
def channel():
    network = LoopbackNetwork()
    status = ControlReply(
        "all is well", {"observers": ["unixsock-stream//run/o", "ws/192.0.2.1:7448"]}
    )
    network.open("root").serve(
        Keys("test").control, lambda query: query.reply(encode(Header(), status))
    )
    return network.open("observer")


def attached(channel, place):
    return Observation(LiveNetwork("test", place, place, pid=0, folder=""), channel)


@pytest.mark.parametrize(
    ("place", "in_the_way"),
    [
        ("unixsock-stream//run/o", False),
        ("ws/192.0.2.1:7448", False),
        ("tcp/192.0.2.1:7447", True),
    ],
)
def test_only_who_attaches_where_workers_do_is_in_the_way(channel, place, in_the_way):
    observation = attached(channel, place)

    assert observation.in_the_way(observation.first_status()) is in_the_way
