from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.access import access_rules
from tramnet_protocol.errors import BadCredentials, BadEndpoint
from tramnet_protocol.keys import Keys, matches
from tramnet_protocol.limits import MAX_SEATS
from tramnet_protocol.security import Credentials, read_seats
from tramnet_protocol.settings import root_settings

PATH = Path("seats.toml")
LAB_2, LAB_3 = range(9, 17), range(17, 25)


def test_each_name_has_its_range_of_seats():
    seats = read_seats(PATH, {"seats": {"lab-2.example": [9, 16], "lab_3": [17, 17]}})

    assert seats == {"lab-2.example": range(9, 17), "lab_3": range(17, 18)}


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({}, "expected one table"),
        ({"seats": {}, "more": 1}, "expected one table"),
        ({"seats": [1, 2]}, "expected one table"),
        ({"seats": {"a": 3}}, r"a: found 3, expected \[first, last\]"),
        ({"seats": {"a": [0, 3]}}, "expected"),
        ({"seats": {"a": [3, 2]}}, "expected"),
        ({"seats": {"a": [1, MAX_SEATS]}}, "within 1 to 4094"),
        ({"seats": {"a": ["1", 2]}}, "expected"),
        ({"seats": {"a/b": [1, 2]}}, "found the name 'a/b'"),
        ({"seats": {"*": [1, 2]}}, "found the name"),
        ({"seats": {"a": [1, 5], "b": [5, 9]}}, "seat 5 belongs to both a and b"),
    ],
)
def test_a_list_of_seats_that_cannot_be_used_is_refused_in_words(document, words):
    with pytest.raises(BadCredentials, match=words):
        read_seats(PATH, document)


@pytest.mark.parametrize("missing", ["ca.pem", "certificate.pem", "key.pem"])
def test_a_folder_without_one_of_its_files_is_refused(tmp_path, missing):
    for name in {"ca.pem", "certificate.pem", "key.pem"} - {missing}:
        (tmp_path / name).write_bytes(b"")

    with pytest.raises(BadCredentials, match=f"found no {missing}"):
        Credentials.load(tmp_path)


def test_a_certificate_that_is_none_is_refused(tmp_path):
    for name in ("ca.pem", "certificate.pem", "key.pem"):
        (tmp_path / name).touch(0o600)

    with pytest.raises(BadCredentials, match="expected a certificate in PEM"):
        Credentials.load(tmp_path)


def test_where_certificates_are_asked_for_nobody_comes_without():
    with pytest.raises(BadEndpoint, match=r"found tcp/0\.0\.0\.0:7447, expected one of tls, quic"):
        root_settings("lab", ["tcp/0.0.0.0:7447"], (), Credentials("root", Path()))


@given(st.integers(1, MAX_SEATS - 1), st.integers(0, MAX_SEATS - 1))
def test_a_name_may_write_on_the_links_of_its_own_seats_only(seat, other):
    keys, rules = Keys("lab"), access_rules("lab", "root", {"lab-2": LAB_2, "lab-3": LAB_3})
    (policy,) = (policy for policy in rules["policies"] if policy["subjects"] == ["lab-2"])
    allowed = [
        pattern
        for rule in rules["rules"]
        if rule["id"] in policy["rules"]
        and "put" in rule["messages"]
        and rule["flows"] == ["ingress"]
        for pattern in rule["key_exprs"]
    ]

    for key in (keys.link(seat, other), keys.stats(seat)):
        assert any(matches(pattern, key) for pattern in allowed) is (seat in LAB_2)
    for key in (keys.events, keys.wiring(seat), keys.stats(0), keys.link(0, seat)):
        assert not any(matches(pattern, key) for pattern in allowed)
