"""Turns a piece of work into its outcome, with the problem this worker was set up for.

What a problem offers decides which kind of work it takes, and so which of three *skills* the worker has.
"""

import time
from typing import Protocol

import numpy as np

from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import (
    Evaluate,
    Evaluated,
    Outcome,
    PopulationSnapshot,
    Setup,
    Track,
    Tracked,
    Work,
)
from tramnet_workers.errors import BrokenProblem, UnsuitableWork, WrongResult
from tramnet_workers.evolution.coupling import CoupledProblem
from tramnet_workers.node.evolver import Evolver
from tramnet_workers.problems.problem import PathProblem, Problem
from tramnet_workers.problems.registry import build


class Skill(Protocol):
    """One kind of work."""

    def compute(self, work: Work) -> Outcome:
        """Return the outcome of a piece of work.

        Raises:
            UnsuitableWork: It is of another kind, or does not fit the problem.
        """

    def snapshot(self, work: Work) -> PopulationSnapshot | None:
        """Return what the root is to keep of the work just computed, if it asked for that."""


class Evaluator:
    """Computes outcomes.

    Args:
        setup: Name and parameters of the problem.
    """

    def __init__(self, setup: Setup) -> None:
        problem = build(setup.problem, setup.parameters)
        self._skill = _skill(setup.problem, problem)

    def compute(self, work: Work) -> Outcome:
        """Return the outcome of a piece of work.

        Args:
            work: What to compute.

        Raises:
            UnsuitableWork: The work does not fit this worker's problem.
            WrongResult: The problem returned something that is no column of objectives.
        """
        return self._skill.compute(work)

    def snapshot(self, work: Work) -> PopulationSnapshot | None:
        """Return what the root is to keep of the work just computed, if it asked for that."""
        return self._skill.snapshot(work)


def _skill(name: str, problem: object) -> Skill:
    match problem:
        case Problem():
            return _Chromosomes(problem)
        case PathProblem():
            return _Paths(name, problem)
        case CoupledProblem():
            return Evolver(name, problem)
    expected = "an object with name, genome_shape, genome_dtype and evaluate"
    raise BrokenProblem(name, type(problem).__qualname__, f"expected {expected}")


class _Chromosomes:
    """Evaluates chunks of chromosomes."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._shape = tuple(problem.genome_shape)
        self._dtype = np.dtype(problem.genome_dtype)
        empty = np.empty((0, *self._shape), self._dtype)
        empty.setflags(
            write=False
        )  # as what arrives is: kernels are compiled for either kind apart
        problem.evaluate(empty)  # loads the compiled kernels before the first real chunk

    def compute(self, work: Work) -> Outcome:
        if not isinstance(work, Evaluate):
            raise UnsuitableWork(self._problem.name, type(work).__name__, "Evaluate")
        genomes = work.genomes.unpack()
        expected = (work.work.size, *self._shape)
        if genomes.shape != expected or genomes.dtype != self._dtype:
            found = f"{genomes.dtype} chromosomes of shape {genomes.shape}"
            raise UnsuitableWork(self._problem.name, found, f"{self._dtype} {expected}")
        started = time.perf_counter()
        objectives = np.asarray(self._problem.evaluate(genomes))
        seconds = time.perf_counter() - started
        if objectives.shape != expected[:1] or objectives.dtype != np.float64:
            found_type = (str(objectives.dtype), objectives.shape)
            raise WrongResult(self._problem.name, found_type, (work.work.size,))
        return Evaluated(work.work, Array.pack(objectives), seconds)

    def snapshot(self, work: Work) -> PopulationSnapshot | None:
        return None


class _Paths:
    """Follows runs of points."""

    def __init__(self, name: str, problem: PathProblem) -> None:
        self._name = name
        self._problem = problem
        problem.warm_up()

    def compute(self, work: Work) -> Outcome:
        if not isinstance(work, Track):
            raise UnsuitableWork(self._name, type(work).__name__, "Track")
        posture = work.posture.unpack()
        if posture.ndim != 1 or posture.dtype != np.float64:
            found = f"a posture of {posture.dtype} and shape {posture.shape}"
            raise UnsuitableWork(self._name, found, "float64 joint angles")
        which = work.work
        started = time.perf_counter()
        run = self._problem.track(which.population, which.first, which.last, posture.astype(float))
        seconds = time.perf_counter() - started
        return Tracked(which, Array.pack(run.path), Array.pack(run.cost), seconds)

    def snapshot(self, work: Work) -> PopulationSnapshot | None:
        return None
