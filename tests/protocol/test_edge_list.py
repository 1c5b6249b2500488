import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.edge_list import edge_list_shape
from tramnet_protocol.errors import BadTopology
from tramnet_protocol.limits import MAX_SEATS
from tramnet_protocol.topology import links_of

SQUARE = [(0, 1), (1, 2), (2, 3), (3, 0)]


@st.composite
def edge_lists(draw):
    """Links a user could write: any seats, grown from the root, within everybody's links."""
    links: set[frozenset[int]] = set()
    spare = {0: links_of(0)}
    for seat in draw(st.lists(st.integers(1, 40), max_size=25)):
        hosts = sorted(s for s in spare if spare[s] and s != seat)
        host = draw(st.sampled_from(hosts))
        if frozenset((seat, host)) in links or spare.setdefault(seat, links_of(seat)) == 0:
            continue
        links.add(frozenset((seat, host)))
        spare[seat] -= 1
        spare[host] -= 1
    return [tuple(link) for link in links]


@given(edge_lists(), st.sets(st.integers(1, 60), max_size=30))
def test_any_live_trams_are_joined_within_their_links_and_by_all_links_of_the_list(links, workers):
    live = {0} | workers

    graph = edge_list_shape("own", links).connect(live)

    assert set(graph.distances(0)) == live
    assert {(min(link), max(link)) for link in links if live.issuperset(link)} <= set(graph.edges)
    assert all(len(others) <= links_of(seat) for seat, others in graph.neighbours.items())


@given(edge_lists())
def test_the_trams_of_the_list_are_joined_by_the_list_alone(links):
    seats = {0} | {seat for link in links for seat in link}

    graph = edge_list_shape("own", links).connect(seats)

    assert set(graph.edges) == {(min(link), max(link)) for link in links}


def test_a_part_that_is_cut_off_is_attached_by_its_lowest_tram_to_the_lowest_with_a_link():
    shape = edge_list_shape("line", [(0, 1), (1, 2), (2, 3), (3, 4)])

    assert shape.connect([0, 1, 3, 4]).edges == ((0, 1), (0, 3), (3, 4))


def test_trams_the_list_does_not_know_are_attached_where_links_are_left():
    shape = edge_list_shape("square", SQUARE)

    assert set(shape.connect([0, 1, 2, 3, 7, 9, 11]).edges) == {
        (0, 1), (1, 2), (2, 3), (0, 3), (0, 7), (1, 9), (1, 11),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("links", "words"),
    [
        ([(0, 1), (0, 2), (0, 3), (0, 4)], "4 links at TRAM 0; it has 3; its fourth is the host's"),
        ([(0, 1), *((1, i) for i in (2, 3, 4, 5))], "5 links at TRAM 1; it has 4"),
        ([(0, 1), (2, 3)], "no way from the root to TRAM 2, 3; add a link to it"),
        ([(0, 1), (1, 0)], r"the link \[1, 0\] twice"),
        ([(0, 1), (2, 2)], r"the link \(2, 2\)"),
        ([(0, MAX_SEATS)], f"found TRAM {MAX_SEATS} in a link"),
        ([(0, -1)], "found TRAM -1 in a link"),
    ],
)
def test_links_that_cannot_be_laid_are_refused_with_the_tram(links, words):
    with pytest.raises(BadTopology, match=words):
        edge_list_shape("own", links)
