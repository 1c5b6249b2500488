"""Progress in a terminal: one line with a bar, redrawn ten times a second by a thread of rich.

``update`` only notes numbers; the thread that draws fetches them. So it costs the run nothing, and the line goes
on living while a long generation is under way.
"""

import time

from rich.console import Console, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from tramnet_master.progress import PERIOD, Clock, Counts, Outline, duration, plural

BAR_WIDTH = 20
LEAST_BAR = 5


class TerminalProgress:
    """A bar with generation, best, evaluations per second, live workers and time left."""

    def __init__(self, console: Console | None = None, clock: Clock = time.monotonic) -> None:
        self._console = console or Console(stderr=True)
        self._clock = clock
        self._counts = Counts(Outline("", 0), clock)
        self._live: Live | None = None

    def start(self, outline: Outline) -> None:
        """Begin to draw."""
        self._counts = Counts(outline, self._clock)
        self._live = Live(
            console=self._console,
            get_renderable=self.render,
            refresh_per_second=1 / PERIOD,
            transient=True,
        )
        self._live.start()

    def update(self, generation: int, best: float, evaluations: int, workers: int) -> None:
        """Note the state; the thread draws it."""
        counts = self._counts
        counts.generation, counts.best = generation, best
        counts.evaluations, counts.workers = evaluations, workers

    def message(self, text: str) -> None:
        """Print it above the bar."""
        self._console.print(text, highlight=False, markup=False)

    def finish(self, text: str = "") -> None:
        """Remove the bar and print how it ended."""
        if self._live is None:
            return
        self._live.stop()
        self._live = None
        if text:
            self.message(text)

    def render(self) -> RenderableType:
        """The line as it is now, fitted to the width of the terminal."""
        counts, line = self._counts, Table.grid(padding=(0, 2))
        facts, room = _that_fit(self._facts(), self._console.width)
        bar = ProgressBar(max(counts.outline.generations, 1), counts.generation, width=room)
        for _ in range(len(facts) + 1):
            line.add_column(no_wrap=True)
        drawn: list[RenderableType] = [bar] if room >= LEAST_BAR else []
        line.add_row(facts[0], *drawn, *facts[1:])
        return line

    def _facts(self) -> list[str]:
        """What to show, in order of place."""
        counts = self._counts
        rate, left = counts.rates()
        named = [counts.outline.title, f"{counts.generation}/{counts.outline.generations}"]
        if counts.workers == 0:
            return [*named, "waiting for workers"]
        workers = f"{counts.workers} {plural('worker', counts.workers)}"
        time_left = [f"{duration(left)} left"] if left is not None else []
        return [*named, f"best {counts.best:.5g}", f"{short(rate)} eval/s", workers, *time_left]


def _that_fit(facts: list[str], width: int) -> tuple[list[str], int]:
    """The facts that fit into the width, and the room they leave for the bar."""
    kept = list(facts)
    for least in (facts[0], *facts[3:5]):  # title, rate and workers can be missed first
        if _room(kept, width) >= 0:
            break
        kept.remove(least)
    return kept, min(BAR_WIDTH, _room(kept, width))


def _room(facts: list[str], width: int) -> int:
    return width - sum(len(fact) + 2 for fact in facts)


def short(rate: float) -> str:
    """A rate in three digits: ``950``, ``52.3k``, ``1.2M``."""
    for size, letter in ((1e6, "M"), (1e3, "k")):
        if rate >= size:
            return f"{rate / size:.3g}{letter}"
    return f"{rate:.3g}"
