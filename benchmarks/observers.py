"""What those who watch a run cost it: `tramnet inspect`, the same with --sniff, echo and record.

    python -m benchmarks.observers [ROUNDS]

A root and two workers make generations of the sphere function as fast as they can, which keeps two cores busy, so
that whatever an observer takes on such a machine is missing. Each observer comes and goes, `inspect` several times,
and as many windows of two seconds lie beside its visits as in them. Compared is the mean generation of the best
window with it and of the best without it, which the machine's other work disturbed least. The bar is 1.02 for
`inspect`, which reads what is published anyway once a second; what --sniff, echo and record cost, which have every
frame sent once more, is printed for information, as is the share of each in the compute time of all processes.
"""

import contextlib
import os
import pty
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from benchmarks.farm import DIMENSION, POPULATION, Repeat

from tramnet_master.engines.engine import GenerationRow
from tramnet_master.engines.farmed import GenerationalEngine
from tramnet_master.experiments.experiment import Common, Experiment, Load, Timing
from tramnet_master.experiments.run_options import RunOptions
from tramnet_master.experiments.runner import run
from tramnet_master.progress import QuietProgress
from tramnet_master.results import Result
from tramnet_master.run_folder import OpenRunFolder
from tramnet_protocol.messages import Outcome, Setup, Work

WINDOW = 2.0  # [s]
SETTLING = 1.5  # [s]
ROUNDS = 5
HALF = 3  # windows on either side of a visit
JUDGED = "inspect"
REQUIRED_RATIO = 1.02
FOR_EVER = 10**9  # generations

OBSERVERS = {
    "inspect": ["inspect"],
    "inspect --sniff": ["inspect", "--sniff"],
    "echo": ["echo", "link/**"],
    "record": ["record"],
}


class Window(NamedTuple):
    """A stretch of the run.

    Attributes:
        generation: Mean time of a generation [us].
        own: Share that the observer's own process has in the compute time.
    """

    generation: float
    own: float


class CountingEngine(GenerationalEngine):
    """An engine that counts its generations and ends when told to."""

    def __init__(self) -> None:
        super().__init__(Repeat(), FOR_EVER)
        self.enough = threading.Event()
        self.done = 0

    @property
    def finished(self) -> bool:
        """Whether it was told to end."""
        return self.enough.is_set()

    def tell(self, work: Work, outcome: Outcome) -> list[GenerationRow]:
        """Take the objectives of the current generation."""
        self.done += 1
        return super().tell(work, outcome)


class Comparison(threading.Thread):
    """Lets observers come and go beside a run.

    Args:
        engine: The run's engine.
        rounds: How often the one that is judged comes.

    Attributes:
        watched: Windows with each observer.
        alone: Windows beside them without it, as many.
    """

    def __init__(self, engine: CountingEngine, rounds: int) -> None:
        super().__init__()
        self.watched: dict[str, list[Window]] = {name: [] for name in OBSERVERS}
        self.alone: dict[str, list[Window]] = {name: [] for name in OBSERVERS}
        self._engine = engine
        self._rounds = rounds

    def run(self) -> None:
        """Measure, then end the run."""
        try:
            while self._engine.done < POPULATION:
                time.sleep(0.1)
            for name in OBSERVERS:
                for _ in range(self._rounds if name == JUDGED else 1):
                    self._visit(name)
        finally:
            self._engine.enough.set()

    def _visit(self, name: str) -> None:
        """Measure beside an observer, with it and beside it again."""
        self.alone[name] += [self._measure() for _ in range(HALF)]
        with observer(OBSERVERS[name]) as pid:
            self.watched[name] += [self._measure(pid) for _ in range(2 * HALF)]
        self.alone[name] += [self._measure() for _ in range(HALF)]

    def _measure(self, observer: int | None = None) -> Window:
        began, before, done = time.perf_counter(), compute_seconds(), self._engine.done
        time.sleep(WINDOW)
        generations = self._engine.done - done
        passed, after = time.perf_counter() - began, compute_seconds()
        used = {pid: seconds - before.get(pid, 0.0) for pid, seconds in after.items()}
        all_used = sum(used.values())
        own = used.get(observer, 0.0) / all_used if observer is not None else 0.0
        return Window(1e6 * passed / generations, own)


def compute_seconds() -> dict[int, float]:
    """Compute time of this process and all that descend from it, by process [s]."""
    seconds = {}
    for pid in (os.getpid(), *descendants(os.getpid())):
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        seconds[pid] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return seconds


def descendants(pid: int) -> list[int]:
    """Processes that descend from one."""
    found = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in map(int, task.read_text().split()):
            found += [child, *descendants(child)]
    return found


@contextlib.contextmanager
def observer(words: list[str]) -> Iterator[int]:
    """Let an observer watch, from when it is there; yields its process."""
    own, other = pty.openpty()
    with tempfile.TemporaryDirectory() as folder, _drained(own) as shown:
        live = words[0] == "inspect"
        more = [f"{folder}/a.mcap"] if words[0] == "record" else []
        process = subprocess.Popen(
            [sys.executable, "-m", "tramnet_master", *words, *more],
            stdin=other, stdout=other if live else subprocess.DEVNULL, stderr=other,
            env={**os.environ, "TERM": "xterm", "COLUMNS": "100", "LINES": "30"},
        )  # fmt: skip
        os.close(other)
        try:
            shown.wait(SETTLING)  # echo says nothing before its end
            time.sleep(SETTLING)
            yield process.pid
        finally:
            process.terminate()
            process.wait()


@contextlib.contextmanager
def _drained(terminal: int) -> Iterator[threading.Event]:
    """Read away what is shown, as a terminal does; yields what tells of the first byte."""
    shown = threading.Event()

    def read() -> None:
        with contextlib.suppress(OSError):
            while os.read(terminal, 1 << 16):
                shown.set()

    reader = threading.Thread(target=read)
    reader.start()
    try:
        yield shown
    finally:
        reader.join()
        os.close(terminal)


def compare(rounds: int) -> Comparison:
    """Make the run and return what was measured beside it."""
    engine = CountingEngine()
    comparison = Comparison(engine, rounds)
    setup = Setup("sphere", {"dimension": DIMENSION, "delay": 0.0})

    def conclude(_: OpenRunFolder, common: Common, __: Timing, ___: Load) -> Result:
        return Result(**common)

    experiment = Experiment(
        "sphere", "repeat", None, 0, POPULATION, FOR_EVER, setup, engine, {}, None, conclude
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        comparison.start()
        run(
            experiment,
            RunOptions(workers=2, checkpoint_seconds=600.0),
            lambda document: OpenRunFolder.create(Path(folder) / "run", document),
            QuietProgress(),
        )
        comparison.join()
    return comparison


def main() -> None:
    """Print what each observer costs."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS
    print("a generation while somebody watches, over one while nobody does (best windows)")
    found = compare(rounds)
    for name in OBSERVERS:
        watched, alone = found.watched[name], found.alone[name]
        ratio = min(w.generation for w in watched) / min(w.generation for w in alone)
        own = statistics.median(window.own for window in watched)
        reached = "reached" if ratio <= REQUIRED_RATIO else "MISSED"
        bar = f" (bar: {REQUIRED_RATIO}, {reached})" if name == JUDGED else ""
        print(f"  {name:16} {ratio:.3f}{bar}; {own:.1%} of the compute time")


if __name__ == "__main__":
    main()
