"""Settings of the multi-population genetic algorithm, and the two sets of them that have a name.

``literal`` is what Kim & Khosla (1992) print, with the smallest choices where they print nothing.
``recommended`` is what works best in our measurements: their algorithm with Gray code, medians,
tournaments, an elite and connecting constraints that grow. ``polished`` adds a local search of the
link lengths after step 1. This one table is all there is.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from enum import StrEnum
from functools import lru_cache
from math import radians
from types import MappingProxyType

import msgspec

from tramnet_workers.errors import InvalidParameters


class Coding(StrEnum):
    """How a string of bits stands for a whole number."""

    BINARY = "binary"
    GRAY = "gray"


class Selection(StrEnum):
    """How parents are chosen."""

    ROULETTE_SHIFT = "roulette-shift"
    ROULETTE_SCALED = "roulette-scaled"
    TOURNAMENT = "tournament"


class Connect(StrEnum):
    """What a population tells the others of itself."""

    MEAN = "mean"
    MEDIAN = "median"
    BEST = "best"


@dataclass(frozen=True)
class GeneticSettings:
    """Settings of the genetic algorithm in each population.

    Attributes:
        population_size: Number m of individuals.
        generations: Number G of generations that are evaluated.
        bits: Bits of a gene, 5 to 16.
        coding: Binary (paper) or Gray code.
        selection: Proportionate with shifted fitness (paper), with scaled fitness, or tournament.
        crossover: Probability with which a couple exchanges what follows a random bit.
        mutation: Probability with which a bit changes.
        elites: Number of best individuals that survive unchanged.
        connect: Mean (eqs 9-11), median, or the values of the best individual (Fig. 10).
    """

    population_size: int = 100
    generations: int = 1000
    bits: int = 10
    coding: Coding = Coding.GRAY
    selection: Selection = Selection.TOURNAMENT
    crossover: float = 0.9
    mutation: float = 0.01
    elites: int = 1
    connect: Connect = Connect.MEDIAN

    def __post_init__(self) -> None:
        _require(2 <= self.population_size <= 65535, "population_size", self.population_size,
                 "2 to 65535")  # fmt: skip
        _require(1 <= self.generations <= 10**6, "generations", self.generations, "1 to 1000000")
        _require(5 <= self.bits <= 16, "bits", self.bits, "5 to 16")
        _require(0.0 <= self.crossover <= 1.0, "crossover", self.crossover, "0 to 1")
        _require(0.0 <= self.mutation <= 0.5, "mutation", self.mutation, "0 to 0.5")
        _require(0 <= self.elites < self.population_size, "elites", self.elites,
                 "0 to population_size - 1")  # fmt: skip

    def parameters(self) -> dict[str, object]:
        """Return plain values, for the wire."""
        plain: dict[str, object] = msgspec.to_builtins(self)
        return plain

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> "GeneticSettings":
        """Build from what ``parameters`` returned.

        Raises:
            InvalidParameters: A setting is missing, unknown or out of range.
        """
        try:
            return msgspec.convert(parameters, cls, strict=True)
        except msgspec.ValidationError as error:
            raise InvalidParameters("mpga", f"{error}") from error


@dataclass(frozen=True)
class Weights:
    """Weights of the terms of eq (4), which the paper leaves implicit.

    The dexterity changes by 0.1 to 0.3 per metre of link, so the penalties per metre have to be
    larger than that to be exact; JAC of the crank itself is 0.1 to 0.7 rad, so a larger weight than
    0.1 buys smaller motions with longer arms.

    Attributes:
        dm: Dexterity measure, dimensionless.
        tc: Task constraint [1/m], for boxes.
        rc: Reachability constraint [1/m].
        hc: Heuristic constraint [1/m].
        jlc: Joint limit constraint [1/rad].
        lc: Link length constraint [1/m].
        bpc: Base position constraint [1/m].
        jac: Joint angle change constraint [1/rad].
    """

    dm: float = 1.0
    tc: float = 5.0
    rc: float = 5.0
    hc: float = 1.0
    jlc: float = 1.0
    lc: float = 1.0
    bpc: float = 1.0
    jac: float = 0.01

    def as_tuple(self) -> tuple[float, ...]:
        """Return them in the order of eq (4)."""
        return (self.dm, self.tc, self.rc, self.hc, self.jlc, self.lc, self.bpc, self.jac)


@dataclass(frozen=True)
class Ramp:
    """Growth of the connecting constraints LC and BPC over the generations.

    Constant strong ones make all populations agree within some 30 generations on the average of
    their random beginnings. The factor is 10 ** (-decades max(0, 1 - g / (until G))).

    Attributes:
        decades: Decades below full strength at the beginning; 0 for the paper's constant weights.
        until: Fraction of the generations after which they have their full strength.
    """

    decades: float = 3.0
    until: float = 0.7

    def factor(self, generation: int, generations: int) -> float:
        """Return the factor s of LC and BPC in a generation, counted from 0."""
        return _power_of_ten(
            -self.decades * max(0.0, 1.0 - generation / (self.until * generations))
        )


@dataclass(frozen=True)
class ElbowRule:
    """How step 1 of Progressive Design gets the same elbow at all task points.

    JAC couples nearest neighbours only, so walls between arms with elbow up and down survive in long
    rings. Up to a few points a larger weight removes them; above, all joints but the first are kept
    on one side.

    Attributes:
        few: Up to so many task points ``jac`` is used, above it one-sided limits.
        jac: Weight of JAC up to ``few`` points [1/rad].
        jlc: Weight of JLC with one-sided limits [1/rad].
    """

    few: int = 4
    jac: float = 0.06
    jlc: float = 0.5


@dataclass(frozen=True)
class PlacementRule:
    """Weights where RC stands in for inverse kinematics while links or base are to be agreed on.

    With LC and BPC as weak as in step 1 each population rather moves its base than its arm; with a
    strong RC from the beginning none moves at all.

    Attributes:
        rc: Weight of RC [1/m].
        connecting: Weight of LC and BPC [1/m].
        ramp: Growth of LC and BPC.
    """

    rc: float = 2.0
    connecting: float = 10.0
    ramp: Ramp = Ramp(decades=2.0)


@dataclass(frozen=True)
class Refinement:
    """How steps 2 and 3 of Progressive Design search around the result of the step before.

    Attributes:
        bits: Bits of a gene.
        generations: Number of generations.
        half_angle: Half width of the range of each joint angle [rad].
        half_base: Half width of the range of each base coordinate [m].
        jac: Weight of JAC [1/rad], or None for that of step 1. The arm is redundant and DM is flat
            along its self-motion, so without some JAC neighbouring poses differ for nothing.
    """

    bits: int
    generations: int
    half_angle: float
    half_base: float
    jac: float | None = None


PROTOTYPE = Refinement(12, 300, radians(40.0), 0.1)
PLANNING = Refinement(12, 300, radians(15.0), 0.0)


@dataclass(frozen=True)
class MpgaSettings:
    """All settings of the method.

    Attributes:
        name: Name of this set.
        genetic: Of the genetic algorithm in each population.
        weights: Of the terms of eq (4).
        ramp: Of the connecting constraints.
        elbow: Rule for step 1 of Progressive Design, or None.
        placement: Rule for the placement of a given arm and for spatial arms.
        prototype: Search of step 2 of Progressive Design.
        planning: Search of step 3.
        printed_hc: Whether HC has the printed sign, which makes degenerate arms.
        snap: Whether Progressive Design moves the poses found exactly onto their task points.
        polish: Whether a local search improves the link lengths after step 1.
    """

    name: str
    genetic: GeneticSettings
    weights: Weights
    ramp: Ramp
    elbow: ElbowRule | None
    placement: PlacementRule = PlacementRule()
    prototype: Refinement = PROTOTYPE
    planning: Refinement = PLANNING
    printed_hc: bool = False
    snap: bool = True
    polish: bool = False

    def with_genetic(self, genetic: GeneticSettings) -> "MpgaSettings":
        """Return the same with other genetic settings."""
        return replace(self, genetic=genetic)


@lru_cache(maxsize=4096)
def _power_of_ten(exponent: float) -> float:
    """Return 10 ** exponent with the same bits on every machine, which the C library does not."""
    with localcontext() as context:
        context.prec = 25
        return float(Decimal(10) ** Decimal(exponent))


def _require(passed: bool, name: str, found: object, expected: str) -> None:
    if not passed:
        raise InvalidParameters("mpga", f"{name}: found {found}, expected {expected}")


# With w_HC = 1 per metre one run in a hundred gets stuck on the ridge of HC; with 0.3 none of 600 did,
# and the degenerate arm, 0.056 better in DM and 0.7 m worse in HC, stays unattractive.
_MILD_HC = Weights(hc=0.3)

# With 4 (16) task points these make the joints' way around the crank 1.5 (2.5) times shorter than
# w_JAC = 0.01 does, and DM no worse; with much more, arms near the end of their reach miss their points.
_SMOOTH_PROTOTYPE = replace(PROTOTYPE, jac=0.1)
_SMOOTH_PLANNING = replace(PLANNING, jac=0.3)

SETTINGS: Mapping[str, MpgaSettings] = MappingProxyType(
    {
        "literal": MpgaSettings(
            name="literal",
            genetic=GeneticSettings(
                coding=Coding.BINARY,
                selection=Selection.ROULETTE_SHIFT,
                crossover=1.0,
                elites=0,
                connect=Connect.MEAN,
            ),
            weights=Weights(),
            ramp=Ramp(decades=0.0),
            elbow=None,
            snap=False,
        ),
        "recommended": MpgaSettings(
            name="recommended",
            genetic=GeneticSettings(),
            weights=_MILD_HC,
            ramp=Ramp(),
            elbow=ElbowRule(),
            prototype=_SMOOTH_PROTOTYPE,
            planning=_SMOOTH_PLANNING,
        ),
        "polished": MpgaSettings(
            name="polished",
            genetic=GeneticSettings(),
            weights=_MILD_HC,
            ramp=Ramp(),
            elbow=ElbowRule(),
            prototype=_SMOOTH_PROTOTYPE,
            planning=_SMOOTH_PLANNING,
            polish=True,
        ),
    }
)
