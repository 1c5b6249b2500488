from functools import reduce

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.traffic.controls import View, press
from tramnet_master.traffic.keyboard import keys_of
from tramnet_master.traffic.selection import parse_filter

VIEW = View(("trams", "links"), choices=(("trams", "links"), ("trams",), ("links",)))


def pressed(*keys):
    return reduce(press, keys, VIEW)


def test_tab_goes_round_the_tables():
    assert pressed("tab").tables == ("trams",)
    assert pressed("tab", "tab", "tab") == VIEW


def test_s_goes_through_the_columns_there_and_back():
    assert pressed("s").selection.sort == "seat"
    assert pressed("s", "s", "S", "S") == VIEW
    assert pressed("S").selection.sort == VIEW.sortable[-1]


def test_a_filter_is_typed_and_takes_effect_at_enter():
    typing = pressed("/", *"tram=12", "backspace")
    assert typing.typing == "tram=1"
    assert not typing.selection.terms

    done = press(typing, "enter")

    assert (done.typing, done.filtered) == (None, "tram=1")
    assert done.selection.terms == parse_filter("tram=1")
    assert press(done, "c").selection.terms == ()


def test_letters_steer_nothing_while_a_filter_is_typed():
    assert pressed("/", "q").ended is False
    assert pressed("/", "q", "escape") == VIEW


def test_a_filter_that_cannot_be_is_complained_of_until_the_next_key():
    refused = pressed("/", *"speed>3", "enter")

    assert "speed>3" in refused.complaint
    assert refused.selection == VIEW.selection
    assert press(refused, "p").complaint == ""


def test_scrolling_stops_at_the_top():
    assert pressed("down", "down", "up", "page up").offset == 0
    assert pressed("page down", "down").offset == 11
    assert pressed("page down", "home").offset == 0


def test_p_pauses_r_reverses_and_q_ends():
    assert pressed("p").paused
    assert not pressed("p", "p").paused
    assert pressed("r").selection.reverse
    assert pressed("q").ended


@given(st.lists(st.text(min_size=1, max_size=10), max_size=30))
def test_no_key_breaks_the_view(keys):
    assert isinstance(pressed(*keys), View)


@pytest.mark.parametrize(
    ("sent", "keys"),
    [
        ("q", ["q"]),
        ("\x1b[A\x1b[B", ["up", "down"]),
        ("\x1b", ["escape"]),
        ("s\x1b[5~\t\r", ["s", "page up", "tab", "enter"]),
        ("\x1b[31~q", []),
        ("\x7f", ["backspace"]),
    ],
)
def test_what_a_terminal_sends_becomes_keys(sent, keys):
    assert keys_of(sent) == keys
