"""Table 4 of Lin, Chen & Yu (2017) beside our own times, and what to read out of it."""

from collections.abc import Sequence

import numpy as np
from rich.table import Table

from tramnet_master.experiments.paper_times import NAIVE, PAPER_TIMES, PaperTime, Printed
from tramnet_master.reports.tables import new_table
from tramnet_master.tracking_times import SHARED, MethodTime

CAPTION = """×: how many times as long the naive search of 5^8 takes there.
CPU/ours: how many times as long the paper's CPU took."""

QUALITY_CAPTION = """Mean and largest error and smallest clearance after the first 50 points [cm];
roughness: mean change of a joint's step [deg]."""

ABOUT_398 = (
    "The paper's 398 is against the naive search of its grid, in which each of the 390,625 combinations is "
    "computed in full."
)


def time_table(ours: Sequence[MethodTime]) -> Table:
    """Times of a step: the paper's, and ours where there are some."""
    table = new_table("Lin, Chen & Yu (2017), table 4: time of a step [ms]", CAPTION)
    table.add_column("step by", no_wrap=True)
    by_name = {time.name: time for time in ours}
    naive = by_name.get(NAIVE)
    for name in ("CPU", "×", "GPU", "×", "ours", *(["×"] if naive else []), "CPU/ours"):
        table.add_column(name, justify="right")
    for name in dict.fromkeys([*PAPER_TIMES, *by_name]):
        table.add_row(name, *_cells(PAPER_TIMES.get(name), by_name.get(name), naive))
    return table


def quality_table(ours: Sequence[MethodTime]) -> Table:
    """How well the path was followed by each method that followed all of it."""
    table = new_table("The path by each method", QUALITY_CAPTION)
    table.add_column("step by", no_wrap=True)
    for name in ("candidates", "error", "largest", "clearance", "roughness"):
        table.add_column(name, justify="right")
    for time in ours:
        path = time.quality
        if path is not None:
            table.add_row(
                time.name,
                f"{time.evaluations:,}",
                f"{path.error_mean:.1e}",
                f"{path.error_max:.1e}",
                f"{path.clearance_min_settled:.2f}",
                f"{np.degrees(path.roughness):.4f}",
            )
    return table


def reading(ours: Sequence[MethodTime]) -> str:
    """What the times say, in words, with what was measured of them."""
    by_name = {time.name: time for time in ours}
    naive, shared, eamp = (by_name.get(name) for name in (NAIVE, SHARED, "EAMP 500/10"))
    if naive is None or shared is None or eamp is None:
        return (
            f"{ABOUT_398} With shared prefixes the same search finds the same steps and takes about as long as the "
            "EAMP: `tramnet table redundant8` measures both here."
        )
    text = (
        f"{ABOUT_398} Here that takes {_ms(naive)} ms, {naive.seconds / eamp.seconds:.0f} times as long as EAMP "
        f"500/10. With shared prefixes the same search finds the same steps {naive.seconds / shared.seconds:.0f} "
        f"times as fast, in {_ms(shared)} ms: {shared.seconds / eamp.seconds:.1f} times the {_ms(eamp)} ms of the "
        "EAMP."
    )
    if eamp.quality is None or shared.quality is None:
        return text
    return (
        f"{text} What the EAMP gains over the grid is accuracy, not time: its mean error is "
        f"{eamp.quality.error_mean:.4f} cm, that of the grid {shared.quality.error_mean:.4f} cm."
    )


def _cells(paper: PaperTime | None, own: MethodTime | None, naive: MethodTime | None) -> list[str]:
    cells = [*_printed(paper and paper.cpu), *_printed(paper and paper.gpu)]
    if own is None:
        return cells
    ratio = [_ratio(naive.seconds / own.seconds)] if naive is not None else []
    faster = _ratio(paper.cpu.milliseconds / (1e3 * own.seconds)) if paper is not None else ""
    return [*cells, _ms(own), *ratio, faster]


def _printed(time: Printed | None) -> list[str]:
    return ["", ""] if time is None else [f"{time.milliseconds:g}", f"{time.speed_up:g}"]


def _ratio(ratio: float) -> str:
    return f"{ratio:,.0f}" if ratio > 9.5 else f"{ratio:.1f}"


def _ms(time: MethodTime) -> str:
    return f"{1e3 * time.seconds:.3g}"
