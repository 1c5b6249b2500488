"""A picture of a network: TRAMs and links, those of a torus or cube that go around as arcs."""

import math
from collections.abc import Mapping
from itertools import pairwise

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

from tramnet_master.layout import Point, around_the_root, circle, lattice
from tramnet_master.reports.style import BLUE, GREY, VERMILION, WIDTH, new_figure
from tramnet_protocol.measures import Measures
from tramnet_protocol.messages import ROOT
from tramnet_protocol.topology import Graph

TALLEST = 8.5  # of a figure [inch]
LEAST = 2.4  # [inch]
MOST_LABELS = 300
DISC = 0.62  # diameter of a TRAM, in distances between neighbours
HOST = 0.8  # of the host from the root, in distances between neighbours
LEAST_ROOM = 0.7  # between two links of the root for a third one [rad]


def draw_network(topology: str, graph: Graph, measures: Measures) -> Figure:
    """Draw a network.

    Args:
        topology: Name of its shape.
        graph: Its links.
        measures: What the caption says.
    """
    places = _places(topology, graph)
    spread = [
        max(p[i] for p in places.values()) - min(p[i] for p in places.values()) for i in (0, 1)
    ]
    width, depth = spread[0] + 2.2, spread[1] + 2.0
    unit = min(
        (WIDTH - 0.4) / width, TALLEST / depth, 0.9
    )  # of a distance between neighbours [inch]
    figure = new_figure(
        max(LEAST, unit * depth) + 0.7, _title(topology, measures), caption(measures)
    )
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.invert_yaxis()
    axes.axis("off")
    around = _draw_links(axes, graph, places, topology)
    _draw_trams(axes, places, unit * 72.0)
    left, top = (min(p[i] for p in places.values()) for i in (0, 1))
    margin = 1.0 + (0.5 if around else 0.0)
    axes.set_xlim(left - margin, left + spread[0] + margin)
    axes.set_ylim(top + spread[1] + margin, top - margin)
    return figure


def caption(measures: Measures) -> str:
    """Say what a shape costs in one line."""
    return (
        f"{measures.links} links, at most {measures.degree} a TRAM; diameter {measures.diameter}; mean hops "
        f"{measures.mean_from_root:.4f} from the root, {measures.mean:.4f} over all pairs"
    )


def _title(topology: str, measures: Measures) -> str:
    return f"{topology}: the root and {measures.trams - 1} workers"


def _places(topology: str, graph: Graph) -> Mapping[int, Point]:
    if topology == "ring":
        return circle(graph.seats)
    cells = lattice(topology, graph.seats)
    if cells is None:
        return around_the_root(graph)
    return {seat: Point(float(cell.column), float(cell.row)) for seat, cell in cells.items()}


def _draw_links(
    axes: Axes, graph: Graph, places: Mapping[int, Point], topology: str
) -> list[tuple[int, int]]:
    """Draw all links; return those that go around."""
    is_lattice = topology != "ring" and lattice(topology, graph.seats) is not None
    around = [
        edge for edge in graph.edges if is_lattice and _apart(*(places[s] for s in edge)) > 1.5
    ]
    straight = [
        [places[low], places[high]] for low, high in graph.edges if (low, high) not in set(around)
    ]
    axes.add_collection(LineCollection(straight, colors=GREY, linewidths=1.6, zorder=1))
    for low, high in around:
        one, other = places[low], places[high]
        bend = 0.22 if one.x == other.x else -0.22
        arc = FancyArrowPatch(
            one, other, connectionstyle=f"arc3,rad={bend}", arrowstyle="-", color=GREY,
            linewidth=1.0, linestyle=(0, (5, 2)), zorder=0,
        )  # fmt: skip
        axes.add_patch(arc)
    _draw_host(axes, places[ROOT], [places[seat] for seat in graph.neighbours[ROOT]])
    return around


def _draw_host(axes: Axes, root: Point, others: list[Point]) -> None:
    """Draw the root's link to the host where most room is between its other links, if there is any."""
    turns = sorted(math.atan2(other.y - root.y, other.x - root.x) for other in others)
    gaps = (
        [(b - a, (a + b) / 2.0) for a, b in pairwise([*turns, turns[0] + 2.0 * math.pi])]
        if turns
        else []
    )
    room, turn = max(gaps, default=(2.0 * math.pi, -0.75 * math.pi))
    if room < LEAST_ROOM:
        return
    x, y = root.x + HOST * math.cos(turn), root.y + HOST * math.sin(turn)
    axes.plot([root.x, x], [root.y, y], color=VERMILION, linewidth=1.2, zorder=1)
    axes.text(
        x, y, "host", color=VERMILION, ha="center", va="center", fontsize=9, zorder=1,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
    )  # fmt: skip


def _apart(one: Point, other: Point) -> float:
    return abs(one.x - other.x) + abs(one.y - other.y)


def _draw_trams(axes: Axes, places: Mapping[int, Point], unit: float) -> None:
    """Draw the TRAMs, a distance between neighbours being ``unit`` [pt]."""
    size = min(unit * DISC, 26.0)
    seats = list(places)
    axes.scatter(
        [places[seat].x for seat in seats],
        [places[seat].y for seat in seats],
        s=size**2,
        c=[VERMILION if seat == ROOT else BLUE for seat in seats],
        edgecolors="white",
        linewidths=min(1.0, size / 10.0),
        zorder=2,
    )
    if len(places) <= MOST_LABELS:
        for seat, place in places.items():
            axes.text(
                *place, f"{seat}", color="white", ha="center", va="center_baseline", zorder=3,
                fontsize=min(9.0, 0.8 * size / max(1, 0.7 * len(str(seat)))),
            )  # fmt: skip
