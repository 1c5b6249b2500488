"""Following the paper's line: what a step costs by each method, and how good the path is.

Run as ``python -m benchmarks.redundant8``, with ``--height 5`` for a plate below the printed plane. An
*evaluation* is forward kinematics and the distances of all five links from the obstacle, for one
candidate step, with nothing left out; steps are counted in them. The naive grid of Lin, Chen & Yu
(2017) evaluates 5^8 candidates so. Beside it stands what one would write first: a loop in Python that
asks Pinocchio for the points and coal for the distances of one candidate after the other. Everything
is processor time of one thread, in interleaved repeats, whose medians are compared. Times are for
information, the bars are ratios and qualities.
"""

import argparse
import statistics
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tramnet_master.experiments.paper_times import NAIVE, PAPER_TIMES
from tramnet_master.tracking_times import METHODS, NAIVE_METHODS, SHARED, follow, quality
from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.lanes import LANES, new_rows
from tramnet_workers.kernels.scenes import Scene
from tramnet_workers.kernels.tracking import evaluate_block_in_full, new_stage, set_stage
from tramnet_workers.problems.tracking_task import TrackingTask
from tramnet_workers.robots.pinocchio_bridge import build_model
from tramnet_workers.tracking_evolution import Eamp, Memetic
from tramnet_workers.tracking_methods import TrackingMethod

Array = NDArray[np.float64]

CANDIDATES = 64 * LANES
LOOPED = 200  # candidates of the loop in Python
ROUNDS = 31
RUN = 20  # points that a method follows in a round
SEEDS = range(1, 9)

MOST_EVALUATIONS = 1.4
LEAST_SHARING = 40.0


class Bar(NamedTuple):
    """What a method's paths must reach over all seeds [cm]."""

    error_mean: float
    error_max: float
    clearance: float


BARS = {
    "EAMP 500/10": Bar(0.003, 0.05, 4.0),
    "EAMP 1000/10": Bar(0.003, 0.05, 4.0),
    "memetic 50/5": Bar(1e-4, 1e-4, 8.0),
}


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--height", type=float, default=0.0, help="height of the obstacle [cm]")
    height = parser.parse_args().height
    task = TrackingTask.of_paper(height)
    evaluation, loop, steps = measure(task)
    print(f"evaluation in lane blocks       {1e9 * evaluation:10.1f} ns")
    print(f"evaluation by Pinocchio and coal{1e9 * loop:10.1f} ns, {loop / evaluation:.0f} times")
    print_steps(task, evaluation, loop, steps)
    print_paths(task, BARS if height == 0.0 else {})


def measure(task: TrackingTask) -> tuple[float, float, dict[str, float]]:
    """Return the time of an evaluation, of one in Python, and of each method's step [s]."""
    scene = task.scene(0.1)
    candidates = np.random.default_rng(8).uniform(-1.0, 1.0, (8, CANDIDATES)) * task.step[0]
    costs, by_loop = np.empty(CANDIDATES), python_loop(task, candidates.T[:LOOPED])
    halfway = follow(task, METHODS["memetic 50/5"], 1, 501, task.start)[-1]
    calls: dict[str, Callable[[], object]] = {
        "evaluation": lambda: evaluate_all(scene, 501, halfway, candidates, costs),
        "loop": lambda: [by_loop(halfway, dq, 501) for dq in candidates.T[:LOOPED]],
    }
    for name, method in METHODS.items():
        calls[name] = follower(task, method, 501, 501 + RUN, halfway)
    for name, method in NAIVE_METHODS.items():
        calls[name] = follower(task, method, 501, 502, halfway)
    times = medians(calls)
    steps = {name: times[name] / RUN for name in METHODS}
    steps |= {name: times[name] for name in NAIVE_METHODS}
    return times["evaluation"] / CANDIDATES, times["loop"] / LOOPED, steps


def follower(
    task: TrackingTask, method: TrackingMethod, first: int, last: int, posture: Array
) -> Callable[[], object]:
    """Return a call that follows some points."""
    return lambda: follow(task, method, first, last, posture)


def medians(calls: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Return the median processor time of each call [s]."""
    for call in calls.values():
        call()  # compiles, and fills the caches
    times: dict[str, list[int]] = {name: [] for name in calls}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            start = time.thread_time_ns()
            call()
            times[name].append(time.thread_time_ns() - start)
    return {name: statistics.median(values) / 1e9 for name, values in times.items()}


@kernel
def evaluate_all(scene: Scene, k: int, q: Array, candidates: Array, costs: Array) -> None:
    """Evaluate candidates of shape (n, whole blocks) in full."""
    stage, dq, block_costs = new_stage(scene), new_rows(len(q), 1), new_rows(1, 1)[0]
    set_stage(scene, k, q, stage)
    for first in range(0, len(costs), LANES):
        for j in range(len(q)):
            for lane in range(LANES):
                dq[j, lane] = candidates[j, first + lane]
        evaluate_block_in_full(scene, stage, dq, 0, block_costs)
        for lane in range(LANES):
            costs[first + lane] = block_costs[lane]


def python_loop(task: TrackingTask, checks: Array) -> Callable[[Array, Array, int], float]:
    """Return the cost of one candidate by Pinocchio and coal, checked against the kernel."""
    model = build_model(task.arm)
    data, tool = model.createData(), task.arm.tool[:3, 3]
    lower, upper = task.boxes[0, :3], task.boxes[0, 3:]
    thickness = 1e-9  # coal takes no flat boxes
    box = coal.Box(*(upper - lower + thickness))
    place = coal.Transform3s()
    place.setTranslation((lower + upper) / 2)
    request = coal.DistanceRequest()

    def cost(q: Array, dq: Array, k: int) -> float:
        pin.forwardKinematics(model, data, q + dq)
        points = [100.0 * data.oMi[j].translation for j in range(1, 9)]
        points.append(100.0 * data.oMi[8].act(tool))
        error = float(np.linalg.norm(points[-1] - task.path[k]))
        clearance = min(
            _distance(points[i], points[j], box, place, request) for i, j in task.chain.links
        )
        return error * error / 2 + 0.1 / max(clearance, 1e-3) ** 2

    _check_agreement(task, cost, checks)
    return cost


def _distance(
    start: Array, end: Array, box: coal.Box, place: coal.Transform3s, request: coal.DistanceRequest
) -> float:
    length = float(np.linalg.norm(end - start))
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), end - start)
    pose = coal.Transform3s(turn.matrix(), (start + end) / 2)
    result = coal.DistanceResult()
    radius = 0.01  # a capsule of none is not measured
    apart = coal.distance(coal.Capsule(radius, length), pose, box, place, request, result)
    return float(apart) + radius


def _check_agreement(
    task: TrackingTask, cost: Callable[[Array, Array, int], float], checks: Array
) -> None:
    scene = task.scene(0.1)
    wide = scene._replace(objective=scene.objective._replace(zone=1e3))
    costs = np.empty(LANES)
    evaluate_all(wide, 1, task.start.copy(), np.ascontiguousarray(checks[:LANES].T), costs)
    expected = [cost(task.start, dq, 1) for dq in checks[:LANES]]
    np.testing.assert_allclose(costs, expected, rtol=1e-4)


def print_steps(
    task: TrackingTask, evaluation: float, loop: float, steps: dict[str, float]
) -> None:
    """Print what a step costs by each method."""
    naive, scene = steps[NAIVE], task.scene(0.1)
    print(f"\n{'step by':<26}{'ms':>9}{'evaluations':>13}{'cost of each':>14}", end="")
    print(f"{'naive / it':>12}{'loop / it':>11}   paper [ms]")
    for name, method in {**METHODS, **NAIVE_METHODS}.items():
        count, seconds = method.evaluations_per_step(scene), steps[name]
        print(f"{name:<26}{1e3 * seconds:9.4f}{count:13d}", end="")
        print(f"{seconds / count / evaluation:14.2f}{naive / seconds:12.1f}", end="")
        print(f"{count * loop / seconds:11.0f}   {_printed(name)}")
    for name in ("EAMP 500/10", "EAMP 1000/10"):
        ratio = steps[name] / METHODS[name].evaluations_per_step(scene) / evaluation
        _judge(f"{name}: {ratio:.2f} evaluations each", ratio <= MOST_EVALUATIONS)
    ratio = naive / steps[SHARED]
    _judge(f"shared-prefix search: {ratio:.0f} times the naive one", ratio >= LEAST_SHARING)


def print_paths(task: TrackingTask, bars: Mapping[str, Bar]) -> None:
    """Print how good the paths are: the worst of all seeds."""
    print(f"\n{'path by':<26}{'error mean / max [cm]':>24}{'clearance, k > 50 [cm]':>25}", end="")
    print(f"{'outside':>9}{'roughness [deg]':>17}")
    for name, method in METHODS.items():
        evolves = isinstance(method, Eamp | Memetic)
        methods = [_seeded(method, seed) for seed in (SEEDS if evolves else [0])]
        ends = 1, task.n_steps + 1
        paths = [quality(task, follow(task, each, *ends, task.start)) for each in methods]
        mean = max(path.error_mean for path in paths)
        most = max(path.error_max for path in paths)
        clearance = min(path.clearance_min_settled for path in paths)
        outside = sum(path.points_outside_zone for path in paths)
        rough = np.degrees(statistics.mean(path.roughness for path in paths))
        print(f"{name:<26}{mean:12.2g}{most:12.2g}{clearance:25.2f}{outside:9d}{rough:17.4f}")
        bar = bars.get(name)
        if bar is not None:
            good = mean <= bar.error_mean and most <= bar.error_max and clearance >= bar.clearance
            _judge(f"{name}: {len(paths)} seeds", good and outside == 0)


def _printed(name: str) -> str:
    """Return the paper's time of a method, in words."""
    time = PAPER_TIMES.get(name)
    if time is None:
        return "-"
    gpu = "" if time.gpu is None else f", GPU {time.gpu.milliseconds:g}"
    return f"CPU {time.cpu.milliseconds:g}{gpu}"


def _seeded(method: TrackingMethod, seed: int) -> TrackingMethod:
    match method:
        case Eamp():
            return Eamp(population=method.population, seed=seed)
        case Memetic():
            return Memetic(seed=seed)
        case _:
            return method


def _judge(what: str, good: bool) -> None:
    print(f"    {what}: {'reached' if good else 'MISSED'}")


if __name__ == "__main__":
    main()
