"""Task constraints by name: the TC of eq (4), built in or brought along by other packages.

Kim & Khosla (1992), section 5: "Any task which can be expressed by dimension, pose and base position is
a candidate for TC." A package adds one with an entry point of the group ``tramnet.task_terms``:

    [project.entry-points."tramnet.task_terms"]
    my-term = "my_package.my_module:my_term"

where ``my_term(arms)`` returns a penalty, at least 0, for each of m arms, as an array of shape (m,). It
must be a pure function of each arm alone, with the same bits on every machine.
"""

from collections.abc import Callable, Mapping
from importlib.metadata import entry_points
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidTask

Floats = NDArray[np.float64]

ENTRY_POINT_GROUP = "tramnet.task_terms"


class Arms(NamedTuple):
    """Arms of one population, as a task constraint sees them.

    Attributes:
        point: Task point, of shape (2,) [m].
        places: Places of base, joints and tip, of shape (n + 1, 2, m) [m].
        traits: Link lengths, base and joint values, of shape (n_traits, m) [m, rad].
    """

    point: Floats
    places: Floats
    traits: Floats


TaskTerm: TypeAlias = Callable[[Arms], Floats]


def isotropy(arms: Arms) -> Floats:
    """Return how far the velocity ellipsoid is from a circle: 1 - 2 sqrt(det) / trace of J J^T."""
    levers = arms.places[-1] - arms.places[:-1]
    xx = (levers[:, 0] * levers[:, 0]).sum(axis=0)
    yy = (levers[:, 1] * levers[:, 1]).sum(axis=0)
    xy = (levers[:, 0] * levers[:, 1]).sum(axis=0)
    root = np.sqrt(np.maximum(xx * yy - xy * xy, 0.0))
    penalty: Floats = 1.0 - 2.0 * root / np.maximum(xx + yy, 1e-300)
    return penalty


_BUILT_IN: Mapping[str, TaskTerm] = MappingProxyType({"isotropy": isotropy})


def find_task_term(name: str) -> TaskTerm:
    """Return a task constraint.

    Raises:
        InvalidTask: None of that name is installed.
    """
    if name in _BUILT_IN:
        return _BUILT_IN[name]
    for point in entry_points(group=ENTRY_POINT_GROUP, name=name):
        found: TaskTerm = point.load()
        return found
    known = sorted({*_BUILT_IN, *(point.name for point in entry_points(group=ENTRY_POINT_GROUP))})
    raise InvalidTask("terms", repr(name), f"one of {', '.join(known)}")
