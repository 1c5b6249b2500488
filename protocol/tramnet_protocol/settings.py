"""Settings of a Zenoh session: what every node overrides, and why.

The defaults of Zenoh listen on every interface, scout by multicast, gossip, move large payloads through shared
memory and drop under load. Here a root is a peer that listens where it is told, everybody else is a client of it,
and nothing leaves the links that are named. The lease that counts is the sender's, so every node has the same.

Observers attach at endpoints of the root whose protocols no worker uses; by these protocols one rule turns whatever
the root sends them into DROP at BACKGROUND priority, so that an observer that hangs never holds up the root.
"""

import re
from collections.abc import Sequence
from typing import TypeAlias

from tramnet_protocol.access import access_rules
from tramnet_protocol.errors import BadEndpoint
from tramnet_protocol.limits import LEASE_SECONDS, MAX_MESSAGE_BYTES, WAIT_BEFORE_CLOSE_SECONDS
from tramnet_protocol.security import Credentials

Settings: TypeAlias = dict[str, object]

ENVELOPE_BYTES = 4096
"""What Zenoh adds to a payload at most: key, time stamp and the like [B]."""

PRIVATE = ("tls", "quic")
"""Protocols over which both sides show certificates."""

_ENDPOINT = re.compile(r"(?P<protocol>[a-z][a-z-]*)/(?P<address>\S+)")

_DROP = {
    # A hanging observer costs one wait; after it the link counts as congested and nobody waits. The default for
    # messages in fragments, 50 ms, is long against a generation.
    "wait_before_drop": 1_000,  # us
    "max_wait_before_drop_fragments": 5_000,  # us
}


def root_settings(
    network: str,
    listen: Sequence[str],
    observers: Sequence[str] = (),
    credentials: Credentials | None = None,
) -> Settings:
    """Return the settings of a root.

    Args:
        network: Name of the network, shown in the admin space.
        listen: Endpoints for workers.
        observers: Endpoints for observers, of protocols no worker uses.
        credentials: Where given, only those may join whom its list of seats names.

    Raises:
        BadEndpoint: An endpoint is none, or observers would share a protocol with workers, or workers could come
            without a certificate where these are asked for.
        BadCredentials: The list of seats cannot be used.
    """
    workers = {protocol_of(endpoint) for endpoint in listen}
    settings = _common(f"tramnet root {network}", credentials) | {
        "mode": "peer",
        "listen": {"endpoints": [*listen, *observers]},
        "connect": {"endpoints": []},
        "adminspace": {"enabled": True, "permissions": {"read": True, "write": False}},
    }
    for endpoint in observers:
        if protocol_of(endpoint) in workers:
            raise BadEndpoint(
                endpoint,
                f"found {endpoint} for observers and the same protocol for workers; expected a protocol of "
                "its own, by which they are told apart: ws/HOST:PORT, or unixsock-stream on this machine",
            )
    if observers:
        settings["qos"] = {"network": [_observers_rule(observers)]}
    if credentials:
        _check_private(listen)
        settings["access_control"] = access_rules(
            network, credentials.name, credentials.seats(), [protocol_of(o) for o in observers]
        )
    return settings


def client_settings(name: str, connect: str, credentials: Credentials | None = None) -> Settings:
    """Return the settings of a worker or an observer.

    Args:
        name: Name shown in the admin space.
        connect: Endpoint of the root.
        credentials: What it shows of itself at an endpoint that asks for certificates.

    Raises:
        BadEndpoint: It is no endpoint.
    """
    protocol_of(connect)
    return _common(name, credentials) | {
        "mode": "client",
        "listen": {"endpoints": []},
        "connect": {
            "endpoints": [connect],
            "timeout_ms": 0,
            "exit_on_failure": True,
            "retry": {"period_init_ms": 100, "period_max_ms": 1000},
        },
    }


def protocol_of(endpoint: str) -> str:
    """Return the protocol of an endpoint: ``tcp`` of ``tcp/127.0.0.1:7447``.

    Raises:
        BadEndpoint: It is no endpoint.
    """
    match = _ENDPOINT.fullmatch(endpoint)
    if match is None:
        raise BadEndpoint(
            endpoint,
            f"found the endpoint {endpoint!r}; expected PROTOCOL/ADDRESS, such as "
            "tcp/127.0.0.1:7447 or unixsock-stream//run/tramnet.sock",
        )
    return match["protocol"]


def _check_private(listen: Sequence[str]) -> None:
    for endpoint in listen:
        if protocol_of(endpoint) not in PRIVATE:
            raise BadEndpoint(
                endpoint,
                f"found {endpoint}, expected one of {', '.join(PRIVATE)} where certificates are "
                f"asked for: tls/{endpoint.partition('/')[2]}",
            )


def _common(name: str, credentials: Credentials | None) -> Settings:
    congestion = {
        "block": {"wait_before_close": round(WAIT_BEFORE_CLOSE_SECONDS * 1e6)},
        "drop": _DROP,
    }
    return {
        "metadata": {"name": name},
        "scouting": {
            "delay": 0,
            "multicast": {"enabled": False},
            "gossip": {"enabled": False},
        },
        "transport": {
            "shared_memory": {"enabled": False},
            "link": {
                **({"tls": _tls(credentials)} if credentials else {}),
                "tx": {
                    "lease": round(LEASE_SECONDS * 1e3),
                    "queue": {"congestion_control": congestion},
                },
                "rx": {"max_message_size": MAX_MESSAGE_BYTES + ENVELOPE_BYTES},
            },
        },
    }


def _tls(credentials: Credentials) -> Settings:
    """Return where the certificates are; both sides of a connection show one."""
    return {
        "root_ca_certificate": credentials.ca,
        "enable_mtls": True,
        "listen_private_key": credentials.key,
        "listen_certificate": credentials.certificate,
        "connect_private_key": credentials.key,
        "connect_certificate": credentials.certificate,
    }


def _observers_rule(endpoints: Sequence[str]) -> Settings:
    return {
        "id": "observers",
        "messages": ["put", "delete", "query"],
        "flows": ["egress"],
        "key_exprs": ["**"],
        "link_protocols": sorted({protocol_of(endpoint) for endpoint in endpoints}),
        "overwrite": {"priority": "background", "congestion_control": "drop"},
    }
