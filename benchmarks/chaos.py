"""A soak: workers are killed, frozen, joined and sent away at random, and the run comes out as if nothing had been.

    python -m benchmarks.chaos [--seconds 600] [--kills 100] [--seed 1] [--workers 4]

Kills come as a Poisson process with a mean of 5 s, freezes (SIGSTOP for up to 2 s) with a mean of 10 s, changes
of the number of workers with a mean of 15 s, until as many seconds and kills have passed as were asked for; then
the run goes on in peace to its end. An individual takes 1 ms of sleep, so that capacity does not depend on the
machine's cores. Bars: the hash of the undisturbed run; nobody condemned; throughput at least 0.8 of capacity,
which is the time of all live workers that were not frozen at the rate of a single worker; the root's memory grows
by less than 5 %; no process, thread, descriptor or shared memory is left behind. Deadlines are 0.5 s here: a
chunk of a frozen worker holds its whole generation up for as long as its deadline.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tramnet_master.control import ask
from tramnet_master.errors import NoNetwork
from tramnet_master.experiments.own_problem import OwnProblemOptions, prepare
from tramnet_master.experiments.runner import population_hash
from tramnet_master.networks import find
from tramnet_protocol.errors import ProtocolError
from tramnet_protocol.messages import ControlRequest, Setup
from tramnet_workers.node.evaluator import Evaluator

POPULATION = 240
DELAY = 0.001
DEADLINE = 0.5
LONGEST_FREEZE = 2.0
MEAN_KILL, MEAN_FREEZE, MEAN_SCALE = 5.0, 10.0, 15.0
PERIOD = 0.1
WARM_UP = 10.0

REQUIRED_THROUGHPUT = 0.8
MOST_GROWTH = 0.05
SPARE = 8
"""Threads and files for workers that are just coming or going."""


@dataclass
class Watched:
    """What was seen of a root.

    Attributes:
        seconds: Live seconds of workers that were not frozen, since the start of the trouble [s].
        evaluations: Evaluations when the trouble began, and at the last look.
        pids: Every worker process seen.
    """

    seconds: float = 0.0
    evaluations: tuple[int, int] = (0, 0)
    pids: set[int] = field(default_factory=set)


@dataclass(frozen=True)
class Size:
    """What a process holds.

    Attributes:
        memory: Resident memory [kB].
        threads: Number of threads.
        descriptors: Number of open files.
    """

    memory: int
    threads: int
    descriptors: int

    @classmethod
    def of(cls, pid: int) -> "Size":
        """Look at a process."""
        status = dict(
            line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines()
        )
        descriptors = len(os.listdir(f"/proc/{pid}/fd"))
        return cls(int(status["VmRSS"].split()[0]), int(status["Threads"]), descriptors)


class Soak:
    """A run in trouble.

    Args:
        seed: Of the trouble.
        folder: Where the run is kept.
        workers: Number of workers to begin with.
        generations: Length of the run.
    """

    def __init__(self, seed: int, folder: Path, workers: int, generations: int) -> None:
        self.chance = random.Random(seed)
        self.folder = folder
        self.watched = Watched()
        self.frozen: dict[int, float] = {}  # process -> when it thaws
        self.kills = self.freezes = self.scalings = 0
        self.workers = workers
        command = [
            *(sys.executable, "-m", "tramnet_master", "run", "problem", "sphere"),
            *("--set", f"delay={DELAY}", "--population", str(POPULATION)),
            *("--generations", str(generations), "--workers", str(workers)),
            *("--deadline", str(DEADLINE), "--first-deadline", "5"),
            *("--out", str(folder), "--no-pictures", "--progress", "quiet"),
        ]
        self.root = subprocess.Popen(command)
        self._looked: float | None = None

    def look(self) -> list[int]:
        """Take note of how the run is; return its live workers that are not frozen."""
        now = time.monotonic()
        status = self._status()
        members = status.get("workers", ())
        assert isinstance(members, list | tuple)
        live = [member["pid"] for member in members if member["live"]]
        self.watched.pids.update(live)
        awake = [pid for pid in live if pid not in self.frozen]
        done = status.get("evaluations")
        if isinstance(done, int):
            if self._looked is None:
                self.watched.evaluations = (done, done)
            else:
                self.watched.seconds += len(awake) * (now - self._looked)
                self.watched.evaluations = (self.watched.evaluations[0], done)
            self._looked = now
        return awake

    def kill(self) -> None:
        """Kill a worker."""
        victim = self._choose()
        if victim is not None:
            os.kill(victim, signal.SIGKILL)
            self.kills += 1

    def freeze(self) -> None:
        """Freeze a worker for a while."""
        victim = self._choose()
        if victim is not None:
            os.kill(victim, signal.SIGSTOP)
            self.frozen[victim] = time.monotonic() + self.chance.uniform(0.1, LONGEST_FREEZE)
            self.freezes += 1

    def scale(self) -> None:
        """Let workers join, or send some away."""
        self.workers = self.chance.choice([n for n in (2, 3, 4, 5, 6) if n != self.workers])
        ask(find(), ControlRequest("scale", self.workers))
        self.scalings += 1

    def thaw(self) -> None:
        """Let those go on whose time is over."""
        for pid, until in list(self.frozen.items()):
            if time.monotonic() >= until:
                del self.frozen[pid]
                if is_alive(pid):
                    os.kill(pid, signal.SIGCONT)

    def trouble(self, seconds: float, kills: int) -> None:
        """Make trouble until both have passed."""
        began = time.monotonic()
        plans: list[tuple[Callable[[], None], float]] = [
            (self.kill, MEAN_KILL), (self.freeze, MEAN_FREEZE), (self.scale, MEAN_SCALE),
        ]  # fmt: skip
        due = [began + self.chance.expovariate(1 / mean) for _, mean in plans]
        while time.monotonic() < began + seconds or self.kills < kills:
            assert self.root.poll() is None, "the run ended before its time"
            self.thaw()
            self.look()
            for i, (act, mean) in enumerate(plans):
                if time.monotonic() >= due[i]:
                    act()
                    due[i] += self.chance.expovariate(1 / mean)
            time.sleep(PERIOD)
        self.look()
        for pid in self.frozen:
            self.frozen[pid] = 0.0
        self.thaw()

    def _choose(self) -> int | None:
        candidates = [pid for pid in self.look() if is_alive(pid)]
        return self.chance.choice(candidates) if len(candidates) > 1 else None

    def _status(self) -> dict[str, object]:
        try:
            return ask(find(), ControlRequest("status")).status
        except (NoNetwork, ProtocolError):
            return {}


def is_alive(pid: int) -> bool:
    """Return whether a process exists and is no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def undisturbed(generations: int) -> str:
    """Return the hash of the run that nobody disturbs, computed in this process."""
    options = OwnProblemOptions(problem="sphere", population=POPULATION, generations=generations)
    engine, evaluator = prepare(options).engine, Evaluator(Setup("sphere", {}))
    while not engine.finished:
        for work in engine.ask():
            engine.tell(work, evaluator.compute(work))
    return population_hash(engine)


def single_worker_rate(folder: Path) -> float:
    """Return what one worker evaluates in a run of its own [1/s]."""
    soak = Soak(0, folder, 1, round(6.0 / (POPULATION * DELAY)))
    assert soak.root.wait() == 0
    result = json.loads((folder / "result.json").read_text())
    return float(result["evaluations_per_second"])


def judge(name: str, found: str, reached: bool) -> bool:
    """Print a line of the table; return whether its bar is reached."""
    print(f"  {name:42} {found:>24}   {'reached' if reached else 'MISSED'}")
    return reached


def judge_result(result: Mapping[str, object], expected: str) -> bool:
    """Print whether the hash is that of the undisturbed run."""
    found = str(result.get("final_population_sha256"))
    return judge("hash of the undisturbed run", f"{found[:16]}..", found == expected)


def judge_leak(name: str, before: int, after: int, spare: int) -> bool:
    """Print what there was before and after, of which no more may be left than before and some to spare."""
    return judge(name, f"{before} before, {after} after", after <= before + spare)


def run(seconds: float, kills: int, seed: int, workers: int) -> bool:
    """Make a soak; return whether every bar is reached."""
    shared = set(os.listdir("/dev/shm"))
    with tempfile.TemporaryDirectory() as scratch:
        runtime = Path(scratch) / "runtime"
        runtime.mkdir(mode=0o700)
        os.environ["XDG_RUNTIME_DIR"] = str(runtime)
        rate = single_worker_rate(Path(scratch) / "single")
        # As long as six workers could keep it up that nobody disturbs, with some to spare for the peace after.
        generations = round(max(seconds, 1.3 * kills * MEAN_KILL) * 6 * rate / POPULATION)
        soak = Soak(seed, Path(scratch) / "run", workers, generations)
        while len(soak.look()) < workers:
            time.sleep(PERIOD)
        soak.watched.seconds, soak._looked = 0.0, None
        soak.trouble(WARM_UP, 0)
        before = Size.of(soak.root.pid)
        soak.trouble(seconds - WARM_UP, kills)
        after = Size.of(soak.root.pid)
        first, last = soak.watched.evaluations
        throughput = (last - first) / (soak.watched.seconds * rate)
        print(f"{soak.kills} kills, {soak.freezes} freezes, {soak.scalings} scalings, seed {seed}")
        ask(find(), ControlRequest("scale", 6))
        code = soak.root.wait()
        result = json.loads((soak.folder / "result.json").read_text()) if code == 0 else {}
        left = [pid for pid in soak.watched.pids if is_alive(pid)]
        growth = after.memory / before.memory - 1.0
        verdicts = [
            judge("completes", f"exit code {code}", code == 0),
            judge_result(result, undisturbed(generations)),
            judge("individuals condemned", str(result.get("condemned")), not result["condemned"]),
            judge("throughput of capacity", f"{throughput:.2f}", throughput >= REQUIRED_THROUGHPUT),
            judge("growth of the root's memory", f"{growth:.1%}", growth < MOST_GROWTH),
            judge_leak("threads of the root", before.threads, after.threads, SPARE),
            judge_leak("open files of the root", before.descriptors, after.descriptors, SPARE),
            judge_leak("worker processes left", 0, len(left), 0),
            judge_leak("shared memory left", 0, len(set(os.listdir("/dev/shm")) - shared), 0),
        ]
        return all(verdicts)


def main() -> None:
    """Make the soak that was asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.chaos")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=4)
    options = parser.parse_args()
    sys.exit(0 if run(options.seconds, options.kills, options.seed, options.workers) else 1)


if __name__ == "__main__":
    main()
