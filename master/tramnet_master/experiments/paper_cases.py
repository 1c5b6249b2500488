"""The cases of Wang & Zalzala (1995), Table 2, from ``presets/puma560.toml``."""

from functools import cache
from importlib.resources import files

import msgspec
from msgspec import Struct

from tramnet_workers.problems.motion_task import ObjectiveWeights


class PaperCase(Struct, frozen=True, forbid_unknown_fields=True):
    """A row of Table 2.

    Attributes:
        number: Its number.
        segments: Segments of a trajectory, and levels of a joint: the side of the grid.
        weights: What its objective weighs.
        motion_time_s: Motion time of the paper's best plan [s].
        best_generation: Generation in which the paper found it.
        generations: Generations of a run, or None for those of all cases.
    """

    number: int
    segments: int
    weights: ObjectiveWeights
    motion_time_s: float
    best_generation: int
    generations: int | None = None

    @property
    def criteria(self) -> str:
        """The objective, a letter a term."""
        w = self.weights
        terms = {"T": w.time, "τ": w.torque, "v": w.end_velocity}
        return " ".join(letter for letter, weight in terms.items() if weight)


class PaperCases(Struct, frozen=True, forbid_unknown_fields=True, rename={"cases": "case"}):
    """All of Table 2.

    Attributes:
        generations: Generations of a run.
        population: Individuals in a generation; our choice.
        cases: The rows.
    """

    generations: int
    population: int
    cases: list[PaperCase]

    def generations_of(self, case: PaperCase) -> int:
        """Return the number of generations of a case."""
        return case.generations or self.generations

    def find(self, number: int) -> PaperCase:
        """Return a case by its number, 1 to 7."""
        return next(case for case in self.cases if case.number == number)


@cache
def paper_cases() -> PaperCases:
    """Return the cases of the paper."""
    text = files("tramnet_master.experiments.presets").joinpath("puma560.toml").read_text()
    return msgspec.toml.decode(text, type=PaperCases)
