"""Problems by name: those of this package, and those that other packages bring along.

A package adds problems with entry points of the group ``tramnet.problems``:

    [project.entry-points."tramnet.problems"]
    my-problem = "my_package.my_module:build"

where ``build(parameters)`` takes the parameters, plain values in a mapping, and returns a problem: a ``Problem``
or another of those that ``problems.problem`` describes. Code never travels: both sides must have the package.
"""

from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points

from tramnet_workers.errors import BrokenProblem, UnknownProblem

ENTRY_POINT_GROUP = "tramnet.problems"

Builder = Callable[[Mapping[str, object]], object]

# Named, not imported: a worker loads the kernels of its own problem only.
_BUILT_IN: Mapping[str, str] = {
    "sphere": "tramnet_workers.problems.sphere:Sphere.from_parameters",
    "crank": "tramnet_workers.problems.designs:build_design",
    "crank-links": "tramnet_workers.problems.bilevel:LinkDesign.from_parameters",
    "line-tracking": "tramnet_workers.problems.line_tracking:LineTracking.from_parameters",
    "puma560-grid": "tramnet_workers.problems.grid_motion:GridMotion.from_parameters",
    "puma560-smooth": "tramnet_workers.problems.smooth_motion:SmoothMotion.from_parameters",
}


def build(name: str, parameters: Mapping[str, object]) -> object:
    """Return a problem.

    Args:
        name: One of ``problem_names()``.
        parameters: What the problem's builder takes.

    Raises:
        UnknownProblem: No problem of that name is installed.
        BrokenProblem: Its entry point cannot be loaded.
    """
    return _builder(name)(parameters)


def problem_names() -> list[str]:
    """Return the names of all installed problems, sorted."""
    return sorted({*_BUILT_IN, *(point.name for point in entry_points(group=ENTRY_POINT_GROUP))})


def _builder(name: str) -> Builder:
    if name in _BUILT_IN:
        return _load_built_in(_BUILT_IN[name])
    for point in entry_points(group=ENTRY_POINT_GROUP, name=name):
        return _load(point)
    raise UnknownProblem(name, problem_names())


def _load_built_in(target: str) -> Builder:
    module, _, attributes = target.partition(":")
    found: object = import_module(module)
    for attribute in attributes.split("."):
        found = getattr(found, attribute)
    assert callable(found)
    return found


def _load(point: EntryPoint) -> Builder:
    try:
        loaded: object = point.load()
    except (ImportError, AttributeError) as error:
        raise BrokenProblem(point.name, point.value, str(error)) from error
    if not callable(loaded):
        raise BrokenProblem(point.name, point.value, f"it is a {type(loaded).__name__}, no builder")
    return loaded
