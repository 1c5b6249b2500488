"""What a designed arm is worth against the best arm that there is."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.problems.bilevel import Search, run_bilevel, worth
from tramnet_workers.problems.design_task import DesignTask

Floats = NDArray[np.float64]

MOST_POINTS = 256  # above which the optimum takes too long
_BUDGET = 200_000  # evaluations for each task point; the search ends long before
_SEED = 0


class Quality(NamedTuple):
    """Mean dexterities at the task points, with exact poses.

    Attributes:
        optimum: That of the best arm; it knows no task constraint and no JAC.
        optimal_lengths: Links of the best arm [m].
        designed: That of the designed links, over the optimum.
        built: That of the links from the stock, over the optimum.
    """

    optimum: float
    optimal_lengths: tuple[float, ...]
    designed: float
    built: float


def best_arm(task: DesignTask) -> Search:
    """Return the best arm there is for a task, without TC and JAC: CMA-ES around exact poses.

    Raises:
        InvalidTask: The arm has not three revolute joints alone.
    """
    return run_bilevel(task, _BUDGET * len(task.stations), _SEED)


def design_quality(
    task: DesignTask, designed: Floats, built: Floats, base: Floats
) -> Quality | None:
    """Compare link lengths with the best ones; None where the best are not known.

    Known are those of planar arms of three revolute joints on a base that stands still.

    Args:
        task: The task.
        designed: Link lengths designed, of shape (3,) [m].
        built: Link lengths chosen from the stock, of shape (3,) [m].
        base: Base position, of shape (2,) [m].
    """
    three = task.n_links == 3 and not task.strokes
    if not three or task.lengths is not None or task.mobility is not None:
        return None
    if len(task.stations) > MOST_POINTS:
        return None
    best = best_arm(task)
    if best.dexterity <= 0.0:
        return None
    shares = [worth(task, lengths, base).mean / best.dexterity for lengths in (designed, built)]
    return Quality(best.dexterity, best.lengths, *shares)
