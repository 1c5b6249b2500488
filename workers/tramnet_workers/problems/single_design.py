"""All variables of a design in one chromosome: what the multi-population GA is compared with.

Kim & Khosla (1992), section 4: "If we use one optimization function, the total number of variables is"
(n - 2) t + n + 2, eq (3), and grows with the task points; so does the cost of one individual. Evolution
sees it as a problem of one population. Planar arms of three revolute joints only, without TC.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.kernels.design import N_TERMS
from tramnet_workers.kernels.single import evaluate_single
from tramnet_workers.mpga_settings import GeneticSettings, MpgaSettings
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.steps import TERM_NAMES
from tramnet_workers.problems.task_fitness import require_links_to_find

Floats = NDArray[np.float64]

_SHORTEST = 0.05  # smallest length gene [m]
# Tuned over reach weight, mutation rate and population size, which it needs and MPGA does not.
_FEW_POINTS, _FEW_RC, _MANY_RC = 16, 1.0, 0.3  # weight of RC [1/m]
_MANY_POINTS = 32  # above which a larger population pays
_MUTATIONS = 2.0  # bits changed in a chromosome, in the mean


@dataclass(frozen=True, eq=False)
class SingleDesign:
    """A design as a problem of one population.

    Attributes:
        task: The task.
        weights: Weights of eq (4), of shape (8,).
    """

    task: DesignTask
    weights: Floats

    def __post_init__(self) -> None:
        require_links_to_find(self.task)
        self.weights.setflags(write=False)

    @property
    def n_populations(self) -> int:
        """One."""
        return 1

    @property
    def n_terms(self) -> int:
        """Number of terms of eq (4)."""
        return N_TERMS

    @cached_property
    def points(self) -> Floats:
        """Task points, of shape (t, 2) [m]."""
        return self.task.points

    @cached_property
    def lower(self) -> Floats:
        """Smallest genes, of shape (1, 5 + t)."""
        base = self.task.base.lower if self.task.base.free else self.task.base.position
        first = [self.task.lower[0]] * len(self.task.stations)
        return np.array([[_SHORTEST] * 3 + [*base, *first]])

    @cached_property
    def upper(self) -> Floats:
        """Largest genes, of shape (1, 5 + t)."""
        base = self.task.base.upper if self.task.base.free else self.task.base.position
        first = [self.task.upper[0]] * len(self.task.stations)
        return np.array([[self.task.genes.upper] * 3 + [*base, *first]])

    @cached_property
    def circular(self) -> NDArray[np.bool_]:
        """Which traits are angles, of shape (5 + 3 t,)."""
        return np.arange(5 + 3 * len(self.task.stations)) >= 5

    def evaluate(self, first: int, genes: Floats, traits: Floats, terms: Floats) -> None:
        """Evaluate the population; see ``evolution.coupling.CoupledProblem``."""
        assert first == 0
        lower, upper = np.array(self.task.lower), np.array(self.task.upper)
        closed = self.task.trajectory.closed
        evaluate_single(self.points, lower, upper, closed, genes[0], traits[0], terms[0])

    def rate(
        self,
        first: int,
        generation: int,
        values: Floats | None,
        traits: Floats,
        terms: Floats,
        fitness: Floats,
    ) -> None:
        """Add up the terms; there is nobody to connect with."""
        signs = np.where(np.arange(N_TERMS) == 0, 1.0, -1.0) * self.weights
        fitness[:] = 0.0
        for r in range(N_TERMS):
            fitness += signs[r] * terms[:, r]

    def parameters(self) -> dict[str, object]:
        """Return plain values, for the wire."""
        return {"task": self.task.parameters(), "weights": self.weights.tolist()}

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Rebuild a problem from what ``parameters`` returned.

        Raises:
            InvalidParameters: They are no such values.
        """
        match parameters:
            case {"task": Mapping() as task, "weights": list(weights)} if len(weights) == N_TERMS:
                return cls(DesignTask.from_parameters(task), np.array(weights, dtype=np.float64))
        expected = f"a task and {N_TERMS} weights"
        raise InvalidParameters("crank", f"found {sorted(parameters)}, expected {expected}")


def single_design(task: DesignTask, settings: MpgaSettings) -> SingleDesign:
    """Return the problem with the weights of the settings and the task."""
    rc = _FEW_RC if len(task.stations) <= _FEW_POINTS else _MANY_RC
    weights = {**asdict(settings.weights), "rc": rc, **task.weights}
    return SingleDesign(task, np.array([weights[name] for name in TERM_NAMES]))


def single_genetic(task: DesignTask, settings: MpgaSettings, budget: int) -> GeneticSettings:
    """Return settings that suit one long chromosome and spend a budget.

    Args:
        task: The task.
        settings: Of the method it is compared with.
        budget: Evaluations of one arm at one task point.
    """
    t = len(task.stations)
    n_bits = (t + 3 + (2 if task.base.free else 0)) * task.genes.bits
    size = settings.genetic.population_size * (4 if t > _MANY_POINTS else 1)
    return replace(
        settings.genetic,
        bits=task.genes.bits,
        population_size=size,
        generations=max(1, budget // (t * size)),
        mutation=min(settings.genetic.mutation, _MUTATIONS / n_bits),
    )
