"""What each certificate may do at a root: Zenoh's access-control list, built from names and seats.

Whatever is not allowed here is dropped by the root's session before anybody sees it. A name may ask for a seat
under its own name, and for each seat of its range write on that TRAM's links, send its heartbeat and show its
token; it hears what is sent to those seats, and what happened. Observers on this machine (the root's own socket, in
a folder of its user's own) and whoever holds the root's own certificate hear everything and may steer.
"""

from collections.abc import Collection, Iterable, Mapping

from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import ROOT

SOCKET = "unixsock-stream"
"""Protocol of endpoints that a machine's own users reach, as far as their folder lets them."""

_SAY = ("put", "liveliness_token")
_LISTEN = ("declare_subscriber", "declare_liveliness_subscriber", "liveliness_query")
_IN, _OUT = "ingress", "egress"


def access_rules(
    network: str, root: str, seats: Mapping[str, range], observers: Collection[str] = ()
) -> dict[str, object]:
    """Return the access-control list of a root.

    Args:
        network: Name of the network.
        root: Name in the root's own certificate.
        seats: Seats that each name may take; the root's own name stands for its local workers.
        observers: Protocols of the endpoints for observers; only a socket of this machine is trusted.
    """
    keys = Keys(network)
    rules = [*_rules_for_all(keys)]
    policies: list[dict[str, object]] = []
    for name, numbers in seats.items():
        own = list(_rules_of(name, numbers, keys))
        rules += own
        names = [rule["id"] for rule in own]
        policies.append({"rules": [*names, "hear", "root-hears", "told"], "subjects": [name]})
    subjects: list[dict[str, object]] = [
        {"id": name, "cert_common_names": [name]} for name in {*seats, root}
    ]
    trusted = [root]
    if SOCKET in observers:
        subjects.append({"id": "observers of this machine", "link_protocols": [SOCKET]})
        trusted.append("observers of this machine")
    policies.append({"rules": ["watch", "watched", "steer", "steered"], "subjects": trusted})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _rules_of(name: str, seats: range, keys: Keys) -> Iterable[dict[str, object]]:
    links_from = [keys.links_from(seat) for seat in seats]
    links_to = [keys.links_to(seat) for seat in seats]
    wiring = [keys.wiring(seat) for seat in seats]
    alive = [keys.alive(seat) for seat in seats]
    stats = [keys.stats(seat) for seat in seats]
    join = [keys.join_as(name)]
    yield _rule(f"{name} asks", ("query",), _IN, join)
    yield _rule(f"{name} is answered", ("reply",), _OUT, join)
    yield _rule(f"{name} says", _SAY, _IN, [*links_from, *alive, *stats])
    yield _rule(f"{name} listens", _LISTEN, _IN, [*links_to, *wiring])
    yield _rule(f"{name} is told", ("put",), _OUT, [*links_to, *wiring])


def _rules_for_all(keys: Keys) -> Iterable[dict[str, object]]:
    root = keys.alive(ROOT)
    hears = [keys.links_to(ROOT), keys.all_stats, keys.all_alive, keys.join, keys.join_as_anybody]
    yield _rule("hear", _LISTEN, _IN, [root, keys.events])
    yield _rule("root-hears", (*_LISTEN, "declare_queryable"), _OUT, hears)
    yield _rule("told", ("put", "liveliness_token"), _OUT, [root, keys.events])
    yield _rule("watch", _LISTEN, _IN, [keys.everything])
    yield _rule("watched", ("put", "liveliness_token"), _OUT, [keys.everything])
    yield _rule("steer", ("query",), _IN, [keys.control])
    yield _rule("steered", ("reply", "declare_queryable"), _OUT, [keys.control])


def _rule(
    name: str, messages: Iterable[str], flow: str, patterns: Iterable[str]
) -> dict[str, object]:
    return {
        "id": name,
        "messages": [*messages],
        "flows": [flow],
        "permission": "allow",
        "key_exprs": [*patterns],
    }
