"""What a design found, for the terminal: the arm, what it is worth, and its task points one by one."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from tramnet_master.progress import plural
from tramnet_master.reports.design_record import DesignFile, DesignPoint
from tramnet_master.reports.findings import Findings

Fact = tuple[str, str]

MOST_POINTS = 24
"""Points that a table shows; of more, those at which something fails come first."""


def design_facts(found: Findings) -> Iterator[Fact]:
    """The figures of a design, each with its name."""
    yield "links", f"{_lengths(found.column('link_lengths_m'))} m"
    if found.column("designed_lengths_m") not in ([], found.column("link_lengths_m")):
        yield "  as designed", f"{_lengths(found.column('designed_lengths_m'), 4)} m"
    yield "base", f"({_lengths(found.column('base_m'))}) m"
    points = int(found.number("task_points") or 0)
    mean = found.number("dexterity_mean") or 0.0
    yield "dexterity", f"{mean:.4f} in the mean of {points} task {plural('point', points)}"
    yield from _quality(found.table("quality"))
    spread, elbows = found.number("link_spread_m"), found.number("elbow_agreement")
    if spread is not None:
        text = f"link lengths {1e3 * spread:.3g} mm apart"
        if elbows is not None:
            text += f", {elbows:.0%} of the elbows agree"
        yield "populations", text
    returns = found.number("returns")
    if returns is not None:
        yield "returns", f"{returns:g} to step 1"
    yield from _motion(found)


def design_verdict(found: Findings) -> Text:
    """Whether every limit is kept, and if not, which are not."""
    if found.keys.get("verified"):
        return Text("The arm keeps every limit at all its points.", style="green")
    counts = ", ".join(f"{name} {count}x" for name, count in found.table("violations").items())
    return Text(f"The arm violates limits: {counts}.", style="bold red")


def points_table(design: DesignFile) -> Table:
    """A line for each task point: place, pose, dexterity, and what fails there."""
    points = design.task_points
    shown = _shown(points)
    title = "Task points"
    if len(shown) < len(points):
        title = f"{len(shown)} of {len(points)} task points, those that fail first"
    table = Table(
        title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )  # fmt: skip
    strokes = ["strokes [m]"] if design.prismatic_links else []
    # As Text, since rich takes words in brackets for styles.
    for name in ("station", "place [m]", "pose [°]", *strokes):
        table.add_column(Text(name))
    for name in ("DM", "RC [mm]", "JAC [rad]"):
        table.add_column(Text(name), justify="right")
    table.add_column("fails")
    for point in shown:
        table.add_row(*_cells(design, point), style="bold red" if point.fails else None)
    return table


def _quality(quality: Mapping[str, object]) -> Iterator[Fact]:
    if not quality:
        return
    optimum, designed, built = (
        float(str(quality[name])) for name in ("dexterity_optimum", "designed", "built")
    )
    lengths = quality["optimal_lengths_m"]
    assert isinstance(lengths, list)
    unaware = "" if quality.get("knows_obstacles") else ", which knows no obstacles"
    yield (
        "  of the optimum",
        f"{designed:.2%} designed, {built:.2%} built; "
        f"the best arm{unaware}: {_lengths(lengths, 4)} m, {optimum:.4f}",
    )


def _motion(found: Findings) -> Iterator[Fact]:
    error, end = found.number("tracking_error_max_m"), found.number("end_error_max_rad")
    if error is None or end is None:
        return
    text = f"tip at most {1e3 * error:.2g} mm off the path, joints {1e3 * end:.2g} mrad off at ends"
    peak = found.number("null_motion_peak_over_mean")
    if peak is not None:
        text += f", null motion peak over mean {peak:.3f}"
    yield "motion", text


def _shown(points: Sequence[DesignPoint]) -> list[DesignPoint]:
    if len(points) <= MOST_POINTS:
        return list(points)
    chosen = sorted(range(len(points)), key=lambda i: (not points[i].fails, i))[:MOST_POINTS]
    return [points[i] for i in sorted(chosen)]


def _cells(design: DesignFile, point: DesignPoint) -> list[str]:
    angles = np.degrees(point.pose_rad)
    cells = [
        f"{point.station:.4g}",
        _lengths(point.point_m),
        ", ".join(f"{angle:.1f}" for angle in angles),
    ]
    if design.prismatic_links:
        cells.append(_lengths(point.strokes_m))
    terms = point.constraints
    return [
        *cells,
        _number(point.dexterity, "{:.4f}"),
        _number(_scaled(terms.get("rc"), 1e3), "{:.2g}"),
        _number(terms.get("jac"), "{:.3f}"),
        ", ".join(point.fails),
    ]


def _scaled(value: float | None, scale: float) -> float | None:
    return None if value is None else scale * value


def _number(value: float | None, pattern: str) -> str:
    return "none" if value is None else pattern.format(value)


def _lengths(values: Sequence[float], digits: int = 3) -> str:
    return ", ".join(f"{value:.{digits}g}" for value in values)
