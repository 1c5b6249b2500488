"""Genetic operators on real numbers: laws, and agreement with a plain Python counterpart."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters
from tramnet_workers.evolution.real_coded import Operators, Place, next_generation, scatter
from tramnet_workers.evolution.smooth import SmoothEvolution, SmoothSettings
from tramnet_workers.evolution.streams import Purpose
from tramnet_workers.kernels.random import below, gaussian, new_stream, open_stream, uniform

Array = NDArray[np.float64]
Stream = NDArray[np.uint64]

D = 7
LOWER, UPPER = np.full(D, -2.0), np.full(D, 3.0)
USUAL = Operators(3, 0.9, 0.5, 0.3, 0.1, 2)

seeds = st.integers(0, 2**64 - 1)
sizes = st.integers(2, 30)


def place(seed: int, generation: int = 1) -> Place:
    return Place(np.uint64(seed), 0, generation)  # type: ignore[arg-type]


def population(seed: int, size: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    # Few different objectives, so that equal ones occur.
    return rng.uniform(LOWER, UPPER, (size, D)), rng.integers(0, size, size).astype(np.float64)


@given(seeds, sizes)
def test_children_stay_in_the_box(seed: int, size: int) -> None:
    genomes, objectives = population(seed, size)
    wild = USUAL._replace(blend=3.0, mutation=1.0, deviation=2.0)

    children = next_generation(place(seed), wild, genomes, objectives, LOWER, UPPER)

    assert (children >= LOWER).all()
    assert (children <= UPPER).all()


@given(seeds, sizes)
def test_the_best_survive_in_order_and_among_equals_the_first(seed: int, size: int) -> None:
    genomes, objectives = population(seed, size)

    children = next_generation(place(seed), USUAL, genomes, objectives, LOWER, UPPER)

    best = sorted(range(size), key=lambda i: (objectives[i], i))[:2]
    assert (children[:2] == genomes[best]).all()


@given(seeds, sizes)
def test_without_crossover_and_mutation_children_are_copies(seed: int, size: int) -> None:
    genomes, objectives = population(seed, size)
    copying = USUAL._replace(crossover=0.0, mutation=0.0)

    children = next_generation(place(seed), copying, genomes, objectives, LOWER, UPPER)

    assert {child.tobytes() for child in children} <= {genome.tobytes() for genome in genomes}


@given(seeds, sizes)
def test_without_blending_beyond_children_lie_between_the_population_s_ends(
    seed: int, size: int
) -> None:
    genomes, objectives = population(seed, size)
    inside = USUAL._replace(blend=0.0, mutation=0.0)

    children = next_generation(place(seed), inside, genomes, objectives, LOWER, UPPER)

    assert (children >= genomes.min(axis=0)).all()
    assert (children <= genomes.max(axis=0)).all()


@given(seeds)
def test_harder_tournaments_prefer_better_parents(seed: int) -> None:
    genomes, _ = population(seed, 200)
    objectives = np.arange(200.0)

    def mean_rank(tournament: int) -> float:
        copying = USUAL._replace(tournament=tournament, crossover=0.0, mutation=0.0, elites=0)
        children = next_generation(place(seed), copying, genomes, objectives, LOWER, UPPER)
        ranks = [int((genomes == child).all(axis=1).argmax()) for child in children]
        return float(np.mean(ranks))

    # The smallest of t even draws from 0..199 lies at about 200 / (t + 1).
    assert mean_rank(1) == pytest.approx(100.0, abs=25.0)
    assert mean_rank(3) == pytest.approx(50.0, abs=20.0)
    assert mean_rank(9) == pytest.approx(20.0, abs=12.0)


@given(seeds)
def test_the_same_key_breeds_the_same_children(seed: int) -> None:
    genomes, objectives = population(seed, 10)

    first, again, later = (
        next_generation(place(seed, k), USUAL, genomes, objectives, LOWER, UPPER) for k in (1, 1, 2)
    )

    assert first.tobytes() == again.tobytes()
    assert first.tobytes() != later.tobytes()


@given(seeds, sizes, st.sampled_from([USUAL, USUAL._replace(tournament=1, mutation=1.0)]))
def test_children_are_those_of_plain_python(seed: int, size: int, operators: Operators) -> None:
    genomes, objectives = population(seed, size)

    children = next_generation(place(seed, 5), operators, genomes, objectives, LOWER, UPPER)

    expected = plain_generation(seed, 5, operators, genomes, objectives)
    assert children == pytest.approx(expected, abs=1e-12)


@given(seeds)
def test_a_first_population_scatters_about_its_centre(seed: int) -> None:
    centre = np.linspace(-0.5, 0.5, D)

    genomes = scatter(place(seed, 0), centre, 0.1, LOWER, UPPER, 400)

    assert (genomes[0] == centre).all()
    assert genomes.mean(axis=0) == pytest.approx(centre, abs=0.08)
    assert genomes.std(axis=0) == pytest.approx(np.full(D, 0.25), abs=0.06)


def test_a_run_of_the_algorithm_finds_the_bottom_of_a_bowl() -> None:
    bottom = np.linspace(-0.7, 0.9, 10)

    def bowl(genomes: Array) -> Array:
        return np.asarray((np.arange(1, 11) ** 2 * (genomes - bottom) ** 2).sum(axis=1))

    algorithm = SmoothEvolution(1, 60, 120, np.full(10, -1.0), np.full(10, 1.0))
    genomes = algorithm.initial()
    for generation in range(1, 120):
        genomes = algorithm.breed(genomes, bowl(genomes), generation)

    assert (genomes[bowl(genomes).argmin()]) == pytest.approx(bottom, abs=0.01)


@pytest.mark.parametrize(
    ("generation", "deviation"), [(1, 0.05), (500, 0.001 + 0.049 / 8), (999, 0.001), (2000, 0.001)]
)
def test_mutations_shrink_from_the_first_deviation_to_the_last(
    generation: int, deviation: float
) -> None:
    always = SmoothSettings(mutation=1.0, elites=0)
    algorithm = SmoothEvolution(1, 1000, 1000, LOWER, UPPER, always)
    alike = np.tile(0.5 * (LOWER + UPPER), (1000, 1))

    children = algorithm.breed(alike, np.zeros(1000), generation)

    shifts = (children - alike) / (0.5 * (UPPER - LOWER))
    assert shifts.std() == pytest.approx(deviation, rel=0.05)


def test_a_population_of_elites_alone_is_refused() -> None:
    with pytest.raises(InvalidParameters, match="more individuals than elites"):
        SmoothEvolution(1, 2, 10, LOWER, UPPER)


def plain_generation(
    seed: int, generation: int, operators: Operators, genomes: Array, objectives: Array
) -> Array:
    """Breed child by child, in the words of the module's description."""
    size = len(genomes)

    def opened(purpose: Purpose, slot: int) -> Stream:
        stream = new_stream()
        open_stream(stream, np.uint64(seed), 0, generation, int(purpose), slot)  # type: ignore[arg-type]
        return stream

    def winner(stream: Stream) -> Array:
        drawn = [below(stream, size) for _ in range(operators.tournament)]
        return genomes[min(drawn, key=lambda i: (objectives[i], i))]

    ranking = sorted(range(size), key=lambda i: (objectives[i], i))
    children = [genomes[i] for i in ranking[: operators.elites]]
    for slot in range(operators.elites, size):
        stream = opened(Purpose.SELECTION, slot)
        mother, father = winner(stream), winner(stream)
        stream = opened(Purpose.CROSSOVER, slot)
        crosses = uniform(stream) < operators.crossover
        shares = np.array([uniform(stream) for _ in range(D)])
        shares = (1.0 + 2.0 * operators.blend) * shares - operators.blend
        child = mother + shares * (father - mother) if crosses else mother.copy()
        stream = opened(Purpose.MUTATION, slot)
        for gene in range(D):
            if uniform(stream) < operators.mutation:
                half = 0.5 * (UPPER - LOWER)[gene]
                child[gene] += operators.deviation * half * gaussian(stream)
        children.append(np.clip(child, LOWER, UPPER))
    return np.array(children)
