"""Planar arms for task points, one population for each point.

Kim & Khosla (1992), sections 4 and 5. All steps of Progressive Design and all variants of the planar arm
are this one problem with other limits of the genes, weights and neighbours; ``problems.stages`` makes
them from a task. It is plain numbers and travels as such.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.kernels.design import TC
from tramnet_workers.kernels.planar import PlanarModel, evaluate_planar
from tramnet_workers.problems.connected import ConnectedArms, PlainArms, freeze, rows_of
from tramnet_workers.problems.task_terms import Arms, TaskTerm, find_task_term

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PlanarDesign(ConnectedArms):
    """A design problem for planar arms; points are of shape (t, 2), genes as in ``kernels.planar``.

    Attributes:
        model: What is known of the arm.
        terms: Names of the user's task constraints, added up in TC.
    """

    model: PlanarModel
    terms: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        freeze(*self.model)

    @cached_property
    def _task_terms(self) -> tuple[TaskTerm, ...]:
        return tuple(find_task_term(name) for name in self.terms)

    def evaluate(self, first: int, genes: Floats, traits: Floats, terms: Floats) -> None:
        """Evaluate k populations on their own; see ``evolution.coupling.CoupledProblem``."""
        k, _, m = genes.shape
        points = self.points[first : first + k]
        places = np.empty((k, self.coupling.n_links + 1, 2, m))
        evaluate_planar(self.model, points, genes, places, traits, terms)
        for task_term in self._task_terms:
            for i in range(k):
                terms[i, TC] += task_term(Arms(points[i], places[i], traits[i]))

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
            points=rows_of(found.points, 2),
            lower=np.array(found.lower),
            upper=np.array(found.upper),
            coupling=found.coupling.build(),
            ramp=found.ramp,
            generations=found.generations,
            fixed=rows_of(found.fixed, 2 * model.limits.shape[1] + 2 + len(model.strokes)),
            model=model,
            terms=tuple(found.terms),
        )


class _PlainModel(msgspec.Struct):
    by_place: bool
    limits: list[list[float]]
    strokes: list[list[float]]
    boxes: list[list[float]]
    printed_hc: bool

    def build(self) -> PlanarModel:
        return PlanarModel(
            self.by_place,
            np.array(self.limits),
            rows_of(self.strokes, 2),
            rows_of(self.boxes, 4),
            self.printed_hc,
        )


class _Plain(PlainArms):
    model: _PlainModel
    terms: list[str]
