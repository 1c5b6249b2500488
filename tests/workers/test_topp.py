"""Time-optimal driving along a path: closed forms, published times, laws, and the package toppra."""

import re

import numpy as np
import pytest
import toppra
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import linprog
from toppra import algorithm, constraint

from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.kernels.smooth_paths import path_torques
from tramnet_workers.kernels.topp import time_optimal
from tramnet_workers.problems.motion_task import MotionTask, ObjectiveWeights
from tramnet_workers.problems.path_timing import grid, time_path
from tramnet_workers.problems.plan import SmoothPath
from tramnet_workers.problems.straight_line import straight_line, straight_path
from tramnet_workers.problems.yardsticks import PAPER_GOAL, PAPER_START
from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.puma560 import CORKE_VELOCITY_LIMITS, akb, p560

Array = NDArray[np.float64]

LIBM = re.compile(r"\b(sin|cos|atan2?|log|exp|pow|fma|hypot|fmod)f?\b")

FREE_END = ObjectiveWeights(end_velocity=0.0)

seeds = st.integers(0, 2**32 - 1)


def paper_task(arm: SerialArm, **changes: object) -> MotionTask:
    return MotionTask.for_arm(arm, PAPER_START, PAPER_GOAL, **changes)  # type: ignore[arg-type]


def random_motion(seed: int) -> tuple[MotionTask, SmoothPath]:
    rng = np.random.default_rng(seed)
    task = paper_task((akb(), p560())[seed % 2])
    return task, SmoothPath(task.start, task.goal, rng.normal(0.0, 0.2, (6, 4)))


def coefficients(task: MotionTask, path: SmoothPath, points: Array) -> tuple[Array, Array, Array]:
    return path_torques(task.arm.table, task.arm.gravity, *path.points(points))


def unlimited(points: Array) -> Array:
    return np.full(len(points), np.inf)


def one_joint(inertia: float, gravity: float, points: Array) -> tuple[Array, Array, Array]:
    ones = np.ones((len(points), 1))
    return inertia * ones, 0.0 * ones, gravity * ones


def test_one_joint_accelerates_half_way_and_brakes() -> None:
    # Wang & Zalzala (1995), section 3: tau = 12.5 qdd, |tau| <= 200, s = pi/2; 0.627 s there.
    points = grid(50)
    a, b, c = one_joint(12.5 * np.pi / 2, 0.0, points)

    duration, x, u = time_optimal(
        np.diff(points[::2]), a, b, c, np.array([200.0]), unlimited(points), True
    )

    assert duration == pytest.approx(0.62666, abs=1e-5)
    assert x.max() == pytest.approx(16.0 / (np.pi / 2))
    assert np.abs(u) == pytest.approx(np.full(50, 16.0 / (np.pi / 2)))


def test_one_joint_with_a_speed_limit_cruises_in_the_middle() -> None:
    points = grid(200)
    a, b, c = one_joint(1.0, 0.0, points)
    ceiling = np.full(len(points), 0.25)

    duration, x, _ = time_optimal(np.diff(points[::2]), a, b, c, np.array([1.0]), ceiling, True)

    # v / a to reach v, the same to stop, and the rest of the way at v = 1/2.
    assert duration == pytest.approx(0.5 + 0.5 + (1.0 - 0.25) / 0.5, abs=1e-3)
    assert x.max() == 0.25


def test_gravity_helps_to_accelerate_and_hinders_braking() -> None:
    points = grid(400)
    a, b, c = one_joint(1.0, -1.0, points)

    duration, x, _ = time_optimal(
        np.diff(points[::2]), a, b, c, np.array([2.0]), unlimited(points), True
    )

    # Accelerated by 3 and braked by 1: v^2 = 2 (3 s1) = 2 (1 - s1).
    assert x.max() == pytest.approx(1.5, rel=1e-2)
    assert duration == pytest.approx(np.sqrt(1.5) * (1.0 / 3.0 + 1.0), rel=1e-3)


def test_a_joint_too_weak_for_gravity_cannot_start() -> None:
    points = grid(20)
    a, b, c = one_joint(1.0, 3.0, points)

    duration, _, _ = time_optimal(
        np.diff(points[::2]), a, b, c, np.array([2.0]), unlimited(points), True
    )

    assert duration == np.inf


def test_a_joint_too_weak_on_the_way_swings_through() -> None:
    # Gravity exceeds the bound in the middle of the path, against the motion and then with it.
    points = grid(400)
    a, b, _ = one_joint(1.0, 0.0, points)
    c = 2.5 * np.sin(2 * np.pi * points)[:, None] * (np.abs(points - 0.5) < 0.4)[:, None]

    duration, x, _ = time_optimal(
        np.diff(points[::2]), a, b, c, np.array([2.0]), unlimited(points), True
    )

    assert 0.0 < duration < np.inf
    assert x[1:-1].min() > 0.0


@pytest.mark.parametrize(
    ("arm", "changes", "seconds"),
    [
        # Optimal times of the straight line: measured with toppra 0.6.10.
        (akb(), {}, 0.3806),
        (p560(), {}, 0.3536),
        (akb(), {"weights": FREE_END}, 0.2713),
        (p560(), {"weights": FREE_END}, 0.2501),
        (akb(), {"velocity_limits": CORKE_VELOCITY_LIMITS}, 0.6081),
        (p560(), {"velocity_limits": CORKE_VELOCITY_LIMITS}, 0.5985),
    ],
)
def test_the_straight_line_takes_the_known_time(
    arm: SerialArm, changes: dict[str, object], seconds: float
) -> None:
    plan = straight_line(paper_task(arm, **changes))

    assert plan is not None
    assert plan.duration == pytest.approx(seconds, abs=1e-4)


@pytest.mark.parametrize("amplitude", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("arm", [akb(), p560()], ids=["akb", "p560"])
def test_the_package_toppra_finds_the_same_motion(arm: SerialArm, amplitude: float) -> None:
    task = paper_task(arm)
    rng = np.random.default_rng(560)
    path = SmoothPath(task.start, task.goal, amplitude * rng.normal(size=(6, 4)))
    points = grid(100)
    s = points[::2]

    duration, x, _ = time_optimal(
        np.diff(s),
        *coefficients(task, path, points),
        task.torque_limits,
        unlimited(points),
        True,
    )

    speed = toppra_speeds(task, path, s)
    assert duration == pytest.approx((2 * np.diff(s) / (speed[1:] + speed[:-1])).sum(), rel=2e-3)
    # Its bounds do not hold in the middles of the intervals, so that it may be a little faster.
    assert np.abs(np.sqrt(x) - speed).max() < 0.02 * speed.max()


@given(seeds)
def test_torques_keep_their_bounds_at_both_ends_and_in_the_middle(seed: int) -> None:
    task, path = random_motion(seed)
    points = grid(40)
    a, b, c = coefficients(task, path, points)
    steps = np.diff(points[::2])

    duration, x, u = time_optimal(steps, a, b, c, task.torque_limits, unlimited(points), True)

    assert np.isfinite(duration)
    assert (x >= 0.0).all()
    assert x[0] == x[-1] == 0.0
    for k in range(3):
        part = slice(k, len(points) - 2 + k, 2)
        speed = x[:-1] + k * steps * u
        torque = a[part] * u[:, None] + b[part] * speed[:, None] + c[part]
        assert (np.abs(torque) <= task.torque_limits * (1.0 + 1e-10)).all()


@given(seeds)
def test_backwards_takes_as_long_as_forwards(seed: int) -> None:
    # Bounds are symmetric, and gravity and inertia do not know which way time runs.
    task, path = random_motion(seed)
    points = grid(40)
    a, b, c = coefficients(task, path, points)
    steps = np.diff(points[::2])
    limits, ceiling = task.torque_limits, unlimited(points)

    forwards, _, _ = time_optimal(steps, a, b, c, limits, ceiling, True)
    backwards, _, _ = time_optimal(
        steps[::-1].copy(), -a[::-1], b[::-1].copy(), c[::-1].copy(), limits, ceiling, True
    )

    # Not exactly: where a torque does not depend on u, the two passes cut corners differently.
    assert backwards == pytest.approx(forwards, rel=2e-2)


@given(seeds, st.floats(1.0, 10.0))
def test_stronger_motors_are_never_slower(seed: int, factor: float) -> None:
    task, path = random_motion(seed)
    points = grid(40)
    motion = np.diff(points[::2]), *coefficients(task, path, points)

    weak, _, _ = time_optimal(*motion, task.torque_limits, unlimited(points), True)
    strong, _, _ = time_optimal(*motion, factor * task.torque_limits, unlimited(points), True)

    assert strong <= weak * (1.0 + 1e-9)
    assert strong >= weak / factor  # without gravity, weak / sqrt(factor)


@pytest.mark.parametrize("arm", [akb(), p560()], ids=["akb", "p560"])
def test_no_other_speed_profile_is_faster_anywhere(arm: SerialArm) -> None:
    task = paper_task(arm)
    points = grid(30)
    a, b, c = coefficients(task, straight_path(task), points)
    steps = np.diff(points[::2])

    _, x, _ = time_optimal(steps, a, b, c, task.torque_limits, unlimited(points), True)

    assert x == pytest.approx(fastest_by_linear_program(steps, a, b, c, task.torque_limits))


@given(seeds)
def test_a_plan_keeps_velocity_limits_between_the_points_of_its_grid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    task = paper_task(akb(), velocity_limits=rng.uniform(0.5, 3.0, 6))
    path = SmoothPath(task.start, task.goal, rng.normal(0.0, 0.2, (6, 4)))

    plan = time_path(task, path, intervals=200)

    assert plan is not None
    motion = plan.sample(np.linspace(0.0, plan.duration, 3001))
    assert (np.abs(motion.qd) <= task.velocity_limits * (1.0 + 1e-4)).all()


def test_driving_calls_no_mathematics_of_the_system() -> None:
    compiled = njit(error_model="numpy")(time_optimal.py_func)  # type: ignore[attr-defined]
    points = grid(4)
    motion = one_joint(1.0, 0.0, points)
    compiled(np.diff(points[::2]), *motion, np.ones(1), unlimited(points), True)

    (code,) = compiled.inspect_asm().values()

    assert not LIBM.search(code)


def fastest_by_linear_program(steps: Array, a: Array, b: Array, c: Array, limits: Array) -> Array:
    """Squared speeds x of largest sum: u is linear in them, and so is every bound."""
    m = len(steps)
    rows, bounds = [], []
    for i in range(m):
        to_u = np.zeros(m + 1)
        to_u[i], to_u[i + 1] = -0.5 / steps[i], 0.5 / steps[i]
        here = np.eye(m + 1)[i]
        for k in range(3):
            p = 2 * i + k
            for j in range(len(limits)):
                row = a[p, j] * to_u + b[p, j] * (here + k * steps[i] * to_u)
                rows += [row, -row]
                bounds += [limits[j] - c[p, j], limits[j] + c[p, j]]
    ranges = [(0.0, 0.0), *[(0.0, None)] * (m - 1), (0.0, 0.0)]
    found = linprog(-np.ones(m + 1), A_ub=np.array(rows), b_ub=np.array(bounds), bounds=ranges)
    assert found.success
    return np.asarray(found.x)


class ToppraPath(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc]
    def __init__(self, path: SmoothPath) -> None:
        self._path = path

    def __call__(self, at: Array, order: int = 0) -> Array:
        points = self._path.points(np.atleast_1d(np.asarray(at, dtype=np.float64)))[order]
        return points[0] if np.ndim(at) == 0 else points

    @property
    def dof(self) -> int:
        return len(self._path.start)

    @property
    def path_interval(self) -> Array:
        return np.array([0.0, 1.0])

    @property
    def waypoints(self) -> None:
        return None


def toppra_speeds(task: MotionTask, path: SmoothPath, s: Array) -> Array:
    def inverse_dynamics(q: Array, qd: Array, qdd: Array) -> Array:
        arm = task.arm
        return inverse_dynamics_batch(arm.table, arm.gravity, q[None], qd[None], qdd[None])[0]

    bounds = constraint.JointTorqueConstraint(
        inverse_dynamics,
        np.stack([-task.torque_limits, task.torque_limits], axis=1),
        np.zeros(task.n_joints),
        discretization_scheme=constraint.DiscretizationType.Interpolation,
    )
    toppra.setup_logging("ERROR")
    solver = algorithm.TOPPRA([bounds], ToppraPath(path), gridpoints=s)
    return np.asarray(solver.compute_parameterization(0.0, 0.0)[1])
