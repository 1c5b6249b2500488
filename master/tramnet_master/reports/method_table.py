"""Methods of ``crank`` at equal evaluations, for more and more task points.

Kim & Khosla (1992) claim that the cost of a population does not grow with the task points, and it does
not. A search of the link lengths alone, with exact poses, finds the best arm all the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import mean

from rich import box
from rich.table import Table
from rich.text import Text

METHODS = ("mpga", "single-ga", "bilevel-cma")

CAPTION = """Quality: dexterity of the links found, with exact poses, over that of the
best arm; mean (worst) over the seeds. t: task points. Seconds a run, in the order
of the methods.
ms: of mpga, for one population."""


@dataclass(frozen=True)
class MethodOutcome:
    """What a method found for a number of task points, over one or more seeds.

    Attributes:
        method: The method.
        task_points: Number of task points.
        quality: Quality of each seed's links, 1 being the best there is.
        seconds: Duration of each seed's run [s].
    """

    method: str
    task_points: int
    quality: tuple[float, ...]
    seconds: tuple[float, ...]


def method_table(outcomes: Sequence[MethodOutcome], budget: int) -> Table:
    """The methods side by side, a row for each number of task points, best qualities green.

    Args:
        outcomes: What the methods found; a method may be missing in some rows.
        budget: Evaluations that each method may spend for each task point.
    """
    table = Table(
        title=Text(f"Quality at equal evaluations, {budget:,} for each task point"),
        caption=Text(f"{CAPTION}\n{claims(outcomes)}"),
        title_justify="left", caption_justify="left", title_style="bold", caption_style="",
        box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0),
    )  # fmt: skip
    for name in ("t", *METHODS, "seconds", "ms"):
        table.add_column(name, justify="right", no_wrap=True)
    for t in sorted({outcome.task_points for outcome in outcomes}):
        row = {outcome.method: outcome for outcome in outcomes if outcome.task_points == t}
        best = max(mean(outcome.quality) for outcome in row.values())
        cells = [_cell(row[method], best) if method in row else Text("") for method in METHODS]
        seconds = (_seconds(mean(row[m].seconds)) if m in row else "-" for m in METHODS)
        each = f"{1e3 * _each(row['mpga']):.1f}" if "mpga" in row else ""
        table.add_row(Text(f"{t}"), *cells, Text(", ".join(seconds)), Text(each))
    return table


def claims(outcomes: Sequence[MethodOutcome]) -> str:
    """What the outcomes say about the paper's claim and about the alternative, in two lines."""
    each = [_each(outcome) for outcome in outcomes if outcome.method == "mpga"]
    lines = []
    if len(each) > 1:
        lines.append(
            f"Dearest population over cheapest: {max(each) / min(each):.2f}; the paper says constant."
        )
    ahead, compared = 0, 0
    for t in {outcome.task_points for outcome in outcomes}:
        row = {o.method: mean(o.quality) for o in outcomes if o.task_points == t}
        if {"mpga", "bilevel-cma"} <= set(row):
            compared += 1
            ahead += row["bilevel-cma"] > row["mpga"]
    if compared:
        lines.append(f"CMA-ES on the links alone is ahead of mpga in {ahead} of {compared} rows.")
    return "\n".join(lines)


def _each(outcome: MethodOutcome) -> float:
    return mean(outcome.seconds) / outcome.task_points


def _seconds(seconds: float) -> str:
    """Return a time in as few characters as a column of a terminal has for it."""
    return f"{seconds:.1f}" if seconds < 10.0 else f"{seconds:.0f}"


def _cell(outcome: MethodOutcome, best: float) -> Text:
    found = mean(outcome.quality)
    text = f"{found:.4f} ({min(outcome.quality):.4f})"
    return Text(text, style="green" if found == best else "")
