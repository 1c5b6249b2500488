"""The sphere function: the plainest problem there is, to learn from, to test with and to measure the farm by."""

import time
from collections.abc import Mapping
from typing import Annotated, Self

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidParameters


class Sphere(Struct, frozen=True, forbid_unknown_fields=True):
    """Minimise the sum of squares of x - 1 over vectors x whose components lie in [-5, 5].

    Attributes:
        dimension: Number of components.
        delay: Time to sleep for each individual, to stand for a dear evaluation [s].
    """

    dimension: Annotated[int, Meta(ge=1, le=10_000)] = 10
    delay: Annotated[float, Meta(ge=0.0, le=60.0)] = 0.0

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Build the problem from plain values.

        Raises:
            InvalidParameters: One is unknown or out of range.
        """
        try:
            return msgspec.convert(dict(parameters), cls, strict=True)
        except msgspec.ValidationError as error:
            raise InvalidParameters("sphere", str(error)) from error

    @property
    def name(self) -> str:
        """Name in the registry."""
        return "sphere"

    @property
    def genome_shape(self) -> tuple[int, ...]:
        """Shape of one vector."""
        return (self.dimension,)

    @property
    def genome_dtype(self) -> np.dtype[np.generic]:
        """Element type of a vector."""
        return np.dtype(np.float64)

    @property
    def lower(self) -> NDArray[np.float64]:
        """Smallest components, of shape (dimension,)."""
        return np.full(self.dimension, -5.0)

    @property
    def upper(self) -> NDArray[np.float64]:
        """Largest components, of shape (dimension,)."""
        return np.full(self.dimension, 5.0)

    def evaluate(self, genomes: NDArray[np.generic]) -> NDArray[np.float64]:
        """Return the objectives of vectors of shape (n, dimension), of shape (n,)."""
        if self.delay:
            time.sleep(self.delay * len(genomes))
        vectors = genomes.astype(np.float64, copy=False)
        total = np.zeros(len(vectors))
        for column in vectors.T:  # in this order for every individual, wherever it stands
            total += (column - 1.0) * (column - 1.0)
        return total
