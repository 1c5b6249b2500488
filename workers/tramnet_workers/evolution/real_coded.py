"""Genetic operators on chromosomes of real numbers in a box.

Tournament selection (Goldberg & Deb 1991), blend crossover BLX-alpha (Eshelman & Schaffer 1993) and
Gaussian mutation, with elites. Child i of a generation draws from the streams (seed, population,
generation, purpose, i) of each purpose, and from nothing else.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.evolution.streams import Purpose
from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.random import below, gaussian, new_stream, open_stream, uniform

Floats = NDArray[np.float64]
Stream = NDArray[np.uint64]

_INITIAL = int(Purpose.INITIAL)
_SELECTION = int(Purpose.SELECTION)
_CROSSOVER = int(Purpose.CROSSOVER)
_MUTATION = int(Purpose.MUTATION)


class Place(NamedTuple):
    """Where random numbers are drawn: the part of the key that all children of a generation share.

    Attributes:
        seed: Seed of the run; a ``numpy.uint64``, so that one compiled kernel serves all seeds.
        population: Index of the population.
        generation: Index of the generation.
    """

    seed: int
    population: int
    generation: int


class Operators(NamedTuple):
    """How parents make children.

    Attributes:
        tournament: Number of individuals drawn for a tournament, at least 1.
        crossover: Probability that a child has two parents.
        blend: Alpha of the blend crossover: how far beyond its parents' genes a child's may lie, as
            a fraction of their distance.
        mutation: Probability that a gene mutates.
        deviation: Standard deviation of a mutation, as a fraction of half the gene's range.
        elites: Number of best individuals that survive unchanged.
    """

    tournament: int
    crossover: float
    blend: float
    mutation: float
    deviation: float
    elites: int


@kernel
def scatter(
    place: Place, centre: Floats, deviation: float, lower: Floats, upper: Floats, size: int
) -> Floats:
    """Return a first population: a chromosome, and others scattered about it.

    Args:
        place: Where random numbers are drawn.
        centre: The chromosome that becomes individual 0, of shape (d,).
        deviation: Standard deviation of the others' genes, as a fraction of half the gene's range.
        lower: Smallest genes, of shape (d,).
        upper: Largest genes, of shape (d,).
        size: Number N of individuals.

    Returns:
        Chromosomes, of shape (N, d).
    """
    genomes = np.empty((size, len(centre)))
    genomes[0] = centre
    stream = new_stream()
    for i in range(1, size):
        open_stream(stream, place.seed, place.population, place.generation, _INITIAL, i)
        for g in range(len(centre)):
            moved = centre[g] + deviation * 0.5 * (upper[g] - lower[g]) * gaussian(stream)
            genomes[i, g] = min(max(moved, lower[g]), upper[g])
    return genomes


@kernel
def next_generation(
    place: Place,
    operators: Operators,
    genomes: Floats,
    objectives: Floats,
    lower: Floats,
    upper: Floats,
) -> Floats:
    """Return the children of a population, after its elites.

    Args:
        place: Where random numbers are drawn.
        operators: How parents make children.
        genomes: Chromosomes, of shape (N, d); not modified.
        objectives: Their objectives, minimised, of shape (N,); among equal ones the first wins.
        lower: Smallest genes, of shape (d,).
        upper: Largest genes, of shape (d,).

    Returns:
        Chromosomes, of shape (N, d).
    """
    children = np.empty_like(genomes)
    ranking = np.argsort(objectives, kind="mergesort")
    for i in range(operators.elites):
        children[i] = genomes[ranking[i]]
    stream = new_stream()
    for i in range(operators.elites, len(genomes)):
        open_stream(stream, place.seed, place.population, place.generation, _SELECTION, i)
        mother = genomes[_win(stream, operators.tournament, objectives)]
        father = genomes[_win(stream, operators.tournament, objectives)]
        open_stream(stream, place.seed, place.population, place.generation, _CROSSOVER, i)
        _blend(stream, operators, mother, father, children[i])
        open_stream(stream, place.seed, place.population, place.generation, _MUTATION, i)
        _mutate(stream, operators, lower, upper, children[i])
    return children


@device
def _win(stream: Stream, tournament: int, objectives: Floats) -> int:
    """Return the winner of a tournament."""
    best = below(stream, len(objectives))
    for _ in range(tournament - 1):
        rival = below(stream, len(objectives))
        if objectives[rival] < objectives[best] or (
            objectives[rival] == objectives[best] and rival < best
        ):
            best = rival
    return best


@device
def _blend(
    stream: Stream, operators: Operators, mother: Floats, father: Floats, child: Floats
) -> None:
    """Draw each gene of a child evenly from between its parents' genes, and a little beyond."""
    alone = uniform(stream) >= operators.crossover
    for g in range(len(child)):
        share = (1.0 + 2.0 * operators.blend) * uniform(stream) - operators.blend
        child[g] = mother[g] + (0.0 if alone else share) * (father[g] - mother[g])


@device
def _mutate(
    stream: Stream, operators: Operators, lower: Floats, upper: Floats, child: Floats
) -> None:
    """Shift some genes of a child, and put all of them back into the box."""
    for g in range(len(child)):
        if uniform(stream) < operators.mutation:
            child[g] += operators.deviation * 0.5 * (upper[g] - lower[g]) * gaussian(stream)
        child[g] = min(max(child[g], lower[g]), upper[g])
