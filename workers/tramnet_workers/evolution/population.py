"""Populations that a worker holds, generation after generation.

One exchange a generation is enough: the connecting values that rate generation g are those *of*
generation g, computed as soon as its individuals are evaluated.

    begin():          create and evaluate generation 0, tell its values
    advance(values):  rate generation g with everybody's values of g, breed and evaluate g + 1,
                      tell its values
    ... and in the last generation, advance rates and breeds no more.

The values ``best`` of a generation are those of the best individual of the last generation that has
been rated; before the first one, of the individual that is best without the connecting terms.

Everything follows from (seed, stream, population, generation, strings, values of all): strings
restored from a snapshot and the logged values give the same future, bit for bit, on any worker.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import UnsuitableWork
from tramnet_workers.evolution.coupling import CoupledProblem, Flags, means, medians
from tramnet_workers.evolution.encodings import Layout, decode, gene_steps, pack, unpack
from tramnet_workers.evolution.generation import (
    SCALED,
    SHIFT,
    TOURNAMENT,
    first_generation,
    make_breeding,
    next_generation,
    rank,
)
from tramnet_workers.mpga_settings import Coding, Connect, GeneticSettings, Selection

Floats = NDArray[np.float64]

_RULES = {
    Selection.ROULETTE_SHIFT: SHIFT,
    Selection.ROULETTE_SCALED: SCALED,
    Selection.TOURNAMENT: TOURNAMENT,
}
_REDUCTIONS: Mapping[Connect, Callable[[Flags, Floats, Floats], None] | None] = {
    Connect.MEAN: means,
    Connect.MEDIAN: medians,
    Connect.BEST: None,  # the traits of the best individual, which ranking knows
}


class Ranking(NamedTuple):
    """The best individuals of a generation of k populations, for Figs 9 and 10.

    Attributes:
        rows: Largest and mean fitness, then traits and terms of the best individual, of shape
            (k, 2 + n_traits + n_terms).
        n_traits: Number of traits.
    """

    rows: Floats
    n_traits: int

    @property
    def best(self) -> Floats:
        """Largest fitness F_i,max, of shape (k,)."""
        return self.rows[:, 0]

    @property
    def mean(self) -> Floats:
        """Mean fitness, of shape (k,)."""
        return self.rows[:, 1]

    @property
    def traits(self) -> Floats:
        """Traits of the best individuals, of shape (k, n_traits)."""
        return self.rows[:, 2 : 2 + self.n_traits]

    @property
    def terms(self) -> Floats:
        """Terms of the best individuals, of shape (k, n_terms)."""
        return self.rows[:, 2 + self.n_traits :]


class Advance(NamedTuple):
    """What one generation yields.

    Attributes:
        ranking: The best of the generation that has been rated, rows as in ``Ranking``.
        values: Own connecting values of the generation that follows, of shape (k, n_traits); None
            after the last one.
    """

    ranking: Floats
    values: Floats | None


class PopulationState:
    """Populations ``first`` to ``last``, exclusive, of a problem.

    Args:
        problem: What they evolve on.
        genetic: Settings of the genetic algorithm.
        seed: Seed of the run, 0 to 2**64 - 1.
        first: First population held.
        last: Last one, exclusive.
        stream: Number of the first population's stream; runs of one seed that are to differ, such
            as the steps of Progressive Design, differ in it.
    """

    def __init__(
        self,
        problem: CoupledProblem,
        genetic: GeneticSettings,
        seed: int,
        first: int,
        last: int,
        stream: int = 0,
    ) -> None:
        self._problem, self._genetic, self._first = problem, genetic, first
        self._gray = genetic.coding is Coding.GRAY
        self._reduce = _REDUCTIONS[genetic.connect]
        self.generation = -1
        lower, upper = problem.lower[first:last], problem.upper[first:last]
        self._free = np.flatnonzero((problem.lower != problem.upper).any(axis=0))
        if not len(self._free):
            raise UnsuitableWork("mpga", "no gene with two different limits", "one at least")
        k, m = last - first, genetic.population_size
        self._lower, self._step = lower, gene_steps(lower, upper, genetic.bits)
        self._layout = Layout(len(self._free), genetic.bits)
        self._breeding = make_breeding(
            self._layout,
            m,
            rule=_RULES[genetic.selection],
            crossover=genetic.crossover,
            mutation=genetic.mutation,
            elites=genetic.elites,
        )
        numbers = range(stream + first, stream + last)
        self._keys = np.array([(seed, number) for number in numbers], np.uint64)
        self._strings = np.zeros((k, self._layout.n_words, m), np.uint64)
        self._spare = np.zeros_like(self._strings)
        self._genes = np.repeat(lower[:, :, None], m, axis=2)
        self._traits = np.empty((k, len(problem.circular), m))
        self._terms = np.zeros((k, problem.n_terms, m))
        self._fitness = np.empty((k, m))

    @property
    def finished(self) -> bool:
        """Whether the last generation has been evaluated: what is left is to rate it."""
        return self.generation == self._genetic.generations - 1

    @property
    def fitness(self) -> Floats:
        """Fitness of the generation that was rated last, of shape (k, m)."""
        return self._fitness.copy()

    def begin(self) -> Floats:
        """Create and evaluate generation 0 and return its connecting values."""
        first_generation(self._keys, self._layout.used(), self._strings)
        self.generation = 0
        self._evaluate()
        if self._reduce is None:
            self._rate(None)
            return self.ranked(self._rank()).traits.copy()
        return self._values()

    def advance(self, values: Floats) -> Advance:
        """Rate the present generation and, unless it is the last, breed and evaluate the next.

        Args:
            values: Connecting values of all populations in the present generation, of shape
                (t, n_traits).
        """
        self._rate(values)
        ranking = self._rank()
        if self.finished:
            return Advance(ranking, None)
        self.generation += 1
        next_generation(
            self._breeding, self._keys, self.generation, self._fitness, self._strings, self._spare
        )
        self._strings, self._spare = self._spare, self._strings
        self._evaluate()
        if self._reduce is None:
            return Advance(ranking, self.ranked(ranking).traits.copy())
        return Advance(ranking, self._values())

    def snapshot(self) -> NDArray[np.uint8]:
        """Return the strings of the present generation, packed: 500 bytes for 100 of 40 bits.

        Returns:
            Chromosomes, of shape (k, m, bytes of a chromosome).
        """
        return pack(self._strings, self._layout)

    def restore(self, generation: int, packed: NDArray[np.uint8]) -> None:
        """Take back a snapshot of a generation.

        Raises:
            UnsuitableWork: It is of other populations or settings.
        """
        k, _, m = self._strings.shape
        expected = (k, m, -(-self._layout.n_bits // 8))
        if packed.shape != expected or packed.dtype != np.uint8:
            found = f"a snapshot of {packed.dtype} and shape {packed.shape}"
            raise UnsuitableWork("mpga", found, f"uint8 of shape {expected}")
        self._strings = unpack(packed, self._layout)
        self.generation = generation
        self._evaluate()

    def _evaluate(self) -> None:
        bits = self._layout.bits
        decode(self._strings, bits, self._gray, self._lower, self._step, self._free, self._genes)
        self._problem.evaluate(self._first, self._genes, self._traits, self._terms)

    def _rate(self, values: Floats | None) -> None:
        self._problem.rate(
            self._first, self.generation, values, self._traits, self._terms, self._fitness
        )

    def _values(self) -> Floats:
        assert self._reduce is not None
        values = np.empty(self._traits.shape[:2])
        self._reduce(self._problem.circular, self._traits, values)
        return values

    def ranked(self, rows: Floats) -> Ranking:
        """Return what ``advance`` ranked, with names."""
        return Ranking(rows, len(self._problem.circular))

    def _rank(self) -> Floats:
        rows = np.empty((len(self._traits), 2 + self._traits.shape[1] + self._terms.shape[1]))
        rank(self._fitness, self._traits, self._terms, rows)
        return rows


def evolve(
    state: PopulationState, generation: int, packed: NDArray[np.uint8], values: Floats
) -> tuple[NDArray[np.uint8], Advance]:
    """Return the next generation of packed populations, whatever ``state`` held before.

    Args:
        state: Populations of the problem, settings and seed in question.
        generation: Generation of the packed populations.
        packed: Their chromosomes, as ``PopulationState.snapshot`` returned them.
        values: Connecting values of all populations in that generation, of shape (t, n_traits).

    Returns:
        The packed chromosomes of the next generation, and what ``advance`` yields.
    """
    state.restore(generation, packed)
    advance = state.advance(values)
    return state.snapshot(), advance
