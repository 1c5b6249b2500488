"""Talks to a running root: asks its control topic, and finds out where it is."""

from pathlib import Path

from tramnet_master import networks
from tramnet_master.errors import RunFailed
from tramnet_protocol.channel import Channel
from tramnet_protocol.codec import Header, decode, encode
from tramnet_protocol.keys import Keys, check_network
from tramnet_protocol.messages import ControlReply, ControlRequest, Refusal
from tramnet_protocol.security import Credentials
from tramnet_protocol.transport import open_observer

TIMEOUT = 5.0
"""Longest wait for the root's answer [s]."""


def locate(connect: str | None, network: str | None) -> networks.LiveNetwork:
    """Return where a network is: at the endpoint given, or live on this machine.

    Args:
        connect: Endpoint of the root, for workers or for observers as the caller needs it, or None.
        network: Name of the network, or None for the only live one (or, at an endpoint, the default name).

    Raises:
        NoNetwork: None is alive here, or none of that name.
        AmbiguousNetwork: Several are alive and no name was given.
        BadKey: The name is none.
    """
    if connect is None:
        return networks.find(network)
    name = check_network(network or networks.DEFAULT_NETWORK)
    return networks.LiveNetwork(name, connect, connect, pid=0, folder="")


def ask(
    live: networks.LiveNetwork, request: ControlRequest, tls: Path | None = None
) -> ControlReply:
    """Ask the root of a network to do something.

    Args:
        live: Where it is.
        request: What it shall do.
        tls: Folder with the root's certificate, for a root elsewhere that asks for one.

    Raises:
        BadCredentials: The folder's certificate or key cannot be used.
        CannotConnect: Nobody listens there.
        NoAnswer: The root does not answer.
        MalformedFrame: Its answer is no frame of ours; it may be of another version.
        RunFailed: It refuses.
    """
    credentials = Credentials.load(tls) if tls else None
    with open_observer(live.observers, credentials) as channel:
        return question(channel, Keys(live.network), request, TIMEOUT)


def question(channel: Channel, keys: Keys, request: ControlRequest, timeout: float) -> ControlReply:
    """Ask the root of a network something over a channel that is open.

    Args:
        channel: The channel.
        keys: Keys of the network.
        request: The question.
        timeout: Longest wait [s].

    Raises:
        NoAnswer: The root does not answer.
        MalformedFrame: Its answer is no frame of ours; it may be of another version.
        RunFailed: It refuses.
    """
    payload = channel.ask(keys.control, encode(Header(), request), timeout)
    reply = decode(payload).message()
    if isinstance(reply, Refusal):
        raise RunFailed(f"the root refuses: {reply.reason}")
    if not isinstance(reply, ControlReply):
        raise RunFailed(f"the root answers a question with {type(reply).__name__}")
    return reply
