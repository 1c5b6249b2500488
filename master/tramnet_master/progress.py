"""Progress of a run, shown to people or written for scripts.

A run calls ``update`` once a generation, which may be 50,000 times a minute, so the call only notes four numbers
and, at most ten times a second, shows them. What shows them is chosen once, by ``open_progress``:

* a terminal gets a bar (``terminal_progress``), a pipe or a log a plain line every five seconds;
* ``quiet`` shows nothing; ``json`` writes one JSON object a line, on standard output.
"""

import enum
import sys
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Protocol, TextIO

import msgspec

Clock = Callable[[], float]

PERIOD = 0.1  # between two pictures [s]
LINE_PERIOD = 5.0  # between two plain lines [s]
WINDOW = 50  # pictures over which a rate is taken: 5 s of them


class ProgressMode(enum.StrEnum):
    """How a run shows its progress."""

    AUTO = "auto"
    QUIET = "quiet"
    JSON = "json"


@dataclass(frozen=True)
class Outline:
    """What is known of a run before it begins.

    Attributes:
        title: What runs, in a few words: ``puma560 case 1``.
        generations: Number of the last generation.
        first: Generations done already, by the run that is resumed.
        evaluations: Individuals evaluated already.
    """

    title: str
    generations: int
    first: int = 0
    evaluations: int = 0


class Progress(Protocol):
    """Where a run tells how far it is."""

    def start(self, outline: Outline) -> None:
        """Begin to show."""

    def update(self, generation: int, best: float, evaluations: int, workers: int) -> None:
        """Note the state at the end of a generation, or after a worker came or went.

        Args:
            generation: Generations completed.
            best: Lowest objective so far.
            evaluations: Individuals evaluated so far.
            workers: Live workers.
        """

    def message(self, text: str) -> None:
        """Tell something that happened: a worker lost, a damaged checkpoint."""

    def finish(self, text: str = "") -> None:
        """Stop showing and say how it ended; a second call does nothing."""


class Counts:
    """The latest numbers of a run, and the rates they make.

    Attributes:
        outline: The run.
        generation: Generations completed.
        best: Lowest objective so far, NaN before the first generation.
        evaluations: Individuals evaluated so far.
        workers: Live workers.
    """

    __slots__ = ("_clock", "_seen", "best", "evaluations", "generation", "outline", "workers")

    def __init__(self, outline: Outline, clock: Clock) -> None:
        self.outline = outline
        self.generation, self.evaluations = outline.first, outline.evaluations
        self.best, self.workers = float("nan"), 0
        self._clock = clock
        self._seen = deque([(clock(), outline.first, outline.evaluations)], maxlen=WINDOW)

    def rates(self) -> tuple[float, float | None]:
        """Evaluations per second, and seconds left, None while nobody can know."""
        now = self._clock()
        then, generation, evaluations = self._seen[0]
        self._seen.append((now, self.generation, self.evaluations))
        elapsed, done = now - then, self.generation - generation
        if elapsed <= 0:
            return 0.0, None
        left = self.outline.generations - self.generation
        return (self.evaluations - evaluations) / elapsed, left * elapsed / done if done else None


class QuietProgress:
    """Shows nothing."""

    def start(self, outline: Outline) -> None:
        """Show nothing."""

    def update(self, generation: int, best: float, evaluations: int, workers: int) -> None:
        """Show nothing."""

    def message(self, text: str) -> None:
        """Show nothing."""

    def finish(self, text: str = "") -> None:
        """Show nothing."""


class _Throttled(ABC):
    """Notes every update and shows one in ``period`` seconds, and the last."""

    def __init__(self, stream: TextIO, period: float, clock: Clock) -> None:
        self._stream, self._period, self._clock = stream, period, clock
        self._counts = Counts(Outline("", 0), clock)
        self._next, self._stale, self._running = 0.0, False, False

    def start(self, outline: Outline) -> None:
        """Begin to show."""
        self._counts = Counts(outline, self._clock)
        self._next, self._running = self._clock() + self._period, True
        self._begin(outline)

    def update(self, generation: int, best: float, evaluations: int, workers: int) -> None:
        """Note the state, and show it if it is time."""
        counts = self._counts
        counts.generation, counts.best = generation, best
        counts.evaluations, counts.workers = evaluations, workers
        self._stale = True
        if self._clock() >= self._next:
            self._show_now()

    def finish(self, text: str = "") -> None:
        """Show the last state and say how it ended."""
        if not self._running:
            return
        self._running = False
        if self._stale:
            self._show_now()
        self._end(text)

    def _show_now(self) -> None:
        self._next, self._stale = self._clock() + self._period, False
        self._show(self._counts)

    def _write(self, line: str) -> None:
        self._stream.write(line + "\n")
        self._stream.flush()

    @abstractmethod
    def _begin(self, outline: Outline) -> None: ...

    @abstractmethod
    def _show(self, counts: Counts) -> None: ...

    @abstractmethod
    def _end(self, text: str) -> None: ...


class LineProgress(_Throttled):
    """A plain line now and then, for pipes and the logs of containers."""

    def __init__(
        self, stream: TextIO, period: float = LINE_PERIOD, clock: Clock = time.monotonic
    ) -> None:
        super().__init__(stream, period, clock)

    def message(self, text: str) -> None:
        """Write it."""
        self._write(text)

    def _begin(self, outline: Outline) -> None:
        self._write(f"{outline.title}: {outline.generations} generations")

    def _show(self, counts: Counts) -> None:
        rate, left = counts.rates()
        self._write(
            f"generation {counts.generation}/{counts.outline.generations}, best {counts.best:.6g}, "
            f"{rate:,.0f} evaluations/s, {counts.workers} {plural('worker', counts.workers)}"
            + (f", {duration(left)} left" if left is not None else "")
        )

    def _end(self, text: str) -> None:
        if text:
            self._write(text)


class JsonProgress(_Throttled):
    """One JSON object a line: ``start``, ``progress``, ``message`` and ``finish``."""

    def __init__(
        self, stream: TextIO, period: float = PERIOD, clock: Clock = time.monotonic
    ) -> None:
        super().__init__(stream, period, clock)

    def message(self, text: str) -> None:
        """Write it as an object of its own."""
        self._object({"event": "message", "text": text})

    def _begin(self, outline: Outline) -> None:
        self._object({"event": "start", **asdict(outline)})

    def _show(self, counts: Counts) -> None:
        rate, left = counts.rates()
        self._object(
            {
                "event": "progress",
                "generation": counts.generation,
                "generations": counts.outline.generations,
                "best": counts.best,
                "evaluations": counts.evaluations,
                "evaluations_per_second": rate,
                "workers": counts.workers,
                "seconds_left": left,
            }
        )

    def _end(self, text: str) -> None:
        self._object({"event": "finish", "text": text})

    def _object(self, fields: dict[str, object]) -> None:
        # msgspec writes NaN and infinities as null, which JSON can say.
        self._write(msgspec.json.encode(fields).decode())


def open_progress(mode: ProgressMode) -> Progress:
    """What shows a run's progress in this mode, on this process's streams."""
    if mode is ProgressMode.QUIET:
        return QuietProgress()
    if mode is ProgressMode.JSON:
        return JsonProgress(sys.stdout)
    if not sys.stderr.isatty():
        return LineProgress(sys.stderr)
    from tramnet_master.terminal_progress import TerminalProgress  # noqa: PLC0415  rich is slow

    return TerminalProgress()


def plural(noun: str, number: int) -> str:
    """The noun, with an s unless there is one of it."""
    return noun if number == 1 else noun + "s"


def duration(seconds: float) -> str:
    """Seconds as people write them: ``4 s``, ``2 min 05 s``, ``1 h 03 min``."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
