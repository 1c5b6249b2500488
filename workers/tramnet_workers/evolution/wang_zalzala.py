"""The genetic algorithm of Wang & Zalzala (1995), section 4.3, for trajectories on a grid.

Reproduction by roulette, circle crossover, the destroy-trajectory and the position operator, and a
limit on equal trajectories. Every number that the paper does not give is a setting with our default;
``docs/reproduction.md`` lists them with the reasons.
"""

from dataclasses import dataclass
from typing import Annotated, NamedTuple, cast

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.evolution.selection import (
    first_equals,
    scaled_fitness,
    spin_roulette,
    surplus_slots,
)
from tramnet_workers.evolution.streams import Purpose
from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.grid import Key, LevelGrid, Levels, Walk, random_trajectories
from tramnet_workers.kernels.grid_operators import (
    Circle,
    Shift,
    cross_circles,
    destroy_trajectories,
    shift_positions,
)
from tramnet_workers.kernels.switching import HOPELESS

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Count = Annotated[int, Meta(ge=1)]


class WangZalzalaSettings(Struct, frozen=True, forbid_unknown_fields=True):
    """Settings of the algorithm.

    The first five are the paper's (section 5), under its names; all others are ours.

    Attributes:
        criteria: Most equal trajectories in a new population; others are replaced by random ones.
        samemax: Most equal trajectories among the parents.
        xor: Probability that a pair of parents tries to cross.
        pmutr: Probability that the position operator changes a trajectory. The paper leaves open
            whether the rate counts per trajectory or per node; per node it would move 9 of 90 nodes
            each time, which finds nothing "around a good trajectory".
        variation: Farthest that the position operator moves a node [levels].
        goal_bias: Probability of a random trajectory's step of one level towards the goal, the
            paper's "higher probability". Below about 0.9 nothing near the paper's times is found.
        meeting_attempts: How often the two walks of a random trajectory may miss each other, joint
            by joint, before the joint goes straight.
        circle_radius: Radius R of the circle in which parents may cross [levels].
        crossing_attempts: How many sites a pair tries before it is copied.
        selection_attempts: How often a parent is drawn again when ``samemax`` is met.
        destroy: Probability that a trajectory is destroyed and replaced by a random one.
        shifted_nodes: Most nodes that the position operator moves in a trajectory, "one or more".
        elites: How many best trajectories survive unchanged. The paper says nothing of it.
    """

    criteria: Count = 4
    samemax: Count = 6
    xor: Share = 0.80
    pmutr: Share = 0.10
    variation: Count = 2
    goal_bias: Share = 0.95
    meeting_attempts: Count = 200
    circle_radius: Annotated[int, Meta(ge=0)] = 2
    crossing_attempts: Count = 10
    selection_attempts: Count = 20
    destroy: Share = 0.05
    shifted_nodes: Count = 3
    elites: Annotated[int, Meta(ge=0)] = 0


LITERAL = WangZalzalaSettings()
POPULATION_SIZE = 100
GENERATIONS = 300

_INITIAL = Purpose.INITIAL.value
_SELECTION = Purpose.SELECTION.value
_CROSSOVER = Purpose.CROSSOVER.value
_DESTRUCTION = Purpose.DESTRUCTION.value
_POSITION = Purpose.POSITION.value
_REPLACEMENT = Purpose.REPLACEMENT.value


class Caps(NamedTuple):
    """How often equal trajectories may occur.

    Attributes:
        parents: Among the parents: Samemax.
        attempts: How often a parent is drawn again when that is met.
        children: In the new population: Criteria.
    """

    parents: int
    attempts: int
    children: int


@dataclass(frozen=True, eq=False)
class WangZalzala:
    """One population of trajectories (see ``evolution.algorithm``).

    Attributes:
        seed: Seed of the run, 0 to 2**64 - 1.
        population_size: Number N of trajectories, even or not.
        grid: Which levels they may take.
        settings: How they are bred.
        population: Index of the population, for its random streams.

    Raises:
        InvalidParameters: The population is too small.
    """

    seed: int
    population_size: int
    grid: LevelGrid
    settings: WangZalzalaSettings = LITERAL
    population: int = 0

    def __post_init__(self) -> None:
        if self.population_size < max(1, self.settings.elites):
            raise InvalidParameters(
                "wang-zalzala",
                f"found a population of {self.population_size}, expected at least one trajectory "
                f"and at least the {self.settings.elites} elites",
            )

    def initial(self) -> Levels:
        """Return the first population: random trajectories."""
        genomes = np.zeros((self.population_size, *self.grid.lower.shape), np.int16)
        slots = np.arange(self.population_size)
        random_trajectories(self.grid, self._walk, self._key(0), _INITIAL, slots, genomes)
        return genomes

    def breed(
        self, genomes: NDArray[np.generic], objectives: NDArray[np.float64], generation: int
    ) -> Levels:
        """Return the next population."""
        settings = self.settings
        return _breed(
            self.grid,
            self._walk,
            Circle(settings.xor, settings.circle_radius, settings.crossing_attempts),
            Shift(settings.pmutr, settings.shifted_nodes, settings.variation),
            Caps(settings.samemax, settings.selection_attempts, settings.criteria),
            settings.destroy,
            np.argsort(objectives, kind="stable")[: settings.elites],
            self._key(generation),
            np.ascontiguousarray(genomes, dtype=np.int16),
            scaled_fitness(objectives, HOPELESS),
        )

    @property
    def _walk(self) -> Walk:
        return Walk(self.settings.goal_bias, self.settings.meeting_attempts)

    def _key(self, generation: int) -> Key:
        return Key(cast(int, np.uint64(self.seed)), self.population, generation)


@kernel
def _breed(
    grid: LevelGrid,
    walk: Walk,
    circle: Circle,
    shift: Shift,
    caps: Caps,
    destroy: float,
    elites: NDArray[np.int64],
    key: Key,
    parents: Levels,
    fitness: NDArray[np.float64],
) -> Levels:
    """Apply the operators, one after the other, to the whole population."""
    n = parents.shape[0]
    firsts = first_equals(parents.reshape(n, -1))
    chosen = spin_roulette(fitness, firsts, caps.parents, caps.attempts, key, _SELECTION)
    children = parents[chosen]
    cross_circles(grid, circle, key, _CROSSOVER, children)
    destroy_trajectories(grid, walk, destroy, key, _DESTRUCTION, children)
    shift_positions(grid, shift, key, _POSITION, children)
    children[: len(elites)] = parents[elites]
    surplus = surplus_slots(first_equals(children.reshape(n, -1)), caps.children)
    random_trajectories(grid, walk, key, _REPLACEMENT, surplus, children)
    return children
