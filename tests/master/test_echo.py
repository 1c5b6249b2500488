import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.traffic.echo import Echo, Wanted, full_pattern
from tramnet_master.traffic.words import complete, describe, json_line, printable, shortened
from tramnet_protocol.arrays import Array
from tramnet_protocol.codec import Header, encode, encode_raw
from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import Evaluate, Kind, Setup, Stop, WorkId

KEYS = Keys("net")
LINK = KEYS.link(0, 1)
EVERYTHING = Wanted()


def stop(sequence=0, source=0, destination=1, run=5):
    header = Header(run=run, source=source, destination=destination, sequence=sequence)
    return encode(header, Stop("enough"))


def test_a_frame_is_told_with_its_header_and_its_message():
    values = Echo(EVERYTHING, 5, shortened(3)).describe(LINK, payload := stop(sequence=7))

    assert values == {
        "key": LINK, "bytes": len(payload), "tag": "stop", "from": 0, "to": 1,
        "from_incarnation": 0, "to_incarnation": 0, "run": 5, "epoch": 0, "sequence": 7,
        "message": {"reason": "enough"},
    }  # fmt: skip


def test_arrays_are_cut_short_and_identities_have_names():
    genomes = Array.pack(np.array([[1.5, np.inf], [np.nan, 4.0]]))
    payload = encode(Header(), Evaluate(WorkId(Kind.EVALUATE, 0, 3, 2, 4), genomes))

    _, values = describe(LINK, payload, shortened(3))

    assert values["message"] == {
        "work": {"kind": "evaluate", "population": 0, "step": 3, "first": 2, "last": 4},
        "genomes": {"dtype": "<f8", "shape": [2, 2], "first": [1.5, "inf", "nan"]},
    }


def test_every_kind_of_message_has_words(golden):
    for tag, payload in golden.items():
        _, values = describe(LINK, payload, complete)

        assert values["tag"] == tag
        assert json.loads(json_line(values)) == values


def test_bytes_that_are_no_frame_are_shown_as_such():
    values = Echo(EVERYTHING, 5, shortened(3)).describe(LINK, b"\xc1\x00rubbish")

    assert values["malformed"]
    assert values["head"].startswith("c1 00 72")


def test_values_nested_too_deeply_are_shown_as_such():
    body = b"\x82\xa7problem\xa1a\xaaparameters\x81\xa1x" + b"\x91" * 900 + b"\x01"

    _, values = describe(LINK, encode_raw(Header(tag="setup"), body), shortened(3))

    assert "nested" in values["malformed"]


def test_a_frame_of_another_run_is_foreign():
    echo = Echo(EVERYTHING, 5, shortened(3))

    assert echo.describe(LINK, stop(run=6))["foreign"] is True
    assert "foreign" not in echo.describe(LINK, stop(run=5))


@given(st.text(max_size=60), st.binary(max_size=300))
def test_nothing_that_arrives_stops_an_echo(key, payload):
    values = Echo(EVERYTHING, 5, shortened(3)).describe(key, payload)

    json_line(values).encode()


@pytest.mark.parametrize(
    ("wanted", "covered"),
    [
        (EVERYTHING, [True, True, True]),
        (Wanted(tags=frozenset(["stop"])), [True, True, False]),
        (Wanted(tags=frozenset(["evaluate"])), [False, False, False]),
        (Wanted(trams=frozenset([1])), [True, False, True]),
        (Wanted(trams=frozenset([3])), [False, True, False]),
        (Wanted(tags=frozenset(["stop"]), trams=frozenset([2])), [False, True, False]),
    ],
)
def test_frames_are_chosen_by_kind_and_by_tram(wanted, covered):
    echo = Echo(wanted, 5, shortened(3))
    said = [
        (LINK, stop()),
        (KEYS.link(2, 4), stop(source=3, destination=4)),  # passed on by TRAM 2
        (LINK, b"\xc1"),
    ]

    assert [echo.describe(key, payload) is not None for key, payload in said] == covered


def test_what_was_missed_is_counted_even_of_what_is_not_shown():
    echo = Echo(Wanted(tags=frozenset(["evaluate"])), 5, shortened(3))
    for sequence in (4, 5, 8):
        echo.describe(LINK, stop(sequence))

    assert echo.missed == 2


def test_nothing_said_on_the_network_steers_a_terminal():
    setup = Setup("a\x1b[2J\x9b31m\u202e", {"x": "\x07"})
    line = json_line(describe(LINK, encode(Header(), setup), shortened(3))[1])

    assert line.isprintable()
    assert json.loads(line)["message"]["problem"] == setup.problem
    assert printable("host\x1b[2J\x9b") == "host�[2J�"


@pytest.mark.parametrize(
    ("key", "pattern"),
    [
        ("**", "tramnet/v1/net/**"),
        ("/link/0/1/", "tramnet/v1/net/link/0/1"),
        ("tramnet/v1/other/events", "tramnet/v1/other/events"),
    ],
)
def test_a_short_key_is_one_of_the_network(key, pattern):
    assert full_pattern("net", key) == pattern
