"""Speed-up and efficiency against the number of workers, as ``tramnet simulate`` predicts them."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator, PercentFormatter, StrMethodFormatter

from tramnet_master.reports.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILION,
    new_figure,
)
from tramnet_master.simulation.prediction import Prediction

HEIGHT = 4.8  # [inch]
_DENSE = 200  # points of a smooth curve


def draw_scaling(prediction: Prediction) -> Figure:
    """Two panels: speed-up, with the master-slave model beside it; efficiency and the busiest link."""
    workload = prediction.workload
    caption = f"{prediction.machine}, {prediction.topology}  ·  {workload.description}"
    figure = new_figure(HEIGHT, f"Predicted: {workload.name}", caption)
    left, right = figure.subplots(1, 2)
    _draw_speed_up(left, prediction)
    _draw_shares(right, prediction)
    for axes in (left, right):
        axes.set_xlabel("workers")
        axes.legend(loc="best")
        _powers_of_two(axes, [point.workers for point in prediction.points])
    return figure


def _draw_speed_up(axes: Axes, prediction: Prediction) -> None:
    workers = np.array([point.workers for point in prediction.points], dtype=float)
    speed_up = np.array([point.speed_up for point in prediction.points])
    axes.plot(workers, workers, color=GREY, linestyle=":", linewidth=1.2, label="ideal")
    dense = np.geomspace(workers[0], max(workers[-1], 1.01 * workers[0]), _DENSE)
    axes.plot(
        dense, _model(prediction, dense), color=ORANGE, linestyle="--", label="master-slave model"
    )
    axes.plot(workers, speed_up, color=BLUE, marker="o", markersize=4, label="speed-up")
    best = prediction.best
    label = f"best: {best.workers} workers, {best.speed_up:.3g} times"
    axes.plot(best.workers, best.speed_up, "s", color=VERMILION, markersize=9, label=label)
    axes.set_title("Speed-up over one processor alone")
    axes.set_xscale("log", base=2)
    axes.set_yscale("log", base=2)
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.set_ylim(top=2.0 * max(speed_up.max(), 1.0))


def _draw_shares(axes: Axes, prediction: Prediction) -> None:
    workers = [point.workers for point in prediction.points]
    busiest = [point.utilisation for point in prediction.points]
    axes.plot(
        workers,
        [point.efficiency for point in prediction.points],
        color=GREEN,
        marker="o",
        markersize=4,
        label="efficiency",
    )
    axes.plot(workers, busiest, color=VERMILION, marker="^", markersize=4, label="busiest link")
    axes.set_title("Efficiency, and how busy a link is")
    axes.set_xscale("log", base=2)
    axes.set_ylim(-0.02, 1.05)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))


def _model(prediction: Prediction, workers: np.ndarray) -> np.ndarray:
    """Speed-up by T = P Tc + n Tf / P (Cantú-Paz), one processor more than workers, breeding added."""
    workload = prediction.workload
    trams = workers + 1.0
    compute = workload.population * workload.evaluation
    time = trams * prediction.message_seconds + compute / trams + workload.breeding
    return (compute + workload.breeding) / time


def _powers_of_two(axes: Axes, workers: list[int]) -> None:
    ticks = [2**k for k in range(13) if workers[0] <= 2**k <= workers[-1]] or workers[:1]
    axes.set_xticks(ticks)
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_minor_locator(NullLocator())
