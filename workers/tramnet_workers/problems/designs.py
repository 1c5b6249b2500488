"""Design problems by what a worker is told: plain values with their kind."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TypeAlias

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.problems.crank_design import PlanarDesign
from tramnet_workers.problems.single_design import SingleDesign
from tramnet_workers.problems.spatial_design import SpatialDesign

Design: TypeAlias = PlanarDesign | SpatialDesign | SingleDesign

_KINDS: Mapping[str, type[Design]] = MappingProxyType(
    {"planar": PlanarDesign, "single": SingleDesign, "spatial": SpatialDesign}
)
_BUILDERS: Mapping[str, Callable[[Mapping[str, object]], Design]] = MappingProxyType(
    {kind: design.from_parameters for kind, design in _KINDS.items()}
)


def design_parameters(design: Design) -> dict[str, object]:
    """Return a design problem as plain values, for the wire."""
    kind = next(kind for kind, known in _KINDS.items() if isinstance(design, known))
    return {"kind": kind, "design": design.parameters()}


def build_design(parameters: Mapping[str, object]) -> Design:
    """Rebuild a design problem from what ``design_parameters`` returned.

    Raises:
        InvalidParameters: They are no such values.
    """
    match parameters:
        case {"kind": str(kind), "design": Mapping() as design} if kind in _BUILDERS:
            return _BUILDERS[kind](design)
    expected = f"a kind of {', '.join(_KINDS)} and its design"
    raise InvalidParameters("crank", f"found {sorted(parameters)}, expected {expected}")
