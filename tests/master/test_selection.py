import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.errors import InvalidOption
from tramnet_master.traffic.rows import LinkRow, TramRow
from tramnet_master.traffic.selection import COLUMNS, Selection, parse_filter, parse_sort

TRAM = TramRow(0, 1, "a", 7, "idle", 0, 0, 0.0, 0.0, 1.0, 0.0, 0, 0.1)
LINK = LinkRow("link/0/1", 0, 1, 0, 0, 0.0, 0.0, 0.0, 0.0, 0, 0, 0)
TRAMS = [
    msgspec.structs.replace(TRAM, seat=seat, host=host, state=state, busy=busy)
    for seat, host, state, busy in (
        (0, "hal", "running", 0.1), (1, "hal", "busy", 0.9), (2, "deep-thought", "idle", 0.4),
    )
]  # fmt: skip
LINKS = [
    msgspec.structs.replace(LINK, link=f"link/{a}/{b}", source=a, destination=b, bytes_per_s=rate)
    for a, b, rate in ((0, 1, 2e6), (0, 2, 5e5), (1, 0, 1e3), (2, 0, 0.0))
]


def seats(text):
    return [row.seat for row in Selection(parse_filter(text)).of(TRAMS)]


def links(text):
    return [row.link for row in Selection(parse_filter(text)).of(LINKS)]


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("", [0, 1, 2]),
        ("busy>30%", [1, 2]),
        ("busy<=0.4", [0, 2]),
        ("state=busy", [1]),
        ("state!=busy", [0, 2]),
        ("tram=2", [2]),
        ("seat>=1 busy<50%", [2]),
        ("hal", [0, 1]),
        ("host=deep*", [2]),
        ("nobody", []),
        ("bytes_per_s>1e6", [0, 1, 2]),
    ],
)
def test_a_filter_keeps_the_rows_for_which_all_its_words_hold(text, kept):
    assert seats(text) == kept


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("tram=1", ["link/0/1", "link/1/0"]),
        ("tram!=1", ["link/0/2", "link/2/0"]),
        ("link/0", ["link/0/1", "link/0/2"]),
        ("link=link/*/0", ["link/1/0", "link/2/0"]),
        ("bytes_per_s>=500k", ["link/0/1", "link/0/2"]),
        ("state=busy", ["link/0/1", "link/0/2", "link/1/0", "link/2/0"]),
    ],
)
def test_links_are_filtered_by_the_trams_at_their_ends(text, kept):
    assert links(text) == kept


@pytest.mark.parametrize("text", ["speed>3", "busy>fast", "busy<=%"])
def test_a_filter_that_cannot_hold_is_refused(text):
    with pytest.raises(InvalidOption, match="--filter"):
        parse_filter(text)


@given(st.text(max_size=20))
def test_any_text_is_a_filter_or_is_refused(text):
    try:
        terms = parse_filter(text)
    except InvalidOption:
        return
    assert set(Selection(terms).of(LINKS)) <= set(LINKS)


def test_numbers_come_largest_first_and_names_smallest_first():
    assert [row.seat for row in Selection(sort="busy").of(TRAMS)] == [1, 2, 0]
    assert [row.seat for row in Selection(sort="busy", reverse=True).of(TRAMS)] == [0, 2, 1]
    assert [row.seat for row in Selection(sort="host").of(TRAMS)] == [2, 0, 1]
    assert [row.seat for row in Selection(sort="seat").of(reversed(TRAMS))] == [0, 1, 2]


@given(st.sampled_from(sorted(COLUMNS)), st.booleans())
def test_sorting_neither_loses_nor_invents_rows(column, reverse):
    found = Selection(sort=parse_sort(column), reverse=reverse).of(LINKS)

    assert sorted(row.link for row in found) == sorted(row.link for row in LINKS)


def test_a_column_that_no_table_has_is_refused():
    with pytest.raises(InvalidOption, match="bytes_per_s"):
        parse_sort("speed")
