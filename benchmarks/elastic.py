"""What workers that join cost a run: one every 100 ms for 10 s; and how soon a worker that joins has work.

    python -m benchmarks.elastic [TOPOLOGY]

Four workers share generations of four individuals that take 50 ms each, so that more workers make no generation
shorter and all that is left is what their joining costs. First they are undisturbed; then a hundred more join, each
a wiring of its own in which frames are under way; last all are at rest, for information: the ways have grown. Then,
in a run with work for all, eight join and take their time from the join query to the first chunk. The joiners are
threads of one process, which leaves two cores room for the run; they talk over Zenoh, compute and pass frames on
like all others. The bars: the same run's generations take at most 1.1 times as long on the average while workers
join, and each has work within a second.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np
from benchmarks.farm import Repeat
from numpy.typing import NDArray

from tramnet_master import networks
from tramnet_master.engines.engine import GenerationRow
from tramnet_master.engines.farmed import GenerationalEngine
from tramnet_master.experiments.experiment import Common, Experiment, Load, Timing
from tramnet_master.experiments.run_options import RunOptions
from tramnet_master.experiments.runner import run
from tramnet_master.progress import QuietProgress
from tramnet_master.results import Result
from tramnet_master.run_folder import OpenRunFolder
from tramnet_protocol.channel import Channel
from tramnet_protocol.messages import Outcome, Setup, Work
from tramnet_protocol.transport import ZenohChannel, open_worker
from tramnet_workers.kernels.fingerprint import kernel_fingerprint
from tramnet_workers.node import states
from tramnet_workers.node.evaluator import Evaluator
from tramnet_workers.node.service import Home, Service

WORKERS = 4
COST = 0.05  # of an individual [s]
PERIOD = 0.1  # between two that join [s]
MOST_SLOWED = 1.1
SOON = 1.0  # [s]


class Plan(NamedTuple):
    """A run in which workers join.

    Attributes:
        population: Individuals of a generation.
        quiet: Generations until workers join; the first sixth warms up.
        joiners: Workers that join.
        joining: Generations in which they do.
        generations: Generations in all.
    """

    population: int
    quiet: int
    joiners: int
    joining: int
    generations: int


MANY = Plan(WORKERS, 120, 100, 170, 360)
SOME = Plan(60, 1, 8, 1, 3)


class Alike(Repeat):
    """Some individuals, always the same."""

    def __init__(self, size: int) -> None:
        self.population_size = size

    def initial(self) -> NDArray[np.float64]:
        """Return the one population there is."""
        return super().initial()[: self.population_size]


class Clock(GenerationalEngine):
    """An engine that notes when each generation is done, and lets others join in mid-run.

    Attributes:
        times: When each was done [s].
        waits: How long each that joined waited for work [s].
    """

    def __init__(self, plan: Plan) -> None:
        super().__init__(Alike(plan.population), plan.generations)
        self.times: list[float] = []
        self.waits: list[float] = []
        self._plan = plan
        self._joiners: subprocess.Popen[str] | None = None

    def ask(self) -> list[Work]:
        """Return the current generation, once; at first start those who are to join."""
        if self._joiners is None:
            live = networks.find()
            whom = [live.endpoint, live.network, str(self._plan.joiners)]
            self._joiners = subprocess.Popen(
                [sys.executable, "-m", "benchmarks.elastic", *whom],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            assert self._joiners.stdout is not None
            self._joiners.stdout.readline()
        return super().ask()

    def tell(self, work: Work, outcome: Outcome) -> list[GenerationRow]:
        """Take the objectives of the current generation."""
        rows = super().tell(work, outcome)
        self.times.append(time.perf_counter())
        assert self._joiners is not None
        assert self._joiners.stdin is not None
        if len(self.times) == self._plan.quiet:
            self._joiners.stdin.write("go\n")
            self._joiners.stdin.flush()
        if self.finished:
            said, _ = self._joiners.communicate("end\n")
            self.waits = [float(word) for word in said.split()]
        return rows


def main(topology: str) -> None:
    """Print both bars."""
    engine, live = make_run(MANY, topology)
    spans = [later - at for at, later in pairwise(engine.times)]
    quiet = statistics.mean(spans[MANY.quiet // 6 : MANY.quiet])
    joining, after = spans[MANY.quiet : MANY.quiet + MANY.joining], spans[-MANY.joining // 2 :]
    while_joining = statistics.mean(joining)
    verdict = "reached" if while_joining / quiet <= MOST_SLOWED else "MISSED"
    print(f"{topology}: {live - WORKERS} workers joined, most within {sum(joining):.1f} s")
    print(
        f"  a generation took {1e3 * quiet:.1f} ms, and {1e3 * while_joining:.1f} ms while they joined: "
        f"ratio {while_joining / quiet:.3f} (bar: {MOST_SLOWED}, {verdict}); "
        f"longest {1e3 * max(joining):.0f} ms; {1e3 * statistics.mean(after):.1f} ms with all at rest"
    )
    engine, _ = make_run(SOME, topology)
    verdict = "reached" if max(engine.waits) <= SOON else "MISSED"
    print(
        f"  from the join query to work: {len(engine.waits)} workers, median "
        f"{statistics.median(engine.waits):.3f} s, longest {max(engine.waits):.3f} s (bar: {SOON} s, {verdict})"
    )


def make_run(plan: Plan, topology: str) -> tuple[Clock, int]:
    """Run the sphere function over the farm; return the engine and the workers live at the end."""

    def conclude(_: OpenRunFolder, common: Common, __: Timing, ___: Load) -> Result:
        return Result(**common)

    engine = Clock(plan)
    setup = Setup("sphere", {"dimension": 23, "delay": COST})
    experiment = Experiment(
        "sphere", "repeat", None, 0, plan.population, plan.generations, setup, engine, {}, None, conclude
    )  # fmt: skip
    options = RunOptions(workers=WORKERS, topology=topology, checkpoint_seconds=60.0)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        _, result = run(
            experiment,
            options,
            lambda document: OpenRunFolder.create(Path(folder) / "run", document),
            QuietProgress(),
        )
    return engine, result.workers


class Shared:
    """A channel that many use and none closes."""

    def __init__(self, channel: ZenohChannel) -> None:
        self._channel = channel

    def __getattr__(self, name: str) -> object:
        return getattr(self._channel, name)

    def __enter__(self) -> "Shared":
        return self

    def __exit__(self, *_: object) -> None:
        pass


class Joiner(Service):
    """A worker that notes how long it waits for its first work.

    Attributes:
        waited: From the join query to the first work [s], or None.
    """

    waited: float | None = None
    _asked = 0.0

    def _join(self, channel: Channel) -> bool:
        kernel_fingerprint()  # what it costs is no part of a join
        self._asked = time.perf_counter()
        return super()._join(channel)

    def _evaluate(
        self, evaluator: Evaluator, membership: states.Membership, work: Work
    ) -> states.Finished:
        if self.waited is None:
            self.waited = time.perf_counter() - self._asked
        return super()._evaluate(evaluator, membership, work)


def join(endpoint: str, network: str, count: int) -> None:
    """Be those who join, and print how long each waited for work."""
    channel = cast(Channel, Shared(open_worker(endpoint)))
    home = Home(network, "joiners", 5.0, lambda: channel)
    joiners = [Joiner(home) for _ in range(count)]
    print("ready", flush=True)
    sys.stdin.readline()
    due = time.monotonic()
    for joiner in joiners:
        time.sleep(max(0.0, due - time.monotonic()))
        threading.Thread(target=joiner.run, daemon=True).start()
        due += PERIOD
    sys.stdin.readline()
    print(*(joiner.waited for joiner in joiners if joiner.waited is not None), flush=True)
    os._exit(0)


if __name__ == "__main__":
    if len(sys.argv) > 2:
        join(sys.argv[1], sys.argv[2], int(sys.argv[3]))
    else:
        main(*(sys.argv[1:] or ["tree"]))
