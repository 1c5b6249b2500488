"""The objective against the generation, like figure 6 of Wang & Zalzala (1995)."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from numpy.typing import NDArray

from tramnet_master.reports.record import RunRecord
from tramnet_master.reports.style import (
    ORANGE,
    PAPER,
    PLAN,
    SKY,
    legend_below,
    new_figure,
)

Array = NDArray[np.float64]

HEIGHT = 4.8  # [inch]
MOST_POINTS = 1500  # a curve of more is drawn from blocks of generations
TIME_CASES = (1, 2, 7)  # whose objective is the motion time that the paper states
WIDE = 4.0  # ratio of largest to least from which the axis is logarithmic


def draw_objective(record: RunRecord) -> Figure:
    """Best so far, and best and mean of each generation."""
    history = record.history
    figure = new_figure(HEIGHT, "Objective against generation", _caption(record))
    axes = figure.add_subplot()
    generation = history["generation"]
    size = -(-len(generation) // MOST_POINTS)
    at = _blocks(generation, size, np.max)
    mean, best = _blocks(history["mean"], size, np.mean), _blocks(history["best"], size, np.min)
    of = "of a generation" if size == 1 else f"of {size} generations"
    axes.plot(at, mean, color=ORANGE, linewidth=1.0, label=f"mean {of}")
    axes.plot(at, best, color=SKY, linewidth=1.0, label=f"best {of}")
    so_far = _blocks(history["best_so_far"], size, np.min)
    axes.step(at, so_far, where="post", color=PLAN, linewidth=2.2, label="best so far")
    paper = record.found.number("paper")
    if paper is not None and record.found.number("case") in TIME_CASES:
        axes.axhline(paper, color=PAPER, linestyle="--", linewidth=1.3, label=f"paper: {paper:g}")
    _scale(axes, [mean, best, so_far])
    axes.set_xlabel("generation")
    axes.set_ylabel("objective")
    axes.margins(x=0.01)
    legend_below(figure, [axes])
    return figure


def _caption(record: RunRecord) -> str:
    best = record.found.table("best")
    if best.get("objective") is None:
        return record.found.caption
    found = f"best {best['objective']:.4f}, first in generation {best['generation']}"
    return f"{record.found.caption}  ·  {found}"


def _blocks(values: Array, size: int, reduce: Callable[[Array], np.float64]) -> Array:
    """``values`` reduced in blocks of ``size``, infinite objectives left out."""
    finite = np.where(np.isfinite(values), values, np.nan)
    blocks = (finite[first : first + size] for first in range(0, len(finite), size))
    kept = (block[~np.isnan(block)] for block in blocks)
    return np.array([reduce(block) if len(block) else np.nan for block in kept])


def _scale(axes: Axes, curves: list[Array]) -> None:
    """A logarithmic axis where the curves differ by more than a linear one can show."""
    values = np.concatenate(curves)
    values = values[np.isfinite(values)]
    if len(values) and values.min() > 0.0 and values.max() > WIDE * values.min():
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
