"""What problems offer: objectives of chromosomes, or paths to follow.

A problem is named data plus pure functions. It travels over the wire as a registry name and plain parameters,
never as code, and is built again on each worker. What it can do says which kind of work it takes: ``Evaluate``
needs a ``Problem``, ``Track`` a ``PathProblem``, ``Evolve`` an ``evolution.coupling.CoupledProblem``.
"""

from typing import NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]


@runtime_checkable
class Problem(Protocol):
    """A problem whose chromosomes are evaluated one by one, as a worker and the master see it.

    Attributes:
        name: Name under which the registry builds it.
        genome_shape: Shape of one chromosome.
        genome_dtype: Element type of a chromosome.
    """

    @property
    def name(self) -> str:
        """Name under which the registry builds it."""

    @property
    def genome_shape(self) -> tuple[int, ...]:
        """Shape of one chromosome."""

    @property
    def genome_dtype(self) -> np.dtype[np.generic]:
        """Element type of a chromosome."""

    def evaluate(self, genomes: NDArray[np.generic]) -> Floats:
        """Return the objectives of a chunk of chromosomes, to be minimised.

        The objective of a chromosome depends on nothing but that chromosome: not on its place in
        the chunk, the chunk's length or what was evaluated before.

        Args:
            genomes: Chromosomes, of shape ``(n, *genome_shape)``; not modified.

        Returns:
            Objectives, of shape (n,), all finite; a large one for a chromosome that cannot be decoded,
            since infinities and NaN are taken for failed evaluations.
        """


class Run(NamedTuple):
    """A run of consecutive points, followed.

    Attributes:
        path: Joint angles at the points, of shape (n_points, n_joints) [rad].
        cost: Costs of the steps to them, of shape (n_points,).
    """

    path: Floats
    cost: Floats


@runtime_checkable
class PathProblem(Protocol):
    """A problem whose answer is a path, one point after the other."""

    def track(self, population: int, first: int, last: int, posture: Floats) -> Run:
        """Follow a run of points; the answer depends on nothing but the arguments.

        Args:
            population: Number of the scene times the number of sub-populations, plus the number of
                the sub-population.
            first: Number of the first point, from 1.
            last: Number after the last one.
            posture: Joint angles at the point before ``first``, of shape (n_joints,) [rad].
        """

    def warm_up(self) -> None:
        """Follow a point by each method that may be asked for, so that compiled kernels are loaded."""
