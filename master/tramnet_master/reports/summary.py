"""What a run found, for the terminal: the figures that matter, and what the verification says."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import msgspec
from rich.console import Console
from rich.table import Table
from rich.text import Text

from tramnet_master.console import people
from tramnet_master.progress import plural
from tramnet_master.reports.design_record import read_design
from tramnet_master.reports.design_summary import design_facts, design_verdict, points_table
from tramnet_master.reports.findings import Findings
from tramnet_master.reports.tables import new_table
from tramnet_master.results import Booked, ServoResult
from tramnet_master.run_folder import DESIGN
from tramnet_master.wording import time_span

Fact = tuple[str, str]

COMPARED = {
    "paper": "paper",
    "straight line": "straight_line_time_s",
    "least time T*": "limit_time_s",
}
"""What the motion time is compared with: names, and keys of the result."""


def print_summary(folder: Path, console: Console = people) -> None:
    """Print what a finished run found.

    Args:
        folder: Its folder.
        console: Where to.

    Raises:
        NotARunFolder: There is no finished run in it.
        DamagedFile: Its result is torn.
    """
    found = Findings.read(folder)
    console.print(Text(found.caption, style="bold"))
    facts = Table.grid(padding=(0, 2))
    for name, text in facts_of(found):
        facts.add_row(name, text)
    console.print(facts)
    if found.rows("verification"):
        console.print(verification_table(found.rows("verification")))
        console.print(verdict(found))
    if found.servo is not None:
        console.print(servo_table(found.servo))
    if found.rows("scenes"):
        from tramnet_master.reports.tracking_summary import tracking_tables  # noqa: PLC0415  slow

        for table in tracking_tables(folder, found):
            console.print(table)
    if (folder / DESIGN).is_file():
        console.print(points_table(read_design(folder / DESIGN)))
        console.print(design_verdict(found))
    console.print(f"results in {folder}", markup=False, soft_wrap=True)


def facts_of(found: Findings) -> Iterator[Fact]:
    """The figures of a run, each with its name."""
    best = found.table("best")
    if found.rows("scenes"):
        from tramnet_master.reports.tracking_summary import tracking_facts  # noqa: PLC0415  slow

        yield from tracking_facts(found)
    else:
        objective = _short(best.get("objective"))
        yield "objective", f"{objective}, first in generation {best['generation']}"
        yield from _motion(found)
    if "arm" in found.keys:
        yield from design_facts(found)
    yield "evaluations", _evaluations(found)
    lost, condemned = found.number("lost_workers") or 0, len(found.rows("condemned"))
    workers = int(found.number("workers") or 0)
    yield (
        "workers",
        f"{workers} {plural('worker', workers)} in a {found.text('topology')}, {lost:g} lost, "
        f"{condemned} {plural('individual', condemned)} condemned",
    )
    yield from _link_books(found)
    yield (
        "paths" if found.rows("scenes") else "population",
        f"SHA-256 {found.text('final_population_sha256')[:16]}..",
    )
    if found.keys.get("reproducible") is False:
        yield "", "[yellow]not reproducible: workers of other arithmetic were admitted[/yellow]"


def _motion(found: Findings) -> Iterator[Fact]:
    time = found.number("motion_time_s")
    if time is None:
        return
    yield "motion time", f"{time:.4f} s"
    for name, key in COMPARED.items():
        other = found.number(key)
        if other:
            yield f"  {name}", f"{other:.4f} s; the plan is {_compared(time / other - 1)}"
    yield "end velocity", f"{_short(found.number('end_velocity_rad_s'))} rad/s, over all joints"


def _link_books(found: Findings) -> Iterator[Fact]:
    """What the network would have been like if it had been made of transputers: virtual time, not this run's."""
    books = found.table("link_books")
    if not books:
        return
    booked = msgspec.convert(books, Booked)
    each = ", ".join(
        f"{time_span(seconds)} to {kind}" for kind, seconds in booked.seconds_each.items()
    )
    left_out = booked.rounds - booked.booked
    yield (
        f"on {booked.node}",
        f"{time_span(booked.seconds)} of virtual time for {booked.booked:,} rounds"
        f"{f' ({left_out:,} not booked)' if left_out else ''}, {each}",
    )
    if booked.busiest is not None:
        yield (
            f"  {booked.mbaud} Mbaud",
            f"{booked.frames:,} frames, {booked.bytes:,} bytes; busiest link {booked.busiest[0]} → "
            f"{booked.busiest[1]}, busy for {booked.utilisation:.1%}",
        )


def _compared(gap: float) -> str:
    return f"{abs(gap):.1%} {'longer' if gap > 0 else 'shorter'}"


def _evaluations(found: Findings) -> str:
    text = f"{found.number('evaluations') or 0:,.0f} in {found.number('wall_seconds') or 0:.2f} s"
    rate, overhead = (
        found.number("evaluations_per_second"),
        found.number("network_overhead_fraction"),
    )
    if rate is not None:
        text += f", {rate:,.0f} a second"
    if overhead is not None:
        text += f", network overhead {overhead:.0%}"
    return text


def verification_table(checks: list[Mapping[str, object]]) -> Table:
    """The checks of a plan, a line each, good ones green and failed ones red."""
    table = new_table("Verification of the plan")
    table.add_column("check")
    table.add_column("found", justify="right")
    table.add_column("limit", justify="right")
    table.add_column("")
    for check in checks:
        good = bool(check.get("passed"))
        table.add_row(
            str(check.get("name")),
            _with_unit(check, "value"),
            _limit(check),
            "" if check.get("limit") is None else "ok" if good else "FAILED",
            style="green" if good else "bold red",
        )
    return table


def verdict(found: Findings) -> Text:
    """Whether the plan can be carried out, and if not, why."""
    failed = [str(check.get("name")) for check in found.rows("verification") if not check["passed"]]
    reasons = found.keys.get("failures")
    if not failed and not reasons:
        return Text("The plan passed every check.", style="green")
    said = [str(reason) for reason in reasons] if isinstance(reasons, list) and reasons else failed
    return Text("The plan FAILED: " + ";\n  ".join(said) + ".", style="bold red")


def servo_table(servo: ServoResult) -> Table:
    """Errors at the end of replays through a servo, and jerks in the line below."""
    table = new_table(
        f"Replay through a servo, set-points every {servo.period_ms:g} ms",
        f"rms jerk: {min(servo.rms_jerk_ratio):.2f} to {max(servo.rms_jerk_ratio):.2f} times "
        "that of 1.75 ms",
    )
    for name in ("torque used", "motion time", "error at its end", "with feed-forward"):
        table.add_column(name, justify="right")
    for row in servo.tracking:
        errors = (row.error_rad, row.error_feed_forward_rad)
        table.add_row(
            f"{row.margin:.0%}",
            f"{row.motion_time_s:.4f} s",
            *(f"{1000 * error:.3g} mrad" for error in errors),
        )
    return table


def _limit(check: Mapping[str, object]) -> str:
    if check.get("limit") is None:
        return ""
    return f"{'≥' if check.get('at_least') else '≤'} {_with_unit(check, 'limit')}"


def _with_unit(check: Mapping[str, object], key: str) -> str:
    return f"{_short(check.get(key))} {check.get('unit') or ''}".rstrip()


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, int | float) else "none"
