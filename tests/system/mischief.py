"""A problem some of whose individuals do what evaluations should not do; installed by tests."""

import ctypes
import os

import numpy as np


def memory():
    kept = []
    while True:
        kept.append(np.empty(2**27))  # 1 GiB


def loop():
    while True:
        pass


def hang():
    ctypes.PyDLL(None).sleep(3600)  # without letting go of the interpreter


def raise_():
    raise ValueError("an individual nobody can evaluate")


DEEDS = {
    "exception": raise_,
    "loop": loop,
    "hang": hang,
    "segfault": lambda: ctypes.string_at(0),
    "exit": lambda: os._exit(0),
    "memory": memory,
}
VALUES = {"nan": np.nan, "inf": np.inf, "minus-inf": -np.inf}


class Mischief:
    """The sphere function of two genes, with a list of (deed, genes) that go wrong."""

    name = "mischief"
    genome_shape = (2,)
    genome_dtype = np.dtype(np.float64)
    lower = np.full(2, -5.0)
    upper = np.full(2, 5.0)

    def __init__(self, poison):
        self.poison = poison

    def evaluate(self, genomes):
        objectives = np.square(genomes).sum(axis=1)
        for deed, genes in self.poison:
            hit = (genomes == np.array(genes)).all(axis=1)
            if not hit.any():
                continue
            if deed == "shape":
                return objectives[:, None]
            if deed in VALUES:
                objectives[hit] = VALUES[deed]
            else:
                DEEDS[deed]()
        return objectives


def build(parameters):
    return Mischief(**parameters)
