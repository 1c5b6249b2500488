"""The network in a terminal: a lattice of TRAMs with lines between them, or the tree of routes from the root."""

from collections.abc import Iterable, Iterator, Mapping

from tramnet_master.layout import Cell, lattice
from tramnet_protocol.messages import ROOT
from tramnet_protocol.shapes import Edge
from tramnet_protocol.topology import Graph

LARGEST = 80
"""TRAMs that can be read in a terminal."""


def sketch(topology: str, graph: Graph) -> str:
    """Return a drawing of a network in characters.

    Args:
        topology: Name of its shape.
        graph: Its links.
    """
    if len(graph.seats) > LARGEST:
        return f"({len(graph.seats)} TRAMs are too many for a terminal)"
    cells = lattice(topology, graph.seats)
    return "\n".join(_outline(graph) if cells is None else _Board(cells).draw(graph.edges))


def _outline(graph: Graph) -> list[str]:
    """Draw the routes from the root as a tree; a TRAM's other links stand behind it."""
    before = graph.predecessors(ROOT)
    children: dict[int, list[int]] = {seat: [] for seat in graph.seats}
    for seat, parent in before.items():
        children[parent].append(seat)

    def others(seat: int) -> str:
        known = {before.get(seat), *children[seat]}
        extra = [f"{other}" for other in graph.neighbours[seat] if other not in known]
        return f"   also to {', '.join(extra)}" if extra else ""

    def below(seat: int, lead: str) -> Iterator[str]:
        for child in children[seat]:
            is_last = child == children[seat][-1]
            yield f"{lead}{'└── ' if is_last else '├── '}{child}{others(child)}"
            yield from below(child, lead + ("    " if is_last else "│   "))

    return [f"{ROOT}{others(ROOT)}", *below(ROOT, "")]


class _Board:
    """Characters on which a lattice is drawn.

    Args:
        cells: Where the TRAMs stand.
    """

    def __init__(self, cells: Mapping[int, Cell]) -> None:
        self._cells = cells
        self._taken = frozenset(cells.values())
        self._width = max(len(str(seat)) for seat in cells) + 2
        self._step = self._width + 2
        rows = max(cell.row for cell in cells.values()) + 1
        columns = max(cell.column for cell in cells.values()) + 1
        self._lines = [[" "] * (columns * self._step + 4) for _ in range(2 * rows + 1)]

    def draw(self, edges: Iterable[Edge]) -> list[str]:
        """Return the lines of the drawing; a link that goes around ends in a dashed stub at both TRAMs."""
        for seat, cell in self._cells.items():
            line, column = self._at(cell)
            self._put(line, column, f"[{seat}]".center(self._width))
        around = [edge for edge in edges if not self._join(*(self._cells[seat] for seat in edge))]
        lines = ["".join(line).rstrip() for line in self._lines]
        drawn = [line for line in lines if line]
        if around:
            drawn.append("┄ ┆ go around: " + ", ".join(f"{low}-{high}" for low, high in around))
        return drawn

    def _at(self, cell: Cell) -> tuple[int, int]:
        return 2 * cell.row + 1, cell.column * self._step + 2

    def _put(self, line: int, column: int, text: str) -> None:
        self._lines[line][column : column + len(text)] = text

    def _join(self, one: Cell, other: Cell) -> bool:
        """Draw a link; return whether it could be drawn straight."""
        first, last = sorted((one, other))
        (line, column), (end_line, end_column) = self._at(first), self._at(last)
        if first.row == last.row:
            between = {Cell(first.row, c) for c in range(first.column + 1, last.column)}
            if self._taken.isdisjoint(between):
                self._rule(line, column + 1, end_column + self._width - 1)
                return True
            self._put(line, column - 2, "┄┄")
            self._put(line, end_column + self._width, "┄┄")
        elif first.column == last.column:
            middle = column + (self._width - 1) // 2
            if self._taken.isdisjoint(
                Cell(r, first.column) for r in range(first.row + 1, last.row)
            ):
                for row in range(line + 1, end_line):
                    self._put(row, middle, "│")
                return True
            self._put(line - 1, middle, "┆")
            self._put(end_line + 1, middle, "┆")
        return False

    def _rule(self, line: int, first: int, last: int) -> None:
        """Draw a line where there is nothing between two TRAMs."""
        text = self._lines[line]
        inner = range(text.index("]", first) + 1, last)
        for column in inner:
            if text[column] == "[":
                return
            text[column] = "─"
