from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.errors import BadTopology
from tramnet_protocol.limits import MAX_SEATS
from tramnet_protocol.messages import Wiring
from tramnet_protocol.topology import Graph, connect, graph_of, lowest_free_seat, rewire


@st.composite
def graphs(draw):
    seats = sorted(draw(st.sets(st.integers(0, 40), min_size=1, max_size=12)))
    pairs = list(combinations(seats, 2))
    edges = draw(st.sets(st.sampled_from(pairs))) if pairs else set()
    return Graph.of(seats, edges)


def mean_hops(graph, sources):
    hops = [d for source in sources for d in graph.distances(source).values() if d]
    return sum(hops) / len(hops)


def grid(side, torus=False):
    def at(row, column):
        return row % side * side + column % side

    last = side if torus else side - 1
    down = [(at(r, c), at(r + 1, c)) for r in range(last) for c in range(side)]
    right = [(at(r, c), at(r, c + 1)) for r in range(side) for c in range(last)]
    return down + right


def tree(n, arity):
    return [((child - 1) // arity, child) for child in range(1, n)]


def cube(dimensions):
    n = 2**dimensions
    return [
        (a, a ^ bit) for a in range(n) for bit in (2**d for d in range(dimensions)) if a < a ^ bit
    ]


PETERSEN = [(i, (i + 1) % 5) for i in range(5)] + [(i, i + 5) for i in range(5)]
PETERSEN += [(5 + i, 5 + (i + 2) % 5) for i in range(5)]

# facts: breadth-first search over the uncut graphs (INMOS-era shapes)
SHAPES = [
    ("pipeline", 16, tree(16, 1), 2, 15, 8.0000, 5.6667, 15),
    ("ring", 16, [(i, (i + 1) % 16) for i in range(16)], 2, 8, 4.2667, 4.2667, 16),
    ("binary tree", 16, tree(16, 2), 3, 7, 2.5333, 3.6667, 15),
    ("ternary tree", 16, tree(16, 3), 4, 5, 2.0000, 3.1000, 15),
    ("4x4 grid", 16, grid(4), 4, 6, 3.2000, 2.6667, 24),
    ("4x4 torus", 16, grid(4, torus=True), 4, 4, 2.1333, 2.1333, 32),
    ("4-cube", 16, cube(4), 4, 4, 2.1333, 2.1333, 32),
    ("3-cube", 8, cube(3), 3, 3, 1.7143, 1.7143, 12),
    ("Petersen", 10, PETERSEN, 3, 2, 1.6667, 1.6667, 15),
    ("star of 3", 4, [(0, 1), (0, 2), (0, 3)], 3, 2, 1.0000, 1.5000, 3),
]


@pytest.mark.parametrize(
    ("n", "edges", "degree", "diameter", "from_root", "all_pairs", "links"),
    [shape[1:] for shape in SHAPES],
    ids=[shape[0] for shape in SHAPES],
)
def test_known_shapes_have_their_known_distances(
    n, edges, degree, diameter, from_root, all_pairs, links
):
    graph = Graph.of(range(n), edges)

    assert len(graph.edges) == links
    assert max(map(len, graph.neighbours.values())) == degree
    assert max(max(graph.distances(seat).values()) for seat in graph.seats) == diameter
    assert mean_hops(graph, [0]) == pytest.approx(from_root, abs=5e-5)
    assert mean_hops(graph, graph.seats) == pytest.approx(all_pairs, abs=5e-5)


@given(graphs())
def test_every_next_hop_is_a_neighbour_one_step_nearer_and_the_lowest_such(graph):
    for source in graph.seats:
        distances = graph.distances(source)
        hops = graph.next_hops(source)
        assert set(hops) == set(distances) - {source}
        for destination, hop in hops.items():
            nearer = [
                seat
                for seat in graph.neighbours[source]
                if graph.distances(seat).get(destination) == distances[destination] - 1
            ]
            assert hop == min(nearer)


@given(graphs(), st.data())
def test_a_route_passes_as_many_links_as_the_distance(graph, data):
    source = data.draw(st.sampled_from(graph.seats))
    for destination, hops in graph.distances(source).items():
        route = graph.route(source, destination)
        assert len(route) == hops + 1
        assert (route[0], route[-1]) == (source, destination)


def test_there_is_no_route_to_a_tram_without_links():
    with pytest.raises(BadTopology, match="no way from TRAM 0 to TRAM 2"):
        Graph.of([0, 1, 2], [(0, 1)]).route(0, 2)


@given(st.sets(st.integers(1, MAX_SEATS - 1), max_size=30))
def test_a_star_joins_every_worker_to_the_root_in_one_hop(workers):
    graph = connect("star", {0} | workers)

    assert graph.edges == tuple((0, worker) for worker in sorted(workers))
    assert graph.next_hops(0) == {worker: worker for worker in workers}


def test_more_links_than_a_tram_has_are_refused():
    Graph.of(range(4), [(0, 1), (0, 2), (0, 3)]).check_links()

    with pytest.raises(BadTopology, match="4 links at TRAM 0; it has 3"):
        Graph.of(range(5), [(0, i) for i in range(1, 5)]).check_links()
    with pytest.raises(BadTopology, match="5 links at TRAM 1; it has 4"):
        Graph.of(range(6), [(1, i) for i in (0, 2, 3, 4, 5)]).check_links()


@pytest.mark.parametrize(
    ("topology", "seats", "words"),
    [("stair", {0, 1}, "expected one of star"), ("star", {1, 2}, "without the root")],
)
def test_trams_that_cannot_be_joined_are_refused(topology, seats, words):
    with pytest.raises(BadTopology, match=words):
        connect(topology, seats)


def test_links_to_nowhere_are_refused():
    with pytest.raises(BadTopology, match=r"\(0, 2\)"):
        graph_of(Wiring(1, "star", {0: 1, 1: 1}, ((0, 2),)))
    with pytest.raises(BadTopology, match=r"\(1, 1\)"):
        Graph.of([0, 1], [(1, 1)])


def test_a_wiring_names_the_live_trams_and_their_links():
    wiring = rewire("star", {0: 5, 3: 1, 1: 2}, epoch=7)

    assert wiring == Wiring(7, "star", {0: 5, 3: 1, 1: 2}, ((0, 1), (0, 3)))
    assert graph_of(wiring) == connect("star", {0, 1, 3})


@given(st.sets(st.integers(0, 60)))
def test_a_worker_takes_the_lowest_free_seat(taken):
    seat = lowest_free_seat(taken)

    assert seat >= 1
    assert seat not in taken
    assert set(range(1, seat)) <= taken


def test_a_network_can_be_full():
    with pytest.raises(BadTopology, match="remove a worker"):
        lowest_free_seat(range(MAX_SEATS))
