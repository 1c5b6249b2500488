"""What a computing worker costs a frame that it passes on.

    python -m benchmarks.routing

A pipeline of two workers: the first computes all the time, and frames for the second pass through it. This process
is the root and the second worker at once, so that one clock sees a frame off and sees it come. Printed for a first
worker that is idle, one that computes in our kernels, which let go of the interpreter, one that evaluates in plain
Python, which holds it, and one that does so without the shorter switch interval that workers set. The bar: 98 of
100 frames take at most 5 ms more than through an idle one, in the median of blocks of a hundred, for whatever else
the machine does falls on a few of these.
"""

import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable

import numpy as np

from tramnet_protocol.channel import Lane
from tramnet_protocol.exchange import Exchange, Identity
from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import Stop
from tramnet_protocol.topology import rewire, shape_named
from tramnet_protocol.transport import open_root, open_worker
from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.node.__main__ import SWITCH_INTERVAL
from tramnet_workers.node.links import Links
from tramnet_workers.robots.puma560 import akb

KEYS = Keys("routing")
WIRING = rewire(shape_named("pipeline"), {0: 1, 1: 1, 2: 1}, 1)
RUN = 7
BLOCK = 100
BLOCKS = 9
PAUSE = 0.003  # between two frames [s]
BODY = "x" * 2000
STATES = 50_000  # of one call of the kernel, which takes some 5 ms
BAR = 0.005  # [s]
MODES = ("idle", "kernels", "Python", "Python, Python's own interval")


def main() -> None:
    """Print delays."""
    with open_root(KEYS.network, ["tcp/127.0.0.1:0"]) as root, open_worker(root.endpoint) as last:
        bench = _Bench()
        last.subscribe(KEYS.links_to(2), bench.arrive)
        exchange = Exchange(KEYS, Identity(RUN, 0, 1), WIRING)
        print(f"{'the TRAM on the way':<30} {'median':>8} {'98 %':>8}   [ms]")
        idle = 0.0
        for mode in MODES:
            command = [sys.executable, "-m", "benchmarks.routing", root.endpoint, mode]
            with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as worker:
                assert worker.stdout is not None
                worker.stdout.readline()

                def send() -> None:
                    root.publish(*exchange.outgoing((2, 1), Stop(BODY)), Lane.LINK)

                blocks = [sorted(bench.delay(send) for _ in range(BLOCK)) for _ in range(BLOCKS)]
                worker.kill()
            typical, late = (statistics.median(block[i] for block in blocks) for i in (50, 97))
            idle = idle or late
            verdict = "reached" if late - idle <= BAR else "MISSED"
            print(f"{mode:<30} {1e3 * typical:8.2f} {1e3 * late:8.2f}   {verdict}")


class _Bench:
    """Sees a frame off and waits for it."""

    def __init__(self) -> None:
        self._came = threading.Event()
        self._at = 0.0

    def arrive(self, key: str, payload: bytes) -> None:
        self._at = time.perf_counter()
        self._came.set()

    def delay(self, send: Callable[[], None]) -> float:
        """Return the time a frame takes [s]."""
        self._came.clear()
        began = time.perf_counter()
        send()
        assert self._came.wait(10.0), "a frame was lost"
        time.sleep(PAUSE)
        return self._at - began


def compute(endpoint: str, mode: str) -> None:
    """Be the first worker."""
    if not mode.endswith("own interval"):
        sys.setswitchinterval(SWITCH_INTERVAL)
    with open_worker(endpoint) as channel:
        Links(channel, KEYS, Identity(RUN, 1, 1), WIRING, lambda header, work: None)
        kernel = _kernel()
        kernel()
        print("ready", flush=True)
        while mode == "idle":
            time.sleep(1.0)
        while mode == "kernels":
            kernel()
        total = 0.0
        while True:
            total += total * 0.5 + 1.0


def _kernel() -> Callable[[], object]:
    arm = akb()
    states = np.random.default_rng(1).uniform(-1.0, 1.0, (3, STATES, arm.n_joints))
    return lambda: inverse_dynamics_batch(arm.table, arm.gravity, *states)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        compute(*sys.argv[1:3])
    else:
        main()
