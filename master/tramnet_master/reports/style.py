"""One look for all figures: colours that colour-blind readers can tell, room for titles, fixed output.

The palette is Okabe & Ito's ("Color Universal Design", 2008). A colour means the same in every figure, and a line
style says it again, so that a print in grey still reads.
"""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from tramnet_master.files import write_atomically

BLUE, VERMILION, GREEN, ORANGE = "#0072B2", "#D55E00", "#009E73", "#E69F00"
SKY, PURPLE, BLACK, GREY = "#56B4E9", "#CC79A7", "#000000", "#606060"

PLAN, LINE, LIMIT, BOUND, SERVO, PAPER = BLUE, VERMILION, BLACK, GREY, GREEN, PURPLE

WIDTH = 9.0  # of every figure [inch]
DPI = 120

STYLE: dict[Any, Any] = {  # the keys matplotlib knows differ between its versions
    "axes.axisbelow": True,
    "axes.edgecolor": "#404040",
    "axes.grid": True,
    "axes.labelsize": 10,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "figure.dpi": DPI,
    "figure.facecolor": "white",
    "font.family": "DejaVu Sans",  # comes with matplotlib, so that every machine draws the same
    "font.size": 10,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.8,
    "legend.frameon": False,
    "legend.fontsize": 10,
    "lines.linewidth": 1.8,
    "savefig.dpi": DPI,
    "svg.hashsalt": "tramnet",
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
}


HEAD = 0.62  # room for title and caption [inch]
NAMES_WIDE, NAME_EXTRA = 110, 9  # letters in a row of a legend, and those that a handle stands for


@contextmanager
def one_look() -> Iterator[None]:
    """Draw in our style, whatever the user's own settings of matplotlib say."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        yield


def new_figure(height: float, title: str, caption: str) -> Figure:
    """An empty figure with a title and, below it, a line that says what ran.

    Args:
        height: Its height, head included [inch].
        title: What it shows.
        caption: What ran.
    """
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(rect=(0.0, 0.0, 1.0, 1.0 - HEAD / height), w_pad=0.1, h_pad=0.08)
    left = 0.12 / WIDTH
    figure.text(left, 1 - 0.12 / height, title, va="top", fontsize=13, fontweight="bold")
    figure.text(left, 1 - 0.38 / height, caption, va="top", color="#505050")
    return figure


def joint_axes(
    figure: Figure | SubFigure, n_joints: int, unit: str, along: str = "time [s]"
) -> list[Axes]:
    """A panel a joint, in rows of at most three or, for many joints, four.

    Args:
        figure: Where to put them.
        n_joints: Number of joints.
        unit: What stands at the outer y axes.
        along: What stands at the outer x axes.

    Returns:
        The panels, from base to tip.
    """
    columns = columns_for(n_joints)
    grid = figure.add_gridspec(rows_for(n_joints), columns)
    axes = [figure.add_subplot(grid[divmod(i, columns)]) for i in range(n_joints)]
    for i, panel in enumerate(axes):
        panel.set_title(f"Joint {i + 1}")
        if i % columns == 0:
            panel.set_ylabel(unit)
        below = i + columns >= n_joints
        panel.set_xlabel(along if below else "")
    return axes


def columns_for(n_joints: int) -> int:
    """Panels in a row."""
    if n_joints == 4:
        return 2
    return min(n_joints, 3 if n_joints <= 6 or n_joints == 9 else 4)


def rows_for(n_joints: int) -> int:
    """Rows of panels."""
    return -(-n_joints // columns_for(n_joints))


def legend_below(figure: Figure, panels: list[Axes]) -> None:
    """Name what the panels show below them all, where it covers nothing, in rows that fit the figure."""
    named: dict[str, Artist] = {}
    for axes in panels:
        handles, names = axes.get_legend_handles_labels()
        named |= dict(zip(names, handles, strict=True))
    if len(named) > 1:
        columns = min(len(named), max(1, NAMES_WIDE // (NAME_EXTRA + max(map(len, named)))))
        if sum(NAME_EXTRA + len(name) for name in named) <= NAMES_WIDE:
            columns = len(named)
        figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=columns)


def save(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and SVG; the same figure gives the same bytes.

    Returns:
        The two files.

    Raises:
        CannotWrite: The disk refuses.
    """
    written = []
    for kind, metadata in (("png", {"Software": None}), ("svg", {"Date": None, "Creator": None})):
        picture = io.BytesIO()
        figure.savefig(picture, format=kind, metadata=metadata)
        figure.set_layout_engine("none")  # laid out once, the second file looks the same
        written.append(folder / f"{name}.{kind}")
        write_atomically(written[-1], picture.getvalue())
    return written
