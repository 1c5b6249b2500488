import dataclasses
import math
import re

import pytest

from tramnet_master.cli import run
from tramnet_master.errors import InvalidFile
from tramnet_master.experiments.run_options import RunOptions, read_options
from tramnet_master.layout import around_the_root, circle, lattice
from tramnet_master.sketch import sketch
from tramnet_master.topologies import find_shape
from tramnet_protocol.topology import SHAPES, connect


@pytest.fixture
def links_file(tmp_path):
    def write(text):
        path = tmp_path / "own.toml"
        path.write_text(text)
        return str(path)

    return write


def test_a_file_of_links_is_a_shape(links_file):
    shape = find_shape(links_file("links = [[0, 1], [2, 1], [0, 2]]"))

    assert shape.name == "own.toml"
    assert shape.connect([0, 1, 2]).edges == ((0, 1), (0, 2), (1, 2))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("links = [[0, 1], [1, 'x']]", r'links\[1\]\[1\]: found "x"'),
        ("links = []", "pairs of seats such as"),
        ("edges = [[0, 1]]", "did you mean|one of links"),
        ("links = [[0, 1], [2, 3]]", "no way from the root to TRAM 2, 3"),
        ("links = [[0, 1], [0, 2], [0, 3], [0, 4]]", "4 links at TRAM 0; it has 3"),
    ],
)
def test_a_file_that_is_no_network_is_refused_with_what_is_wrong(links_file, text, words):
    with pytest.raises(InvalidFile, match=words):
        find_shape(links_file(text))


@pytest.mark.parametrize("topology", sorted(SHAPES))
@pytest.mark.parametrize("n", [1, 2, 3, 5, 14, 16, 41])
def test_a_sketch_shows_every_tram_once(topology, n):
    n = min(n, SHAPES[topology].max_trams)

    drawn = re.sub(
        r".* go around: .*|   also to .*", "", sketch(topology, connect(topology, range(n)))
    )

    assert sorted(map(int, re.findall(r"\d+", drawn))) == list(range(n))


def test_a_sketch_joins_what_is_linked():
    assert sketch("ring", connect("ring", range(5))).splitlines() == [
        "  [0]──[1]──[2]",
        "   │         │",
        "  [4]───────[3]",
    ]
    assert sketch("tree", connect("tree", range(6))).splitlines() == [
        "0",
        "├── 1",
        "│   ├── 4",
        "│   └── 5",
        "├── 2",
        "└── 3",
    ]


@pytest.mark.parametrize("topology", sorted(SHAPES))
@pytest.mark.parametrize("n", [2, 9, 13, 16, 40])
def test_no_two_trams_stand_in_one_place(topology, n):
    graph = connect(topology, range(min(n, SHAPES[topology].max_trams)))

    cells = lattice(topology, graph.seats)
    for places in (cells or {}, circle(graph.seats), around_the_root(graph)):
        points = list(places.values())
        assert all(
            math.dist(one, other) > 0.5 for i, one in enumerate(points) for other in points[:i]
        )


def test_the_command_prints_what_a_shape_costs_and_draws_it(tmp_path, capsys):
    assert run(["topology", "torus", "--workers", "15", "--out", str(tmp_path)]) == 0

    said = capsys.readouterr().out
    assert "31 links" in said
    assert "2.2667 hops from the root, 2.1500 over all pairs" in said
    assert "<svg" in (tmp_path / "topology-torus-15.svg").read_text()


def test_a_cube_that_is_too_large_is_refused(capsys):
    assert run(["topology", "hypercube", "--workers", "16"]) == 2
    assert "use torus" in capsys.readouterr().err


def test_a_run_is_gone_on_with_by_the_links_it_began_with(links_file, tmp_path):
    topology = links_file("links = [[0, 1], [1, 2]]")
    farm = {**dataclasses.asdict(RunOptions(topology=topology)), "links": [[0, 2], [2, 1]]}

    options = read_options(tmp_path / "run.toml", {"farm": farm}, workers=None)

    assert options.shape().name == "own.toml"
    assert options.shape().connect([0, 1, 2]).edges == ((0, 2), (1, 2))
