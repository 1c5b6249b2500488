"""Runs the cases of Wang & Zalzala (1995) on local workers and lays out table 2 beside them."""

import datetime
from pathlib import Path

from rich.table import Table

from tramnet_master.commands.launch import RUNS, make_run
from tramnet_master.console import people
from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.paper_cases import paper_cases
from tramnet_master.experiments.puma560 import NAME, Choice, options_of, prepare
from tramnet_master.experiments.run_options import RunOptions
from tramnet_master.reports.paper_table import CaseOutcome, paper_table
from tramnet_master.results import MotionResult

VARIANTS: dict[int, dict[str, dict[str, object]]] = {
    7: {"literal": {"switch": "literal"}, "continuous": {"switch": "continuous"}}
}
"""Cases that are run more than once, with the settings that set the runs apart."""


def run_cases(
    seeds: int, cases: str, robot: str, workers: int, out: Path | None, overwrite: bool
) -> Table:
    """Run cases with some seeds each and return the paper's table beside ours.

    Args:
        seeds: Number of seeds for each case.
        cases: Cases to run, such as ``1,3-5``.
        robot: ``akb`` or ``p560``.
        workers: Number of local workers.
        out: Folder of the runs' folders, or None for a new one.
        overwrite: Whether runs that are there give way.

    Raises:
        InvalidOption: There is no such case or robot.
    """
    now = datetime.datetime.now().astimezone()
    folder = out or RUNS / f"table-{NAME}-{now:%Y-%m-%d-%H%M%S}"
    outcomes = []
    for number in _numbers(cases):
        for variant, settings in VARIANTS.get(number, {"": {}}).items():
            results = []
            for seed in range(1, seeds + 1):
                path = folder / f"case-{number}{f'-{variant}' if variant else ''}-seed-{seed}"
                choice = Choice(number, None, robot, "wang-zalzala", seed, None, None, settings)
                prepared = prepare(options_of(choice))
                people.print(f"case {number} {variant} seed {seed}".replace("  ", " "))
                result = make_run(prepared, RunOptions(workers), path, overwrite)
                assert isinstance(result, MotionResult), "puma560 plans motions"
                results.append(result)
            outcomes.append(_outcome(number, variant, results))
    return paper_table(outcomes)


def _outcome(number: int, variant: str, results: list[MotionResult]) -> CaseOutcome:
    return CaseOutcome(
        number,
        variant,
        tuple(result.motion_time_s for result in results),
        tuple(result.end_velocity_rad_s for result in results),
        tuple(result.best.generation for result in results),
    )


def _numbers(text: str) -> list[int]:
    """Return the numbers that words like ``1,3-5`` name.

    Raises:
        InvalidOption: A word names none, or no case of the paper.
    """
    known = [case.number for case in paper_cases().cases]
    expected = f"cases between {known[0]} and {known[-1]}, such as 1,3 or 1-6"
    numbers: list[int] = []
    for word in text.split(","):
        first, _, last = word.partition("-")
        if not (first.strip().isdigit() and (last or first).strip().isdigit()):
            raise InvalidOption("--cases", repr(text), expected)
        numbers += range(int(first), int(last or first) + 1)
    if not numbers or not set(numbers) <= set(known):
        raise InvalidOption("--cases", repr(text), expected)
    return numbers
