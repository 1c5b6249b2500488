"""The variants that Kim & Khosla (1992) promise, sections 4 and 8, as switches of a design task.

* ``path-placement``: a given arm; its dimension genes are fixed, LC and HC are off, RC is on and the base
  is free: "an optimal use of a given manipulator for a given task".
* ``mobile-base``: the base is free at every point. Omnidirectional: "we need just turn off the BPC";
  else BPC takes "into account its mobility constraint", a distance between neighbouring points.
* ``prismatic``: a joint extends one link, "included in design by modifying the LC": only the fixed parts
  of the links are compared.
* ``workspace``: steps 2 to 4 for a given arm on a grid of points; nothing to go back to.

The spatial arm is ``problems.spatial_task``.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from tramnet_workers.problems.design_task import DesignTask, Stroke
from tramnet_workers.problems.trajectory import grid

_MODULE = 0.45  # length of the links of the arm that is given if none is [m]
_STROKE = Stroke(link=1, length=0.3)
_GRID = (9, 9)


def path_placement(task: DesignTask) -> DesignTask:
    """Return the task for a given arm, its own or one of 0.45 m links, with a free base."""
    return replace(task, lengths=_given(task), base=replace(task.base, free=True))


def mobile_base(task: DesignTask) -> DesignTask:
    """Return the task with a base that moves: as far as the task says, or anywhere."""
    mobility = np.inf if task.mobility is None else task.mobility
    return replace(task, mobility=mobility, base=replace(task.base, free=True))


def prismatic(task: DesignTask) -> DesignTask:
    """Return the task with its own prismatic joints, or one of 0.3 m in the second link."""
    return replace(task, strokes=task.strokes or (_STROKE,))


def workspace(task: DesignTask) -> DesignTask:
    """Return the task of a given arm on a grid over all that it can reach, or over its own points."""
    lengths = _given(task)
    if task.trajectory == DesignTask().trajectory:
        reach, (x, y) = sum(lengths), task.base.position
        path = grid((x - reach, y - reach), (x + reach, y + reach), *_GRID)
        stations = tuple(float(s) for s in path.even_stations(len(path.vertices)))
        task = replace(task, trajectory=path, stations=stations)
    return replace(task, lengths=lengths, most_returns=0)


VARIANTS: Mapping[str, Callable[[DesignTask], DesignTask]] = MappingProxyType(
    {
        "mobile-base": mobile_base,
        "path-placement": path_placement,
        "prismatic": prismatic,
        "workspace": workspace,
    }
)


def _given(task: DesignTask) -> tuple[float, ...]:
    return task.lengths or (_MODULE,) * task.n_links
