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
    status = ControlReply("all is well", {"observers": ["unixsock-stream", "ws"]})
    network.open("root").serve(
        Keys("test").control, lambda query: query.reply(encode(Header(), status))
    )
    return network.open("observer")


def attached(channel, place):
    return Observation(LiveNetwork("test", place, place, pid=0, folder=""), channel)


@pytest.mark.parametrize("place", ["unixsock-stream//run/o", "ws/192.0.2.1:7448"])
def test_who_attaches_where_observers_do_is_told_nothing(channel, place, capsys):
    attached(channel, place).first_status()

    assert capsys.readouterr().err == ""


def test_who_attaches_where_workers_do_is_warned_once(channel, capsys):
    observation = attached(channel, "tcp/192.0.2.1:7447")
    observation.first_status()
    observation.first_status()

    said = capsys.readouterr().err
    assert said.count("tcp/192.0.2.1:7447 is where workers connect") == 1
    assert "--observe" in said
