"""Turns a piece of work into its outcome, with the problem this worker was set up for."""

import time

import numpy as np

from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evaluate, Evaluated, Outcome, Setup, Work
from tramnet_workers.errors import UnsuitableWork, WrongResult
from tramnet_workers.problems.problem import Problem
from tramnet_workers.problems.registry import build


class Evaluator:
    """Computes outcomes.

    Args:
        setup: Name and parameters of the problem.
    """

    def __init__(self, setup: Setup) -> None:
        self._problem: Problem = build(setup.problem, setup.parameters)
        self._name = setup.problem
        self._shape = tuple(self._problem.genome_shape)
        self._dtype = np.dtype(self._problem.genome_dtype)
        empty = np.empty((0, *self._shape), self._dtype)
        empty.setflags(
            write=False
        )  # as what arrives is: kernels are compiled for either kind apart
        self._problem.evaluate(empty)  # loads the compiled kernels before the first real chunk

    def compute(self, work: Work) -> Outcome:
        """Return the outcome of a piece of work.

        Args:
            work: What to compute.

        Raises:
            UnsuitableWork: The work does not fit this worker's problem.
            WrongResult: The problem returned something that is no column of objectives.
        """
        match work:
            case Evaluate():
                return self._evaluate(work)
            case _:
                raise UnsuitableWork(self._name, type(work).__name__, "Evaluate")

    def _evaluate(self, work: Evaluate) -> Evaluated:
        genomes = work.genomes.unpack()
        expected = (work.work.size, *self._shape)
        if genomes.shape != expected or genomes.dtype != self._dtype:
            found = f"{genomes.dtype} chromosomes of shape {genomes.shape}"
            raise UnsuitableWork(self._name, found, f"{self._dtype} {expected}")
        started = time.perf_counter()
        objectives = np.asarray(self._problem.evaluate(genomes))
        seconds = time.perf_counter() - started
        if objectives.shape != expected[:1] or objectives.dtype != np.float64:
            found_type = (str(objectives.dtype), objectives.shape)
            raise WrongResult(self._name, found_type, (work.work.size,))
        return Evaluated(work.work, Array.pack(objectives), seconds)
