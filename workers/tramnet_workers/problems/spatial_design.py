"""Spatial arms for task points, one population for each point."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.kernels.spatial import SpatialModel, evaluate_spatial
from tramnet_workers.problems.connected import ConnectedArms, PlainArms, freeze, rows_of

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SpatialDesign(ConnectedArms):
    """A design problem for spatial arms; points are of shape (t, 12), genes as in ``kernels.spatial``.

    Attributes:
        model: What is known of the arm.
    """

    model: SpatialModel

    def __post_init__(self) -> None:
        super().__post_init__()
        freeze(*self.model)

    def evaluate(self, first: int, genes: Floats, traits: Floats, terms: Floats) -> None:
        """Evaluate k populations on their own; see ``evolution.coupling.CoupledProblem``."""
        evaluate_spatial(self.model, self.points[first : first + len(genes)], genes, traits, terms)

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Rebuild a problem from what ``parameters`` returned.

        Raises:
            InvalidParameters: They are no such values.
        """
        try:
            found = msgspec.convert(parameters, _Plain, strict=True)
        except msgspec.ValidationError as error:
            raise InvalidParameters("crank", f"{error}") from error
        model = found.model.build()
        return cls(
            points=rows_of(found.points, 12),
            lower=np.array(found.lower),
            upper=np.array(found.upper),
            coupling=found.coupling.build(),
            ramp=found.ramp,
            generations=found.generations,
            fixed=rows_of(found.fixed, len(model.designed) + 3 + len(model.rows)),
            model=model,
        )


class _PlainModel(msgspec.Struct):
    rows: list[list[float]]
    designed: list[list[int]]
    limits: list[list[float]]
    order: int
    scale: float

    def build(self) -> SpatialModel:
        return SpatialModel(
            rows_of(self.rows, 4),
            np.array(self.designed, np.int64).reshape(-1, 2),
            np.array(self.limits),
            self.order,
            self.scale,
        )


class _Plain(PlainArms):
    model: _PlainModel
