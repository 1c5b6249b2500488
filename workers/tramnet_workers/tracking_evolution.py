"""Evolution of the steps along a path: settings of ``eamp`` and ``memetic``.

``eamp`` is the algorithm of Lin, Chen & Yu (2017), with table 3 as its defaults; what the paper does
not print (tournament size, draws, weights, the reading of eq. 19) is a setting with our choice.
"""

from dataclasses import asdict, dataclass, replace
from math import comb
from typing import ClassVar, Literal, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.kernels import kinematics, paths
from tramnet_workers.kernels.breeding import Breeding
from tramnet_workers.kernels.differential import Ascent
from tramnet_workers.kernels.scenes import Scene

Array = NDArray[np.float64]

_SEEDS = 2**64
_TRANSLATION = slice(kinematics.TRANSLATION, kinematics.TRANSLATION + 3)


class Named(Protocol):
    """Settings with the name by which errors call them."""

    name: ClassVar[str]


@dataclass(frozen=True)
class Evolution:
    """What evolutions of steps have in common.

    Attributes:
        population: Number N of individuals.
        generations: Number of generations after the first population.
        tournament: Number of individuals of which the best becomes a parent.
        elites: Number of best individuals that survive.
        draws: Random draws the best of which makes an individual of the first population: how the
            filter of eq. 16 is kept affordable.
        crossover: Probability that a couple's children are not copies.
        mutation: Probability that a gene mutates.
        crossing: Blend of eq. 18, or exchange of the genes before a cut (the paper's CUDA section).
        mutating: Gaussian of eq. 19, or uniform redraw (the paper's CUDA section).
        clearance_weight: w2 for tasks that do not say theirs [cm²].
        seed: Seed of all random numbers, 0 to 2**64 - 1.
    """

    name: ClassVar[str]

    population: int = 500
    generations: int = 10
    tournament: int = 2
    elites: int = 2
    draws: int = 1
    crossover: float = 0.8
    mutation: float = 0.03
    crossing: Literal["blend", "single-point"] = "blend"
    mutating: Literal["gaussian", "uniform"] = "gaussian"
    clearance_weight: float = 0.1
    seed: int = 0

    def __post_init__(self) -> None:
        check_range(self, "population", self.elites + 2, 1_000_000)
        check_range(self, "generations", 0, 1_000_000)
        check_range(self, "tournament", 1, 1000)
        check_range(self, "elites", 0, 1000)
        check_range(self, "draws", 1, 1000)
        check_range(self, "crossover", 0.0, 1.0)
        check_range(self, "mutation", 0.0, 1.0)
        check_range(self, "clearance_weight", 0.0, 1e9)
        check_range(self, "seed", 0, _SEEDS - 1)

    def share(self, subpopulation: int, subpopulations: int) -> Self:
        """Return this method with the part of the population that one sub-population has.

        The first sub-populations have one individual more where the number does not divide.
        """
        size, rest = divmod(self.population, subpopulations)
        return replace(self, population=size + (subpopulation < rest))

    def evaluations_per_step(self, scene: Scene) -> int:
        """Return how many candidates are compared for each point."""
        return self.draws * self.population + self.generations * (self.population - self.elites)

    def parameters(self) -> dict[str, object]:
        """Return the method as plain values."""
        return {"name": self.name, **asdict(self)}

    def breeding(self, n_joints: int, subpopulation: int) -> Breeding:
        """Return the settings as kernels want them."""
        return Breeding(
            np.uint64(self.seed),  # type: ignore[arg-type]  # whole 64 bits
            subpopulation,
            self.population,
            self.generations,
            self.draws,
            self.tournament,
            self.elites,
            float(self.crossover),
            mutation_thresholds(n_joints, self.mutation),
            self.crossing == "single-point",
            self.mutating == "uniform",
        )


@dataclass(frozen=True)
class Eamp(Evolution):
    """EAMP of Lin, Chen & Yu (2017), with the settings of their table 3.

    Attributes:
        warm_start: Whether the first population has the step 0 and a Gauss-Newton step. (The step
            before is not used: a run of points starts from its posture alone.)
    """

    name: ClassVar[str] = "eamp"

    warm_start: bool = False

    @classmethod
    def recommended(cls) -> Self:
        """Return the settings with the best path for the paper's number of evaluations."""
        return cls(tournament=3, warm_start=True)

    def follow(
        self,
        scene: Scene,
        first: int,
        posture: Array,
        subpopulation: int,
        path: Array,
        costs: Array,
    ) -> None:
        """Follow a run of points; see ``tracking_methods.TrackingMethod``."""
        breeding = self.breeding(len(posture), subpopulation)
        paths.follow_by_evolution(scene, breeding, self.warm_start, first, posture, path, costs)


@dataclass(frozen=True)
class Memetic(Evolution):
    """Evolution of a small population with local search, as today's inverse kinematics do it.

    Each first population has the step of resolved-rate control with ascent of the clearance; the
    best individual is corrected by Gauss-Newton steps. (bio_ik and its successors are of this kind.)

    Attributes:
        corrections: Number of Gauss-Newton steps.
        ascent: Step in the null space per gradient, relative to arm and clearance.
        sharpness: How much a nearer link counts more than a farther one in the gradient.
    """

    name: ClassVar[str] = "memetic"

    population: int = 50
    generations: int = 5
    tournament: int = 3
    clearance_weight: float = 1.0
    corrections: int = 2
    ascent: float = 10.0
    sharpness: int = 4

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range(self, "corrections", 0, 100)
        check_range(self, "ascent", 0.0, 1e6)
        check_range(self, "sharpness", 1, 100)

    def follow(
        self,
        scene: Scene,
        first: int,
        posture: Array,
        subpopulation: int,
        path: Array,
        costs: Array,
    ) -> None:
        """Follow a run of points; see ``tracking_methods.TrackingMethod``."""
        breeding = self.breeding(len(posture), subpopulation)
        ascent = ascent_for(scene, self.ascent, self.sharpness)
        paths.follow_by_memetics(
            scene, breeding, ascent, self.corrections, first, posture, path, costs
        )


def mutation_thresholds(n_genes: int, probability: float) -> NDArray[np.uint64]:
    """Return the distribution function of the number of mutated genes, times 2**32.

    A child has more than k of them if 32 random bits are at least element k.
    """
    masses = [
        comb(n_genes, k) * probability**k * (1.0 - probability) ** (n_genes - k)
        for k in range(n_genes)
    ]
    return np.array([round(sum(masses[: k + 1]) * 2**32) for k in range(n_genes)], np.uint64)


def ascent_for(scene: Scene, ascent: float, sharpness: int) -> Ascent:
    """Return an ascent that is as steep for arms of any size.

    The clearance of an arm of length L changes by up to L per radian and bends by about L²/d.
    """
    lengths = np.linalg.norm(scene.chain.rows[1:, _TRANSLATION], axis=1)
    return Ascent(float(ascent / lengths.sum() ** 2), sharpness)


def check_range(settings: Named, setting: str, least: float, most: float) -> None:
    """Check that a setting is a number within a range.

    Raises:
        InvalidParameters: It is not.
    """
    value = getattr(settings, setting)
    if not least <= value <= most:
        raise InvalidParameters(settings.name, f"{setting} is {value}, not from {least} to {most}")
