from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.errors import BadTopology
from tramnet_protocol.limits import MAX_SEATS
from tramnet_protocol.measures import measure
from tramnet_protocol.messages import Wiring
from tramnet_protocol.topology import (
    SHAPES,
    Graph,
    connect,
    graph_of,
    links_of,
    lowest_free_seat,
    rewire,
    shape_named,
)


@st.composite
def graphs(draw):
    seats = sorted(draw(st.sets(st.integers(0, 40), min_size=1, max_size=12)))
    pairs = list(combinations(seats, 2))
    edges = draw(st.sets(st.sampled_from(pairs))) if pairs else set()
    return Graph.of(seats, edges)


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
UNCUT = [
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
    [shape[1:] for shape in UNCUT],
    ids=[shape[0] for shape in UNCUT],
)
def test_known_shapes_have_their_known_distances(
    n, edges, degree, diameter, from_root, all_pairs, links
):
    graph = Graph.of(range(n), edges)

    found = measure(graph)

    assert (found.trams, found.links) == (n, links)
    assert (found.degree, found.diameter) == (degree, diameter)
    assert found.mean_from_root == pytest.approx(from_root, abs=5e-5)
    assert found.mean == pytest.approx(all_pairs, abs=5e-5)


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


@given(graphs())
def test_one_search_finds_all_routes_from_a_tram_and_all_routes_to_it(graph):
    for seat in graph.seats:
        before, onward = graph.predecessors(seat), graph.hops_towards(seat)
        assert set(before) == set(onward) == set(graph.distances(seat)) - {seat}
        for other in before:
            way = [other]
            while way[-1] != seat:
                way.append(before[way[-1]])
            assert tuple(reversed(way)) == graph.route(seat, other)
            assert onward[other] == graph.next_hops(other)[seat]


@given(graphs())
def test_measures_agree_with_distances_one_by_one(graph):
    live = sorted(graph.distances(graph.seats[0]))
    connected = Graph.of(
        range(len(live)),
        [(live.index(a), live.index(b)) for a, b in graph.edges if a in live],
    )
    hops = [d for seat in connected.seats for d in connected.distances(seat).values() if d]

    found = measure(connected)

    assert found.diameter == max(hops, default=0)
    assert found.mean == pytest.approx(sum(hops) / max(1, len(hops)))


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


REAL = sorted(set(SHAPES) - {"star"})


@pytest.mark.parametrize("topology", REAL)
def test_every_shape_joins_every_number_of_trams_within_their_links(topology):
    most = min(65, SHAPES[topology].max_trams)
    for n in range(1, most + 1):
        graph = connect(topology, range(n))
        assert len(graph.distances(0)) == n
        assert all(len(others) <= links_of(seat) for seat, others in graph.neighbours.items())


@pytest.mark.parametrize("topology", REAL)
@given(workers=st.sets(st.integers(1, MAX_SEATS - 1), max_size=40))
def test_every_shape_joins_any_live_seats(topology, workers):
    seats = {0, *sorted(workers)[: SHAPES[topology].max_trams - 1]}

    graph = connect(topology, seats)

    assert set(graph.distances(0)) == seats
    assert all(len(others) <= links_of(seat) for seat, others in graph.neighbours.items())


@pytest.mark.parametrize("topology", ["torus", "hypercube"])
def test_a_torus_and_a_cube_of_16_give_one_link_of_the_root_to_the_host(topology):
    found = measure(connect(topology, range(16)))

    assert (found.links, found.degree, found.diameter) == (31, 4, 4)
    assert found.mean_from_root == pytest.approx(2.2667, abs=5e-5)
    assert found.mean == pytest.approx(2.1500, abs=5e-5)


@pytest.mark.parametrize(
    ("topology", "n", "degree", "diameter", "from_root", "all_pairs", "links"),
    [
        ("pipeline", 17, 2, 16, 8.5000, 6.0000, 16),
        ("tree", 17, 4, 5, 2.0625, 3.1912, 16),
        ("tree", 16, 4, 5, 2.0000, 3.1000, 15),
        ("ring", 16, 2, 8, 4.2667, 4.2667, 16),
        ("grid", 16, 4, 6, 3.2000, 2.6667, 24),
        ("hypercube", 8, 3, 3, 1.7143, 1.7143, 12),
        ("star", 4, 3, 2, 1.0000, 1.5000, 3),
    ],
)
def test_our_shapes_are_those_of_the_literature(
    topology, n, degree, diameter, from_root, all_pairs, links
):
    found = measure(connect(topology, range(n)))

    assert found[:4] == (n, links, degree, diameter)
    assert found.mean_from_root == pytest.approx(from_root, abs=5e-5)
    assert found.mean == pytest.approx(all_pairs, abs=5e-5)


def test_a_hypercube_of_more_than_fifteen_workers_is_a_torus():
    with pytest.raises(BadTopology, match=r"found 16 workers; .* at most 15; use torus"):
        connect("hypercube", range(17))


def test_the_largest_network_is_joined_in_a_moment():
    for topology in set(REAL) - {"hypercube"}:
        graph = connect(topology, range(MAX_SEATS))
        assert len(graph.next_hops(0)) == len(graph.hops_towards(0)) == MAX_SEATS - 1


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
    wiring = rewire(shape_named("star"), {0: 5, 3: 1, 1: 2}, epoch=7)

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
