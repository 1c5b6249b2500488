"""Figures of a recording: how full its links were over time, and what each TRAM did when."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from tramnet_master.progress import plural
from tramnet_master.reports.style import BLUE, GREEN, VERMILION, new_figure, one_look, save
from tramnet_master.traffic.recording import Recording, SeenFrame
from tramnet_master.traffic.replay import utilisation_of
from tramnet_master.traffic.rows import link_name
from tramnet_master.traffic.space_time import Doing, Stretch, stretches_of

COLOURS = {Doing.COMPUTING: BLUE, Doing.SENDING: VERMILION, Doing.PASSING: GREEN}
WAITING = "#e8e8e8"
MESSAGE = "#404040"

MOST_MESSAGES = 400
"""Frames that are drawn as lines from row to row; more would hide the rows."""

SHOWN_CHUNKS = 8
"""Answers of a worker that the picture shows where nobody says from when to when."""

_HEAD_AND_AXIS = 1.9  # [inch]
_MOST_LABELS = 36
_LEAST_WIDTH = 0.0015  # of the picture, so that what takes no time is seen


def draw_traffic(
    recording: Recording, folder: Path, name: str, window: tuple[float, float] | None
) -> list[Path]:
    """Draw both figures of a recording.

    Args:
        recording: The recording; it has frames.
        folder: Where to write them.
        name: What their names begin with.
        window: From when to when the space-time picture goes [s], or None for a few chunks in the middle.

    Returns:
        The files.

    Raises:
        CannotWrite: The disk refuses.
    """
    with one_look():
        links = save(draw_utilisation(recording), folder, f"{name}-utilisation")
        picture = draw_space_time(recording, window or middle_of(recording))
        return links + save(picture, folder, f"{name}-space-time")


def draw_utilisation(recording: Recording) -> Figure:
    """How full each directed link was over time: one row a link, darker where it was fuller."""
    found = utilisation_of(recording)
    n_links = len(found.links)
    figure = new_figure(
        _HEAD_AND_AXIS + min(8.0, 0.24 * n_links + 0.6), "Links over time", _caption(recording)
    )
    axes = figure.add_subplot()
    rows = np.arange(n_links + 1)
    most = max(float(found.shares.max(initial=0.0)), 1e-9)
    mesh = axes.pcolormesh(
        found.edges, rows, 100.0 * found.shares, cmap="Blues", vmin=0.0, vmax=100.0 * most,
        rasterized=True,
    )  # fmt: skip
    bar = figure.colorbar(mesh, ax=axes, pad=0.01)
    bar.set_label("of a 20 Mbaud direction [%]")
    bar.outline.set_visible(False)
    step = max(1, math.ceil(n_links / _MOST_LABELS))
    axes.set_yticks(rows[:-1:step] + 0.5, [link_name(*link) for link in found.links[::step]])
    axes.tick_params(axis="y", length=0)
    axes.invert_yaxis()
    axes.grid(visible=False)
    axes.set_xlabel(f"time [s], in bins of {1e3 * found.edges[1]:.3g} ms")
    return figure


def draw_space_time(recording: Recording, window: tuple[float, float]) -> Figure:
    """What each TRAM did when: one row a TRAM, with the frames between them where they are few."""
    begin, end = window
    done = stretches_of(recording.frames)
    note = f"{_caption(recording)}  ·  {begin:.3f} s to {end:.3f} s"
    figure = new_figure(
        _HEAD_AND_AXIS + min(9.0, 0.38 * len(done) + 0.5), "What each TRAM did", note
    )
    axes = figure.add_subplot()
    seats = list(done)
    row_of = {seat: row for row, seat in enumerate(seats)}
    for seat, stretches in done.items():
        _draw_row(axes, row_of[seat], stretches, window)
    shown = [frame for frame in recording.frames if begin <= frame.time <= end]
    if len(shown) <= MOST_MESSAGES:
        _draw_messages(axes, shown, row_of)
    step = max(1, math.ceil(len(seats) / _MOST_LABELS))
    axes.set_yticks(
        range(0, len(seats), step), [f"TRAM {seat}" if seat else "root" for seat in seats[::step]]
    )
    axes.tick_params(axis="y", length=0)
    axes.set_xlim(begin, end)
    axes.set_ylim(len(seats) - 0.5, -0.5)
    axes.grid(visible=False)
    axes.set_xlabel("time [s]")
    _explain(figure, done, with_messages=len(shown) <= MOST_MESSAGES)
    return figure


def middle_of(recording: Recording) -> tuple[float, float]:
    """From when to when the middle of a recording goes in which workers answer a few chunks [s]."""
    answers = [
        frame
        for frame in recording.frames
        if frame.seconds is not None and frame.link[0] == frame.source
    ]
    workers = len({frame.source for frame in answers}) or 1
    half = SHOWN_CHUNKS * workers // 2
    middle = len(answers) // 2
    shown = answers[max(0, middle - half) : middle + half]
    if len(shown) < 2:
        return 0.0, max(recording.seconds, 1e-3)
    return shown[0].time, max(shown[-1].time, shown[0].time + 1e-3)


def _draw_row(
    axes: Axes, row: int, stretches: Sequence[Stretch], window: tuple[float, float]
) -> None:
    begin, end = window
    least = _LEAST_WIDTH * (end - begin)
    axes.broken_barh([(begin, end - begin)], (row - 0.36, 0.72), facecolors=WAITING)
    for doing, colour in COLOURS.items():
        bars = [
            (stretch.begin, max(stretch.end - stretch.begin, least))
            for stretch in stretches
            if stretch.doing is doing and stretch.end >= begin and stretch.begin <= end
        ]
        place = (row + 0.1, 0.26) if doing is Doing.PASSING else (row - 0.36, 0.72)
        axes.broken_barh(bars, place, facecolors=colour)


def _draw_messages(axes: Axes, frames: Sequence[SeenFrame], row_of: dict[int, int]) -> None:
    for frame in frames:
        source, destination = (row_of[seat] for seat in frame.link)
        axes.annotate(
            "", (frame.time, destination), (frame.time, source),
            arrowprops={
                "arrowstyle": "-|>,head_width=0.12,head_length=0.25", "color": MESSAGE,
                "linewidth": 0.6, "alpha": 0.6, "shrinkA": 0, "shrinkB": 0,
            },
        )  # fmt: skip


def _explain(figure: Figure, done: dict[int, list[Stretch]], with_messages: bool) -> None:
    seen = {stretch.doing for stretches in done.values() for stretch in stretches}
    named = [
        Patch(color=colour, label=doing.value) for doing, colour in COLOURS.items() if doing in seen
    ]
    named.insert(1, Patch(color=WAITING, label="waiting"))
    if with_messages:
        named.append(Patch(color=MESSAGE, alpha=0.6, label="a frame, when it passed the root"))
    figure.legend(handles=named, loc="outside lower center", ncols=len(named))


def _caption(recording: Recording) -> str:
    about = recording.about
    facts = [about.get("title", ""), about.get("topology", ""), f"{recording.seconds:.1f} s"]
    count = len(recording.frames)
    facts.append(f"{count:,} {plural('frame', count)} on link topics, in real time")
    return "  ·  ".join(fact for fact in facts if fact)
