"""Table 2 of Wang & Zalzala (1995) beside our own results.

The paper reports one run of each case; we report the median over seeds, and the range.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from rich.table import Table
from rich.text import Text

from tramnet_master.experiments.paper_cases import PaperCase, paper_cases
from tramnet_master.reports.tables import new_table

CAPTION = """For: motion time T, torque τ, end velocities v. Ours: median over the seeds.
End: sum of the end velocities [rad/s]. Generations: when the best was found, the paper's and ours."""


@dataclass(frozen=True)
class CaseOutcome:
    """What we found for a case, over one or more seeds.

    Attributes:
        case: Number of the case.
        variant: What sets it apart from another row of the same case, or an empty string.
        motion_times: Motion time of each seed's best plan [s].
        end_velocities: Sum of the end velocities of each [rad/s].
        generations: Generation in which each was found.
    """

    case: int
    variant: str
    motion_times: tuple[float, ...]
    end_velocities: tuple[float, ...]
    generations: tuple[int, ...]


def paper_table(outcomes: Sequence[CaseOutcome]) -> Table:
    """Table 2 beside ours: green where we are at or below the paper, red where not."""
    table = new_table("Wang & Zalzala (1995), Table 2: motion times [s]", CAPTION)
    table.add_column("case", no_wrap=True)
    table.add_column("for", no_wrap=True)
    for name in ("paper", "ours", "range", "to paper", "end", "generations"):
        table.add_column(name, justify="right", min_width=5)
    for outcome in outcomes:
        table.add_row(*_cells(paper_cases().find(outcome.case), outcome))
    return table


def _cells(paper: PaperCase, ours: CaseOutcome) -> list[Text]:
    times, middle = ours.motion_times, median(ours.motion_times)
    name = f"{ours.case} {ours.variant}".rstrip()
    style = "green" if middle <= paper.motion_time_s else "bold red"
    shortest, longest = f"{min(times):.3f}", f"{max(times):.3f}"
    return [
        Text(name),
        Text(paper.criteria),
        Text(f"{paper.motion_time_s:.3f}"),
        Text(f"{middle:.4f}", style=style),
        Text(shortest if shortest == longest else f"{shortest}–{longest}"),
        Text(f"{middle / paper.motion_time_s - 1:+.1%}", style=style),
        Text(f"{median(ours.end_velocities):.0e}"),
        Text(f"{paper.best_generation:,}, {median(ours.generations):,.0f}"),
    ]
