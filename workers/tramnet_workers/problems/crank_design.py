"""Arms for task points, one population for each point: the problem that populations evolve on.

Kim & Khosla (1992), sections 4 and 5. All steps of Progressive Design and all variants of the planar arm
are this one problem with other limits of the genes, weights and neighbours; ``problems.stages`` makes
them from a task. It is plain numbers and travels as such.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.kernels.design import N_TERMS, TC, Coupling, total_fitness
from tramnet_workers.kernels.planar import PlanarModel, evaluate_planar
from tramnet_workers.mpga_settings import Ramp
from tramnet_workers.problems.task_terms import Arms, TaskTerm, find_task_term

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CoupledDesign:
    """One design problem for t populations.

    Attributes:
        points: Task points, of shape (t, 2) [m].
        lower: Smallest genes, of shape (t, n_genes) [m, rad]; rows as in ``kernels.planar``.
        upper: Largest genes; equal to the smallest ones where a gene is given.
        model: What is known of the arm.
        coupling: How the populations are connected.
        ramp: Growth of LC and BPC.
        generations: Number of generations that the ramp is made for.
        fixed: Traits of fixed poses that neighbours may refer to, after the populations, of shape
            (n_fixed, n_traits).
        terms: Names of the user's task constraints, added up in TC.
    """

    points: Floats
    lower: Floats
    upper: Floats
    model: PlanarModel
    coupling: Coupling
    ramp: Ramp
    generations: int
    fixed: Floats
    terms: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for array in (self.points, self.lower, self.upper, self.fixed, *self.model, *self.coupling):
            if isinstance(array, np.ndarray):
                array.setflags(write=False)

    @property
    def n_populations(self) -> int:
        """Number t of populations."""
        return len(self.points)

    @property
    def n_terms(self) -> int:
        """Number of terms of eq (4)."""
        return N_TERMS

    @cached_property
    def circular(self) -> NDArray[np.bool_]:
        """Which traits are angles, of shape (n_traits,)."""
        first = self.coupling.n_links + self.coupling.n_base
        flags = np.zeros(first + self.coupling.n_angles + len(self.model.prismatic), np.bool_)
        flags[first : first + self.coupling.n_angles] = True
        return flags

    @cached_property
    def _task_terms(self) -> tuple[TaskTerm, ...]:
        return tuple(find_task_term(name) for name in self.terms)

    @cached_property
    def _alone(self) -> Coupling:
        nobody = np.full_like(self.coupling.neighbours, -1)
        return self.coupling._replace(n_populations=1, neighbours=nobody, reach=-1.0)

    def evaluate(self, first: int, genes: Floats, traits: Floats, terms: Floats) -> None:
        """Evaluate k populations on their own; see ``evolution.coupling.CoupledProblem``."""
        k, _, m = genes.shape
        points = self.points[first : first + k]
        places = np.empty((k, self.coupling.n_links + 1, 2, m))
        evaluate_planar(self.model, points, genes, places, traits, terms)
        for task_term in self._task_terms:
            for i in range(k):
                terms[i, TC] += task_term(Arms(points[i], places[i], traits[i]))

    def rate(
        self,
        first: int,
        generation: int,
        values: Floats | None,
        traits: Floats,
        terms: Floats,
        fitness: Floats,
    ) -> None:
        """Compute connecting terms and fitness; see ``evolution.coupling.CoupledProblem``."""
        if values is None:
            rows = np.zeros((self.n_populations, traits.shape[1]))
            total_fitness(self._alone, first, 0.0, rows, traits, terms, fitness)
            return
        rows = np.concatenate([values, self.fixed]) if len(self.fixed) else values
        scale = self.ramp.factor(generation, self.generations)
        total_fitness(self.coupling, first, scale, rows, traits, terms, fitness)

    def parameters(self) -> dict[str, object]:
        """Return plain values, for the wire."""
        return {
            "points": self.points.tolist(),
            "lower": self.lower.tolist(),
            "upper": self.upper.tolist(),
            "model": {name: _plain(value) for name, value in self.model._asdict().items()},
            "coupling": {name: _plain(value) for name, value in self.coupling._asdict().items()},
            "ramp": asdict(self.ramp),
            "generations": self.generations,
            "fixed": self.fixed.tolist(),
            "terms": list(self.terms),
        }

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Rebuild a problem from what ``parameters`` returned.

        Raises:
            InvalidParameters: They are no such values.
        """
        try:
            plain = msgspec.convert(parameters, _Plain, strict=True)
        except msgspec.ValidationError as error:
            raise InvalidParameters("crank", f"{error}") from error
        model, coupling = plain.model, plain.coupling
        n_traits = 2 * len(model.lower) + 2 + len(model.prismatic)
        return cls(
            points=_array(plain.points, 2),
            lower=np.array(plain.lower),
            upper=np.array(plain.upper),
            model=PlanarModel(
                model.by_place,
                np.array(model.lower),
                np.array(model.upper),
                np.array(model.prismatic, np.int64),
                np.array(model.stroke_scales),
                _array(model.boxes, 4),
                model.printed_hc,
            ),
            coupling=Coupling(
                coupling.n_links,
                coupling.n_base,
                coupling.n_angles,
                coupling.n_populations,
                np.array(coupling.neighbours, np.int64).reshape(-1, 2),
                np.array(coupling.weights),
                coupling.reach,
            ),
            ramp=Ramp(plain.ramp.decades, plain.ramp.until),
            generations=plain.generations,
            fixed=_array(plain.fixed, n_traits),
            terms=tuple(plain.terms),
        )


class _PlainModel(msgspec.Struct):
    by_place: bool
    lower: list[float]
    upper: list[float]
    prismatic: list[int]
    stroke_scales: list[float]
    boxes: list[list[float]]
    printed_hc: bool


class _PlainCoupling(msgspec.Struct):
    n_links: int
    n_base: int
    n_angles: int
    n_populations: int
    neighbours: list[list[int]]
    weights: list[float]
    reach: float


class _PlainRamp(msgspec.Struct):
    decades: float
    until: float


class _Plain(msgspec.Struct):
    points: list[list[float]]
    lower: list[list[float]]
    upper: list[list[float]]
    model: _PlainModel
    coupling: _PlainCoupling
    ramp: _PlainRamp
    generations: int
    fixed: list[list[float]]
    terms: list[str]


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _array(rows: list[list[float]], columns: int) -> Floats:
    return np.array(rows, dtype=np.float64).reshape(-1, columns)
