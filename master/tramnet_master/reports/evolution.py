"""How populations evolved, like figures 9 and 10 of Kim & Khosla (1992)."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tramnet_master.populations import Populations
from tramnet_master.progress import plural
from tramnet_master.reports.design_record import DesignRecord
from tramnet_master.reports.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    legend_below,
    new_figure,
)

Floats = NDArray[np.float64]

HEIGHT = 4.6  # [inch]
FEW = 8  # populations that each have a colour of their own
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, GREY, "#8c564b")
STAGES = {1: "design", 2: "prototype", 3: "planning"}
_FIRST = 20  # generations whose fitness may be too low to show: random arms miss every constraint


def draw_fitness(record: DesignRecord) -> Figure:
    """Best fitness of each population against the generation, a panel a search."""
    searches = record.last_round()
    figure = new_figure(HEIGHT, "Best fitness of each population", _caption(record))
    grid = figure.add_gridspec(1, len(searches), width_ratios=_widths(searches))
    panels = []
    for i, search in enumerate(searches):
        axes = figure.add_subplot(grid[i])
        panels.append(axes)
        _draw_curves(axes, search.generations, search.best)
        settled = search.best[min(_FIRST, len(search.best) - 1) :]
        low, high = float(settled.min()), float(search.best.max())
        room = 0.06 * max(high - low, 1e-3)
        axes.set_ylim(low - room, high + room)
        _name(axes, search, len(searches))
    panels[0].set_ylabel("fitness of the best individual")
    legend_below(figure, panels)
    return figure


def draw_total_length(record: DesignRecord) -> Figure:
    """Total link length of the best individual of each population against the generation, in step 1."""
    search = record.last_round()[0]
    figure = new_figure(HEIGHT, "Total link length of each population's best arm", _caption(record))
    axes = figure.add_subplot()
    _draw_curves(axes, search.generations, search.total_length)
    _name(axes, search, 1)
    apart = 1e3 * float(np.ptp(search.total_length[-1]))
    if search.total_length.shape[1] > 1:
        axes.set_title(f"at the end {apart:.3g} mm apart", loc="right", color=GREY, fontsize=9)
    axes.set_ylabel("total link length [m]")
    axes.margins(y=0.06)
    legend_below(figure, [axes])
    return figure


def _draw_curves(axes: Axes, generations: Floats, values: Floats) -> None:
    """A curve a population, or of many their median between the least and the largest."""
    t = values.shape[1]
    if t <= FEW:
        for i in range(t):
            name = f"point {i + 1}" if t > 1 else "population"
            axes.plot(generations, values[:, i], color=COLOURS[i], linewidth=1.2, label=name)
        return
    for i in range(t):
        axes.plot(generations, values[:, i], color=SKY, linewidth=0.5, alpha=0.5)
    axes.plot([], [], color=SKY, linewidth=1.0, label="each population")
    axes.plot(generations, np.median(values, axis=1), color=BLUE, label="median")


def _name(axes: Axes, search: Populations, panels: int) -> None:
    if panels > 1:
        t = search.best.shape[1]
        axes.set_title(f"{STAGES[search.stage]}, {t} {plural('population', t)}", fontsize=9)
    axes.set_xlabel("generation")
    axes.margins(x=0.01)


def _widths(searches: list[Populations]) -> list[float]:
    """Wider panels for searches of more generations, but none too narrow to read."""
    longest = max(search.generations[-1] for search in searches)
    return [max(float(search.generations[-1] / longest), 0.55) for search in searches]


def _caption(record: DesignRecord) -> str:
    returns = int(record.found.number("returns") or 0)
    if not returns:
        return record.found.caption
    return (
        f"{record.found.caption}  ·  after {returns} return{'s' if returns > 1 else ''} to step 1"
    )
