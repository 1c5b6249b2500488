"""The command that shows a shape of the network before anything runs."""

from pathlib import Path
from typing import Annotated

import typer

from tramnet_master.console import programs
from tramnet_master.sketch import sketch
from tramnet_master.topologies import find_shape
from tramnet_protocol.measures import Measures, measure
from tramnet_protocol.topology import Graph

ShapeName = Annotated[
    str,
    typer.Argument(
        metavar="SHAPE",
        help="star, pipeline, ring, tree, grid, torus, hypercube, or a file of links LINKS.toml.",
    ),
]
Workers = Annotated[int, typer.Option(min=0, max=4094, help="Workers besides the root.")]
Out = Annotated[
    Path | None,
    typer.Option(help="Folder of topology-SHAPE-WORKERS.svg and .png; here if omitted."),
]


def topology(shape: ShapeName, workers: Workers = 13, out: Out = None) -> None:
    """Draw a shape of the network, here and as SVG and PNG, with what it costs."""
    found = find_shape(shape)
    graph = found.connect(range(workers + 1))
    measures = measure(graph)
    programs.print(_summary(found.name, measures, _busiest(graph), found.virtual), highlight=False)
    programs.print(sketch(found.name, graph), markup=False)
    from tramnet_master.reports.network import draw_network  # noqa: PLC0415  slow to import
    from tramnet_master.reports.style import one_look, save  # noqa: PLC0415

    with one_look():
        figure = draw_network(found.name, graph, measures)
        name = f"topology-{Path(found.name).stem}-{workers}"
        written = save(figure, out or Path(), name)
    programs.print(f"\nwrote {written[1]} and {written[0]}", markup=False)


def _summary(name: str, measures: Measures, busiest: int, virtual: bool) -> str:
    crossbar = " (virtual: as a crossbar of switches would offer)" if virtual else ""
    return (
        f"{name}: the root and {measures.trams - 1} workers, {measures.links} links{crossbar}\n"
        f"degree    {measures.degree} at TRAM {busiest}\n"
        f"diameter  {measures.diameter} hops\n"
        f"mean      {measures.mean_from_root:.4f} hops from the root, {measures.mean:.4f} over all pairs\n"
    )


def _busiest(graph: Graph) -> int:
    return max(graph.seats, key=lambda seat: (len(graph.neighbours[seat]), -seat))
