"""The shape that ``--topology`` names: one of the known ones, or a user's own links in a TOML file.

A file of links says ``links = [[0, 1], [1, 2], [2, 0]]``: pairs of seats, the root on 0. While fewer or other TRAMs
are live than it names, ``tramnet_protocol.edge_list`` keeps the rest connected.
"""

from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct

from tramnet_master.errors import InvalidFile
from tramnet_master.strict_toml import read_strictly
from tramnet_protocol.edge_list import edge_list_shape
from tramnet_protocol.errors import BadTopology
from tramnet_protocol.topology import Shape, shape_named

_Links = Annotated[
    list[tuple[int, int]],
    Meta(min_length=1, description="pairs of seats such as [[0, 1], [1, 2]], the root on 0"),
]


class _LinksFile(Struct, frozen=True):
    links: _Links


def find_shape(topology: str) -> Shape:
    """Return the shape of a name or of a file of links.

    Raises:
        BadTopology: There is no such name.
        InvalidFile: The file cannot be read, or its links cannot be laid.
    """
    path = Path(topology)
    if path.suffix != ".toml":
        return shape_named(topology)
    links = read_strictly(path, _LinksFile).links
    try:
        return edge_list_shape(path.name, links)
    except BadTopology as error:
        expected = "at most 4 links a TRAM and 3 for the root, and a way from it to every TRAM"
        raise InvalidFile(path, "links", f"{error}".removeprefix("found "), expected) from error
