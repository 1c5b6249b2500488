"""Key expressions: where everything is said. Built and parsed here only.

All keys of a network lie under ``tramnet/v1/{network}/``; ``protocol/README.md`` lists who writes what where.
A pattern is a key in which ``*`` stands for any one part and a final ``**`` for any number of parts.
"""

import enum
import re
from dataclasses import dataclass
from typing import NamedTuple

from tramnet_protocol.errors import BadKey, UnknownKey
from tramnet_protocol.limits import MAX_SEATS

PREFIX = "tramnet/v1"

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}")
_SEAT = re.compile(r"0|[1-9][0-9]{0,3}")
_ANY = "*"


class Topic(enum.Enum):
    """What is said on a key."""

    LINK = "link"
    JOIN = "join"
    WIRING = "wiring"
    CONTROL = "control"
    ALIVE = "alive"
    STATS = "stats"
    EVENTS = "events"


_SEATS_IN_KEY = {
    Topic.LINK: 2,
    Topic.JOIN: 0,
    Topic.WIRING: 1,
    Topic.CONTROL: 0,
    Topic.ALIVE: 1,
    Topic.STATS: 1,
    Topic.EVENTS: 0,
}


class Address(NamedTuple):
    """A key taken apart.

    Attributes:
        network: Name of the network.
        topic: What is said there.
        seats: The TRAMs named: source and destination of a link, one TRAM, or none.
    """

    network: str
    topic: Topic
    seats: tuple[int, ...]


@dataclass(frozen=True)
class Keys:
    """The keys of one network.

    Attributes:
        network: Its name: 1 to 63 letters, digits, ``_`` and ``-``, the first a letter or digit.

    Raises:
        BadKey: The name is no such name.
    """

    network: str

    def __post_init__(self) -> None:
        check_network(self.network)

    @property
    def join(self) -> str:
        """Where a worker asks for a seat."""
        return self._key(Topic.JOIN)

    def join_as(self, name: str) -> str:
        """Return where a worker asks for a seat whose certificate bears a name."""
        return self._key(Topic.JOIN, name)

    def asker(self, key: str) -> str | None:
        """Return the name under which a worker asks for a seat, or None where it asks without one."""
        head, _, name = key.rpartition("/")
        return name if head == self.join else None

    @property
    def join_as_anybody(self) -> str:
        """Pattern of these, whatever the name."""
        return self._key(Topic.JOIN, _ANY)

    @property
    def control(self) -> str:
        """Where people scale, stop and ask for the status."""
        return self._key(Topic.CONTROL)

    @property
    def events(self) -> str:
        """Where the root says what happened."""
        return self._key(Topic.EVENTS)

    def link(self, source: int, destination: int) -> str:
        """Return the key of a directed link."""
        return self._key(Topic.LINK, _seat(source), _seat(destination))

    def wiring(self, tram: int) -> str:
        """Return where a TRAM hears of the wiring."""
        return self._key(Topic.WIRING, _seat(tram))

    def alive(self, tram: int) -> str:
        """Return the token of a TRAM's presence."""
        return self._key(Topic.ALIVE, _seat(tram))

    def stats(self, tram: int) -> str:
        """Return where a TRAM sends its heartbeat."""
        return self._key(Topic.STATS, _seat(tram))

    def links_to(self, tram: int) -> str:
        """Return the pattern of all links into a TRAM."""
        return self._key(Topic.LINK, _ANY, _seat(tram))

    def links_from(self, tram: int) -> str:
        """Return the pattern of all links out of a TRAM."""
        return self._key(Topic.LINK, _seat(tram), _ANY)

    @property
    def all_links(self) -> str:
        """Pattern of all links."""
        return self._key(Topic.LINK, _ANY, _ANY)

    @property
    def all_alive(self) -> str:
        """Pattern of all TRAMs' tokens."""
        return self._key(Topic.ALIVE, _ANY)

    @property
    def all_stats(self) -> str:
        """Pattern of all heartbeats."""
        return self._key(Topic.STATS, _ANY)

    @property
    def everything(self) -> str:
        """Pattern of all that is published on the network."""
        return f"{PREFIX}/{self.network}/**"

    def _key(self, topic: Topic, *seats: str) -> str:
        return "/".join((PREFIX, self.network, topic.value, *seats))


def check_network(name: str) -> str:
    """Return the name of a network if it is one.

    Raises:
        BadKey: It is not.
    """
    if not _NAME.fullmatch(name):
        raise BadKey(
            f"found the network name {name[:80]!r}; expected 1 to 63 letters, digits, '_' and '-', "
            "beginning with a letter or digit, such as 'tramnet' or 'lab-2'"
        )
    return name


def parse(key: str) -> Address:
    """Take a key apart.

    Raises:
        UnknownKey: It is no key of this scheme.
    """
    parts = key.split("/")
    head, rest = "/".join(parts[:2]), parts[2:]
    if head != PREFIX or len(rest) < 2 or not _NAME.fullmatch(rest[0]):
        raise UnknownKey(key, f"found the key {key[:120]!r}; expected {PREFIX}/NETWORK/TOPIC/...")
    return Address(rest[0], topic := _topic(key, rest[1]), _seats(key, topic, rest[2:]))


def matches(pattern: str, key: str) -> bool:
    """Return whether a pattern covers a key."""
    wanted, found = pattern.split("/"), key.split("/")
    if wanted[-1] == "**":
        wanted = wanted[:-1]
        found = found[: len(wanted)]
    return len(wanted) == len(found) and all(
        part in (_ANY, other) for part, other in zip(wanted, found, strict=True)
    )


def _seat(number: int) -> str:
    if not 0 <= number < MAX_SEATS:
        raise BadKey(f"found seat {number}; expected 0 (the root) to {MAX_SEATS - 1}")
    return str(number)


def _topic(key: str, word: str) -> Topic:
    try:
        return Topic(word)
    except ValueError as error:
        known = ", ".join(topic.value for topic in Topic)
        raise UnknownKey(key, f"found the topic {word[:40]!r}; expected one of {known}") from error


def _seats(key: str, topic: Topic, parts: list[str]) -> tuple[int, ...]:
    expected = _SEATS_IN_KEY[topic]
    if len(parts) != expected or not all(_SEAT.fullmatch(part) for part in parts):
        raise UnknownKey(key, f"found {key[:120]!r}; expected {expected} seats after {topic.value}")
    seats = tuple(int(part) for part in parts)
    if any(seat >= MAX_SEATS for seat in seats):
        raise UnknownKey(key, f"found {key!r}; seats are 0 to {MAX_SEATS - 1}")
    return seats
