"""Arms of connected populations: what planar and spatial designs have in common."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from functools import cached_property

import msgspec
import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels.design import N_TERMS, Coupling, total_fitness
from tramnet_workers.mpga_settings import Ramp

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ConnectedArms(ABC):
    """A design problem for t populations; satisfies ``evolution.coupling.CoupledProblem``.

    Attributes:
        points: Task points, of shape (t, ...) [m].
        lower: Smallest genes, of shape (t, n_genes) [m, rad].
        upper: Largest genes; equal to the smallest ones where a gene is given.
        coupling: How the populations are connected.
        ramp: Growth of LC and BPC.
        generations: Number of generations that the ramp is made for.
        fixed: Traits of fixed poses that neighbours may refer to, after the populations, of shape
            (n_fixed, n_traits).
    """

    points: Floats
    lower: Floats
    upper: Floats
    coupling: Coupling
    ramp: Ramp
    generations: int
    fixed: Floats

    def __post_init__(self) -> None:
        freeze(self.points, self.lower, self.upper, self.fixed, *self.coupling)

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
        flags = np.zeros(self.fixed.shape[1], np.bool_)
        flags[first : first + self.coupling.n_angles] = True
        return flags

    @cached_property
    def _alone(self) -> Coupling:
        nobody = np.full_like(self.coupling.neighbours, -1)
        freeze(nobody)
        return self.coupling._replace(n_populations=1, neighbours=nobody, reach=-1.0)

    @abstractmethod
    def evaluate(self, first: int, genes: Floats, traits: Floats, terms: Floats) -> None:
        """Evaluate k populations on their own, from population ``first`` on."""

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
        return {f.name: plain(getattr(self, f.name)) for f in fields(self)}


def freeze(*values: object) -> None:
    """Make those values read-only that are arrays."""
    for value in values:
        if isinstance(value, np.ndarray):
            value.setflags(write=False)


class PlainCoupling(msgspec.Struct):
    """A ``Coupling`` as it travels."""

    n_links: int
    n_base: int
    n_angles: int
    n_populations: int
    neighbours: list[list[int]]
    weights: list[float]
    reach: float

    def build(self) -> Coupling:
        """Return the coupling."""
        return Coupling(
            self.n_links,
            self.n_base,
            self.n_angles,
            self.n_populations,
            np.array(self.neighbours, np.int64).reshape(-1, 2),
            np.array(self.weights),
            self.reach,
        )


class PlainArms(msgspec.Struct):
    """What all ``ConnectedArms`` have, as it travels."""

    points: list[list[float]]
    lower: list[list[float]]
    upper: list[list[float]]
    coupling: PlainCoupling
    ramp: Ramp
    generations: int
    fixed: list[list[float]]


def rows_of(rows: list[list[float]], columns: int) -> Floats:
    """Return rows as an array of shape (k, columns), k being 0 or more."""
    return np.array(rows, dtype=np.float64).reshape(-1, columns)


def plain(value: object) -> object:
    """Return arrays as lists and named tuples as tables."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return {name: plain(element) for name, element in value._asdict().items()}
    return msgspec.to_builtins(value)
