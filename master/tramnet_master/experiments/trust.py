"""States of a run from before each worker's first answer, to go back to where one of them has lied."""

from collections.abc import Iterable
from typing import NamedTuple

from tramnet_master.engines.engine import Engine, State
from tramnet_master.farm.events import Tram


class Before(NamedTuple):
    """A run before some worker had a part in it.

    Attributes:
        generation: Generations completed by then.
        state: The engine's state, or None before the first generation.
    """

    generation: int
    state: State | None


class Trust:
    """Remembers, for each worker, the run without it."""

    def __init__(self) -> None:
        self._before: dict[Tram, Before] = {}

    def note(self, tram: Tram, engine: Engine) -> None:
        """Remember the run as it is before a worker's first answer is told to the engine."""
        generation = engine.generation
        self._before[tram] = Before(generation, engine.state() if generation else None)

    def go_back(self, liars: Iterable[Tram]) -> Before:
        """Return the run before any of some workers had a part in it, and forget what came after.

        Workers that came later have their first answer before them again, and what they would go back to would hold
        what the liars said: it is this state for them too.
        """
        first = min((self._before[liar] for liar in liars), key=lambda before: before.generation)
        for tram, before in self._before.items():
            if before.generation > first.generation:
                self._before[tram] = first
        return first
