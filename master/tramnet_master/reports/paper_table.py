"""Table 2 of Wang & Zalzala (1995) beside our own results.

The paper reports one run of each case; we report the median over seeds, and the range.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from rich import box
from rich.table import Table
from rich.text import Text


@dataclass(frozen=True)
class PaperCase:
    """A row of Table 2.

    Attributes:
        case: Its number.
        grid: Nodes a side of the grid.
        time: Whether the motion time is in the objective.
        torque: Whether the torques are.
        velocity: Whether the end velocities are.
        motion_time: Motion time of the best plan [s].
        generation: Generation of the best plan.
    """

    case: int
    grid: int
    time: bool
    torque: bool
    velocity: bool
    motion_time: float
    generation: int

    @property
    def criteria(self) -> str:
        """The objective, a letter a term."""
        terms = {"T": self.time, "τ": self.torque, "v": self.velocity}
        return " ".join(letter for letter, used in terms.items() if used)


TABLE_2 = (
    PaperCase(1, 16, True, False, True, 0.431, 70),
    PaperCase(2, 16, True, False, False, 0.375, 255),
    PaperCase(3, 16, False, True, True, 0.502, 248),
    PaperCase(4, 16, False, True, False, 0.307, 220),
    PaperCase(5, 16, True, True, True, 0.873, 280),
    PaperCase(6, 16, True, True, False, 0.367, 285),
    PaperCase(7, 25, True, False, True, 0.421, 40_000),
)

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
    rows = {row.case: row for row in TABLE_2}
    table = Table(
        title=Text("Wang & Zalzala (1995), Table 2: motion times [s]"),
        caption=Text(CAPTION),
        title_justify="left", caption_justify="left", title_style="bold", caption_style="",
        box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0),
    )  # fmt: skip
    table.add_column("case", no_wrap=True)
    table.add_column("for", no_wrap=True)
    for name in ("paper", "ours", "range", "to paper", "end", "generations"):
        table.add_column(name, justify="right", min_width=5)
    for outcome in outcomes:
        table.add_row(*_cells(rows[outcome.case], outcome))
    return table


def _cells(paper: PaperCase, ours: CaseOutcome) -> list[Text]:
    times, middle = ours.motion_times, median(ours.motion_times)
    name = f"{ours.case} {ours.variant}".rstrip()
    style = "green" if middle <= paper.motion_time else "bold red"
    shortest, longest = f"{min(times):.3f}", f"{max(times):.3f}"
    return [
        Text(name),
        Text(paper.criteria),
        Text(f"{paper.motion_time:.3f}"),
        Text(f"{middle:.4f}", style=style),
        Text(shortest if shortest == longest else f"{shortest}–{longest}"),
        Text(f"{middle / paper.motion_time - 1:+.1%}", style=style),
        Text(f"{median(ours.end_velocities):.0e}"),
        Text(f"{paper.generation:,}, {median(ours.generations):,.0f}"),
    ]
