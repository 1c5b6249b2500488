"""Machines to predict runs for: what their links cost, and how their processors compare with this one.

The T805-25 evaluates by one yardstick: the inverse dynamics of a six-joint arm by the recursive Newton-Euler
method, 852 multiplications and 738 additions (150 n - 48 and 131 n - 48 for n joints: Hollerbach 1980 on Luh,
Walker & Paul 1980; Armstrong, Khatib & Burdick 1986 call their 305 operations a fifth of it). INMOS technical note
26 has a T800-20 sustain 1.5 MFLOPS; at 25 MHz that is 1.875 MFLOPS, and 848 us. What a problem costs there is what
it costs on this core, times the ratio of the two inverse dynamics: an assumption, which a cost given in numbers
replaces. The ratio is one of floating-point work in lanes, which breeding is not: there the T805 is said to take
100 instructions a gene at 12.5 MIPS, half of its peak, our choice.
"""

import time
from functools import cache

import numpy as np
from msgspec import Struct, structs

from tramnet_master.errors import InvalidOption
from tramnet_master.simulation.measuring import points_of_a_run
from tramnet_master.simulation.workload import Grain, Workload
from tramnet_protocol.links import LinkTiming

_OPERATIONS = 852 + 738
_T805_OPERATIONS_PER_SECOND = 1.5e6 * 25 / 20

T805_INVERSE_DYNAMICS = _OPERATIONS / _T805_OPERATIONS_PER_SECOND
"""Inverse dynamics of six joints on a T805-25 [s]."""

T805_BREEDING = 100 / 12.5e6
"""Breeding a gene on a T805-25 [s]."""

_STATES = 1024
_REPEATS = 15


class Machine(Struct, frozen=True):
    """Processors and links.

    Attributes:
        name: What it is called.
        timing: What a message costs on a link.
        sending: Time the root's processor takes for a chunk it sends, beside the link's set-up [ns].
        receiving: Time it takes for an answer, beside the wake-up [ns].
    """

    name: str
    timing: LinkTiming
    sending: int = 0
    receiving: int = 0


T805 = "t805-25"
TODAY = "today"
NODES = (T805, TODAY)

_TODAY_TIMING = LinkTiming(
    byte_alone=1, byte_opposed=1, set_up=10_000, wake_up=60_000, routing=100_000
)
_TODAY = Machine(TODAY, _TODAY_TIMING, sending=50_000, receiving=40_000)


def machine(node: str, mbaud: int) -> Machine:
    """Return a machine.

    Args:
        node: One of ``NODES``.
        mbaud: Speed of the links of a T805 [Mbaud].

    Raises:
        InvalidOption: There is no such node.
        BadLink: Its links have no such speed.
    """
    match node:
        case "t805-25":
            return Machine(node, LinkTiming.of(mbaud))
        case "today":
            return _TODAY
    raise InvalidOption("--node", repr(node), f"one of {', '.join(NODES)}")


def factor(node: str) -> float:
    """Return how many times as long a node takes for floating-point work as this core."""
    return T805_INVERSE_DYNAMICS / inverse_dynamics_here() if node == T805 else 1.0


def carried_over(workload: Workload, node: str) -> Workload:
    """Return a workload that was measured on this core as it would be on a node."""
    if node != T805:
        return workload
    each = workload.evaluation * factor(node)
    if (
        workload.grain is not Grain.INDIVIDUALS
    ):  # the root compares and passes on, and breeds nothing
        run = points_of_a_run(each, workload.generations) if workload.run > 1 else 1
        return structs.replace(workload, evaluation=each, breeding=0.0, run=run)
    breeding = workload.population * workload.genes * T805_BREEDING
    return structs.replace(workload, evaluation=each, breeding=breeding)


@cache
def inverse_dynamics_here() -> float:
    """Return the time of the yardstick on this core [s], the best of some trials."""
    # Slow to import, and books are kept of runs that measure nothing.
    from tramnet_workers.kernels.dynamics import inverse_dynamics_batch  # noqa: PLC0415
    from tramnet_workers.robots.puma560 import akb  # noqa: PLC0415

    arm = akb()
    table, gravity = (
        np.array(arm.table),
        np.array(arm.gravity),
    )  # as the fingerprint has them compiled
    rng = np.random.default_rng(560)
    states = [rng.uniform(-reach, reach, (_STATES, arm.n_joints)) for reach in (np.pi, 5.0, 30.0)]
    best = float("inf")
    for _ in range(_REPEATS):
        began = time.perf_counter()
        inverse_dynamics_batch(table, gravity, *states)
        best = min(best, time.perf_counter() - began)
    return best / _STATES
