import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.errors import BadKey, UnknownKey
from tramnet_protocol.keys import Address, Keys, Topic, matches, parse
from tramnet_protocol.limits import MAX_SEATS

networks = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}", fullmatch=True)
seats = st.integers(0, MAX_SEATS - 1)


@given(networks, seats, seats)
def test_a_key_that_is_built_is_parsed_back(network, one, other):
    keys = Keys(network)

    assert parse(keys.link(one, other)) == Address(network, Topic.LINK, (one, other))
    assert parse(keys.wiring(one)) == Address(network, Topic.WIRING, (one,))
    assert parse(keys.alive(one)) == Address(network, Topic.ALIVE, (one,))
    assert parse(keys.stats(one)) == Address(network, Topic.STATS, (one,))
    assert parse(keys.join) == Address(network, Topic.JOIN, ())
    assert parse(keys.control) == Address(network, Topic.CONTROL, ())
    assert parse(keys.events) == Address(network, Topic.EVENTS, ())


def test_the_keys_are_those_of_the_specification():
    keys = Keys("lab")

    assert keys.link(0, 12) == "tramnet/v1/lab/link/0/12"
    assert keys.join == "tramnet/v1/lab/join"
    assert keys.join_as("lab-2.example") == "tramnet/v1/lab/join/lab-2.example"
    assert keys.wiring(3) == "tramnet/v1/lab/wiring/3"
    assert keys.control == "tramnet/v1/lab/control"
    assert keys.alive(0) == "tramnet/v1/lab/alive/0"
    assert keys.stats(7) == "tramnet/v1/lab/stats/7"
    assert keys.events == "tramnet/v1/lab/events"


def test_the_name_under_which_a_worker_asks_is_in_the_key():
    keys = Keys("lab")

    assert keys.asker(keys.join_as("lab-2")) == "lab-2"
    assert keys.asker(keys.join) is None
    assert keys.asker(keys.control) is None


@pytest.mark.parametrize(
    "name", ["", "-a", "_a", "a/b", "*", "a*", "a b", "ä", "@a", "a.b", "a\n", "a" * 64]
)
def test_a_name_that_would_break_a_key_is_refused(name):
    with pytest.raises(BadKey, match="such as 'tramnet'"):
        Keys(name)


@pytest.mark.parametrize("seat", [-1, MAX_SEATS])
def test_a_seat_that_does_not_exist_has_no_key(seat):
    with pytest.raises(BadKey, match="expected 0"):
        Keys("lab").alive(seat)


@pytest.mark.parametrize(
    "key",
    [
        "",
        "tramnet",
        "tramnet/v1/lab",
        "tramnet/v2/lab/join",
        "other/v1/lab/join",
        "tramnet/v1/l*b/join",
        "tramnet/v1/lab/gossip",
        "tramnet/v1/lab/join/1",
        "tramnet/v1/lab/alive",
        "tramnet/v1/lab/alive/01",
        "tramnet/v1/lab/alive/-1",
        "tramnet/v1/lab/alive/4095",
        "tramnet/v1/lab/alive/99999",
        "tramnet/v1/lab/alive/\N{ARABIC-INDIC DIGIT TWO}",
        "tramnet/v1/lab/link/1",
        "tramnet/v1/lab/link/1/2/3",
        "tramnet/v1/lab/link/*/2",
    ],
)
def test_a_key_outside_the_scheme_is_unknown(key):
    with pytest.raises(UnknownKey):
        parse(key)


@given(st.text(max_size=60))
def test_whatever_the_key_it_is_parsed_or_unknown(key):
    try:
        address = parse(key)
    except UnknownKey:
        return

    assert key.split("/")[2] == address.network


@given(networks, networks, seats, seats, seats)
def test_patterns_cover_their_keys_and_no_others(network, foreign, one, other, third):
    keys = Keys(network)
    link = keys.link(one, other)

    assert matches(keys.all_links, link)
    assert matches(keys.everything, link)
    assert matches(keys.links_to(other), link)
    assert matches(keys.links_to(third), link) == (third == other)
    assert not matches(keys.all_alive, link)
    assert matches(keys.all_alive, keys.alive(one))
    assert matches(keys.all_stats, keys.stats(one))
    assert matches(Keys(foreign).everything, link) == (foreign == network)
    assert matches(link, link)
    assert not matches(link, link + "/1")
