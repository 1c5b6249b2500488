"""Inverse dynamics per second: our kernel against Pinocchio, on one core.

Run as ``python -m benchmarks.kernels``. Both get the same random states of the PUMA 560 and compute
sines and cosines themselves. Pinocchio's fastest call for many states is ``rneaInParallel`` with
one thread: the loop over states runs in C++. Counted is the time that the thread had a core, in
interleaved repeats, so that other work on the machine falls on nobody; the medians are compared.
Times are for information, the bar is the ratio.
"""

import statistics
import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.dynamics import (
    LANES,
    dynamics_workspace,
    inverse_dynamics,
    inverse_dynamics_batch,
)
from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.pinocchio_bridge import build_model
from tramnet_workers.robots.puma560 import akb

Array = NDArray[np.float64]

STATES = 256 * LANES
REPEATS = 101
REQUIRED_RATIO = 5.0

OURS = "lane blocks, as the problems call them"
BATCH = "arrays of states, laid out in blocks"
POOL = "Pinocchio, rneaInParallel with one thread"
LOOP = "Pinocchio, one Python call per state"


def main() -> None:
    """Print nanoseconds per evaluation and how often ours fits into Pinocchio's."""
    medians = measure(contestants(akb()), REPEATS)
    best_pinocchio = min(medians[POOL], medians[LOOP])
    for name, nanoseconds in medians.items():
        ratio = best_pinocchio / nanoseconds
        print(f"{name:<44} {nanoseconds:8.1f} ns per evaluation, ratio {ratio:5.2f}")
    ratio = best_pinocchio / medians[BATCH]
    verdict = "reached" if ratio >= REQUIRED_RATIO else "MISSED"
    print(f"batch call against batch call: {ratio:.1f} times (bar: {REQUIRED_RATIO}, {verdict})")


def contestants(arm: SerialArm) -> dict[str, Callable[[], object]]:
    """Return the calls to compare, each for all states once."""
    rng = np.random.default_rng(560)
    shape = (STATES, arm.n_joints)
    states = [rng.uniform(-reach, reach, shape) for reach in (np.pi, 5.0, 30.0)]
    q, qd, qdd = (_blocks(values) for values in states)
    columns = [np.asfortranarray(values.T) for values in states]
    model = build_model(arm)
    data, pool = model.createData(), pin.ModelPool(model, 1)
    torques, torque_columns = np.empty_like(q), np.empty(shape[::-1], order="F")
    work = dynamics_workspace(arm.n_joints)

    def one_by_one() -> None:
        for state in zip(*states, strict=True):
            pin.rnea(model, data, *state)

    return {
        OURS: lambda: _all_blocks(arm.table, arm.gravity, q, qd, qdd, torques, work),
        BATCH: lambda: inverse_dynamics_batch(arm.table, arm.gravity, *states),
        POOL: lambda: pin.rneaInParallel(1, pool, *columns, torque_columns),
        LOOP: one_by_one,
    }


def measure(calls: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the median processor time of each call [ns per evaluation]."""
    for call in calls.values():
        call()  # compiles, and fills the caches
    times: dict[str, list[int]] = {name: [] for name in calls}
    for _ in range(repeats):
        for name, call in calls.items():
            start = time.thread_time_ns()
            call()
            times[name].append(time.thread_time_ns() - start)
    return {name: statistics.median(values) / STATES for name, values in times.items()}


def _blocks(states: Array) -> Array:
    """Lay states of shape (k, n) out as blocks of shape (k / LANES, n, LANES)."""
    n = states.shape[1]
    return np.ascontiguousarray(states.reshape(-1, LANES, n).transpose(0, 2, 1))


@kernel
def _all_blocks(
    table: Array, gravity: Array, q: Array, qd: Array, qdd: Array, tau: Array, work: Array
) -> None:
    for b in range(q.shape[0]):
        inverse_dynamics(table, gravity, q[b], qd[b], qdd[b], tau[b], work)


if __name__ == "__main__":
    main()
