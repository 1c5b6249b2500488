"""The statistics of a recording again, and its figures."""

from pathlib import Path

import msgspec
from rich.console import Console
from rich.table import Table
from rich.text import Text

from tramnet_master.console import people, write
from tramnet_master.errors import InvalidOption, RunFailed
from tramnet_master.traffic.recording import Recording, read_recording
from tramnet_master.traffic.replay import LinkTraffic, TagTraffic, links_of, tags_of
from tramnet_master.traffic.words import json_line, printable

PAGE = 120
"""Width of the tables where no terminal has one."""


def show_traffic(
    file: Path,
    out: Path | None,
    window: tuple[float | None, float | None],
    json: bool,
    pictures: bool,
) -> None:
    """Show what passed in a recording, link by link, and draw it.

    Args:
        file: The recording.
        out: Where the figures go; beside the file if None.
        window: Seconds from and up to which the space-time picture goes, or None for all.
        json: Whether to write the statistics as a JSON object.
        pictures: Whether to draw.

    Raises:
        InvalidFile: It is no recording.
        RunFailed: There is nothing on a link in it.
        InvalidOption: The window is none.
    """
    recording = read_recording(file)
    if not recording.frames:
        raise RunFailed(f"{file}: found no frame on a link, so there is no traffic to show")
    links, tags = links_of(recording), tags_of(recording)
    if json:
        write(json_line(_document(recording, links, tags)) + "\n")
    else:
        write(_text(recording, links, tags))
    if not recording.complete:
        people.print("the recorder was killed: this is what it had written out until then")
    if pictures:
        from tramnet_master.reports.traffic import (  # noqa: PLC0415  slow to import
            draw_traffic,
        )

        part = _window(recording, *window)
        for path in draw_traffic(recording, out or file.parent, file.stem, part):
            people.print(str(path), markup=False, soft_wrap=True)


def _window(
    recording: Recording, begin: float | None, end: float | None
) -> tuple[float, float] | None:
    if begin is None and end is None:
        return None
    first, last = begin or 0.0, recording.seconds if end is None else end
    if not first < min(last, recording.seconds):
        expected = f"a time before --to and the end, {recording.seconds:.3f} s"
        raise InvalidOption("--from", f"{first:g}", expected)
    return first, last


def _document(
    recording: Recording, links: list[LinkTraffic], tags: list[TagTraffic]
) -> dict[str, object]:
    return {
        "file": str(recording.path),
        "about": recording.about,
        "recorder": recording.end,
        "complete": recording.complete,
        "seconds": recording.seconds,
        "frames": len(recording.frames),
        "others": recording.others,
        "links": msgspec.to_builtins(links),
        "tags": msgspec.to_builtins(tags),
    }


def _text(recording: Recording, links: list[LinkTraffic], tags: list[TagTraffic]) -> str:
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=PAGE)
    about = recording.about
    named = [about.get(name, "") for name in ("network", "title", "topology")]
    with console.capture() as captured:
        facts = [
            *filter(None, named),
            f"{recording.seconds:.3f} s",
            f"{len(recording.frames):,} frames",
        ]
        console.print(printable("  ·  ".join(facts)), markup=False, soft_wrap=True)
        console.print()
        console.print(_table(_LINKS, links))
        console.print()
        console.print(_table(_TAGS, tags))
    return captured.get()


_LINKS = {
    "link": "{0.link}", "frames": "{0.frames:,}", "kB": "{1:,.1f}", "mean B": "{0.mean_bytes:,.0f}",
    "frames/s": "{0.frames_per_s:,.1f}", "kB/s": "{2:,.1f}", "peak": "{3:,.1f}",
    "of 20 Mbd": "{0.utilisation:.1%}", "missed": "{0.missed:,}",
}  # fmt: skip
_TAGS = {
    "message": "{0.tag}", "frames": "{0.frames:,}", "kB": "{1:,.1f}", "mean B": "{0.mean_bytes:,.0f}",
    "hops": "{0.hops:.2f}",
}  # fmt: skip


def _table(columns: dict[str, str], rows: list[LinkTraffic] | list[TagTraffic]) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="bold underline")
    for position, title in enumerate(columns):
        table.add_column(title, justify="right" if position else "left", no_wrap=True)
    for row in rows:
        kilobytes = [row.bytes / 1e3]
        if isinstance(row, LinkTraffic):
            kilobytes += [row.bytes_per_s / 1e3, row.peak_bytes_per_s / 1e3]
        table.add_row(*(Text(printable(form.format(row, *kilobytes))) for form in columns.values()))
    return table
