"""The multi-population genetic algorithm in one process: the method, without a network.

Kim & Khosla (1992), section 4. The network does the same with the populations on several workers;
both give the same bits, because everything random is keyed and all reductions go in index order.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.evolution.coupling import CoupledProblem
from tramnet_workers.evolution.population import PopulationState
from tramnet_workers.mpga_settings import GeneticSettings

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class MpgaResult:
    """What a run found.

    Attributes:
        best: Largest fitness F_i,max of each generation and population, of shape (G, t); Fig. 9.
        mean: Mean fitness, of shape (G, t).
        traits: Traits of the best individuals, of shape (G, t, n_traits); Fig. 10 is the sum of
            their link lengths.
        terms: Terms of the best individuals of the last generation, of shape (t, n_terms).
        values: Connecting values of each generation, of shape (G, t, n_traits).
        evaluations: Individuals evaluated.
    """

    best: Floats
    mean: Floats
    traits: Floats
    terms: Floats
    values: Floats
    evaluations: int

    @property
    def final_traits(self) -> Floats:
        """Traits of the best individuals of the last generation, of shape (t, n_traits)."""
        final: Floats = self.traits[-1]
        return final


def run_mpga(
    problem: CoupledProblem,
    genetic: GeneticSettings,
    seed: int,
    *,
    stream: int = 0,
    parts: int = 1,
) -> MpgaResult:
    """Evolve all populations of a problem.

    Args:
        problem: What the populations evolve on.
        genetic: Settings of the genetic algorithm.
        seed: Seed of the run.
        stream: Number of the first population's random stream.
        parts: Number of workers to play; changes nothing but who computes what.
    """
    t = problem.n_populations
    cuts = [t * part // parts for part in range(parts + 1)]
    states = [
        PopulationState(problem, genetic, seed, first, last, stream)
        for first, last in pairwise(cuts)
        if first < last
    ]
    values, logged, rows = np.concatenate([state.begin() for state in states]), [], []
    for _ in range(genetic.generations):
        advances = [state.advance(values) for state in states]
        logged.append(values)
        rows.append(_joined([advance.ranking for advance in advances]))
        told = [advance.values for advance in advances if advance.values is not None]
        values = _joined(told) if told else values
    history, n_traits = np.array(rows), len(problem.circular)
    return MpgaResult(
        best=history[:, :, 0],
        mean=history[:, :, 1],
        traits=history[:, :, 2 : 2 + n_traits],
        terms=history[-1, :, 2 + n_traits :],
        values=np.array(logged),
        evaluations=t * genetic.population_size * genetic.generations,
    )


def _joined(parts: list[Floats]) -> Floats:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)
