"""What a run of ``redundant8`` found, for the terminal: errors, clearances, times, and the paper's beside them."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from tramnet_master.progress import plural
from tramnet_master.reports.findings import Findings
from tramnet_master.reports.tables import new_table
from tramnet_master.reports.time_table import reading, time_table
from tramnet_master.reports.tracking_record import EXPERIMENT
from tramnet_master.run_folder import RunFolder
from tramnet_master.tracking_times import MethodTime, label
from tramnet_workers.tracking_methods import build_method

MOST_LINES = 40
"""Scenes of which the summary has a line; ``result.json`` has all."""

_COLUMNS = {
    "error": "tracking_error_mean_cm",
    "largest": "tracking_error_max_cm",
    "clearance": "clearance_min_cm",
    "after 50": "clearance_min_after_50_cm",
    "outside": "points_outside_zone",
    "step": "max_step_deg",
    "rough": "roughness_deg",
}


def tracking_facts(found: Findings) -> Iterator[tuple[str, str]]:
    """The figures of a run, each with its name; of several scenes the worst."""
    best = found.table("best")
    outside = int(found.number("points_outside_zone") or 0)
    yield (
        "error",
        f"mean {_short(found.number('tracking_error_mean_cm'))} cm, "
        f"largest {_short(found.number('tracking_error_max_cm'))} cm, "
        f"{outside} {plural('point', outside)} outside the zone",
    )
    yield "clearance", _clearance(found)
    yield (
        "steps",
        f"at most {_short(found.number('max_step_deg'))} deg, "
        f"roughness {_short(found.number('roughness_deg'))} deg",
    )
    yield "highest cost", f"{_short(best.get('objective'))}, at point {best.get('generation')}"
    times, network = found.table("ms_per_step"), found.table("network")
    yield (
        "time of a step",
        f"{_short(times.get('compute'))} ms computing, {_short(times.get('total'))} ms in all",
    )
    yield (
        "network",
        f"{_short(network.get('ms_per_step'))} ms a step, {network.get('exchanges')} exchanges"
        f"{_idle(found)}",
    )
    if network.get("advice"):
        yield "", str(network["advice"])


def _clearance(found: Findings) -> str:
    least = found.number("clearance_min_cm")
    if least is None:
        return "no box"
    if least <= 0.0:
        return "[bold red]none: the arm touches a box[/bold red]"
    settled = found.number("clearance_min_after_50_cm")
    after = "" if settled is None else f", {_short(settled)} cm after the first 50 points"
    return f"at least {_short(least)} cm{after}"


def _idle(found: Findings) -> str:
    busy, wall = found.table("network").get("worker_busy_seconds"), found.number("wall_seconds")
    if not isinstance(busy, list) or not busy or not wall:
        return ""
    shares = [f"{max(0.0, 1.0 - seconds / wall):.0%}" for seconds in busy[:8]]
    rest = ", ..." if len(busy) > len(shares) else ""
    return f"; {plural('worker', len(busy))} idle {', '.join(shares)}{rest} of the time"


def tracking_tables(folder: Path, found: Findings) -> Iterator[RenderableType]:
    """The scenes, where there are several; the paper's times, where its task was run.

    Args:
        folder: The run folder.
        found: What its result says.
    """
    rows = found.rows("scenes")
    if len(rows) > 1:
        yield scenes_table(rows)
    own = _own_time(folder, found) if found.number("case") == 1 else None
    if own is not None:
        yield time_table([own])
        yield Text(reading([own]))


def scenes_table(rows: list[Mapping[str, object]]) -> Table:
    """A line a scene."""
    more = len(rows) - MOST_LINES
    caption = f"and {more} more in result.json" if more > 0 else ""
    table = new_table("Scenes: errors and clearances [cm], steps [deg]", caption)
    table.add_column("scene", no_wrap=True)
    for name in _COLUMNS:
        table.add_column(name, justify="right")
    for row in rows[:MOST_LINES]:
        table.add_row(str(row.get("name")), *(_short(row.get(key)) for key in _COLUMNS.values()))
    return table


def _own_time(folder: Path, found: Findings) -> MethodTime | None:
    """What a step of the run took, the network included, under the name of its method."""
    document, total = (
        RunFolder(folder).run().get(EXPERIMENT),
        found.table("ms_per_step").get("total"),
    )
    method = document.get("method") if isinstance(document, dict) else None
    if not isinstance(method, dict) or not isinstance(total, int | float):
        return None
    steps = int(found.number("generations") or 0)
    evaluations = int(found.number("evaluations") or 0) // max(steps, 1)
    return MethodTime(label(build_method(method)), total / 1e3, evaluations, steps, None)


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, int | float) else "none"
