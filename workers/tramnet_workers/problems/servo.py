"""Replay of a plan through a servo: the experiment of Wang & Zalzala (1995), section 6.

The plan is sampled at set-points, every 28 ms as the arm's own controller does or up to every
0.875 ms as the transputers could, and the servo, which ticks every 0.875 ms, goes from one to the
next in equal increments. Each joint has a critically damped PD controller,

    tau = w² J (q_ref - q) + 2 w J (qd_ref - qd) + g(q),

where J is the joint's diagonal element of the mass matrix half-way to the goal, and qd_ref jumps at
each set-point: these jumps are the jerks that the paper saw. With feed-forward the torques of the
plan, by inverse dynamics, take the place of g(q). The arm is Pinocchio's forward dynamics.

The paper gives no gains; w = 80 rad/s is our choice, and ratios of jerks do not depend on it. Motors
that saturate hide the jerks that set-points ask for: compare jerks without saturation, and errors
with it.
"""

from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from tramnet_workers.kernels.dynamics import inverse_dynamics_batch
from tramnet_workers.problems.motion_task import MotionTask
from tramnet_workers.problems.plan import Plan
from tramnet_workers.robots.pinocchio_bridge import forward_simulate, mass_matrix

Array = NDArray[np.float64]

TICK = 0.000875  # [s]
PERIODS = (0.028, 0.007, 0.00175, 0.000875)  # of set-points, as the paper has them [s]
MARGINS = (1.0, 0.9, 0.8)  # shares of the torque limits that plans may use
_SUBSTEPS = 4
_INSTANTS = 4001

Positive = Annotated[float, Meta(gt=0.0)]


class ServoSettings(Struct, frozen=True, forbid_unknown_fields=True):
    """How a plan is replayed.

    Attributes:
        period: Time between two set-points [s].
        bandwidth: Natural frequency w of each joint's controller [rad/s].
        feed_forward: Whether the plan's own torques are added, in place of gravity's.
        saturates: Whether the motors give no more than their torque limits.
    """

    period: Positive = PERIODS[0]
    bandwidth: Positive = 80.0
    feed_forward: bool = False
    saturates: bool = True


@dataclass(frozen=True, eq=False)
class Replay:
    """What an arm did in a replay, at each tick and at the end; read-only.

    Attributes:
        t: Instants, of shape (k,) [s].
        q: Joint angles, of shape (k, n_joints) [rad].
        qd: Joint velocities, of shape (k, n_joints) [rad/s].
        qdd: Mean joint accelerations in the time up to each instant, of shape (k, n_joints) [rad/s²].
        tau: Torques applied in the time up to each instant, of shape (k, n_joints) [N m].
        reference: Joint angles that the servo aimed at, of shape (k, n_joints) [rad].
        rms_jerk: Root mean square of each joint's jerk, of shape (n_joints,) [rad/s³].
        peak_command: Largest ratio of each joint's commanded torque to its limit, of shape (n_joints,).
        tracking_error: Distance of each joint from the goal at the end, of shape (n_joints,) [rad].
    """

    t: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array
    reference: Array
    rms_jerk: Array
    peak_command: Array
    tracking_error: Array

    def __post_init__(self) -> None:
        for field in fields(self):
            getattr(self, field.name).setflags(write=False)


def replay(task: MotionTask, plan: Plan, settings: ServoSettings) -> Replay:
    """Return what the arm does when a plan is replayed through a servo.

    Args:
        task: The task, with the arm and its torque limits.
        plan: The plan.
        settings: How to replay it.
    """
    t = _ticks(plan.duration)
    reference, reference_velocity = _increments(plan, t, settings.period)
    planned = plan.sample(t)
    ahead = inverse_dynamics_batch(task.arm.table, task.arm.gravity, *planned)
    inertia = np.diag(mass_matrix(task.arm, 0.5 * (task.start + task.goal)))
    stiffness, damping = settings.bandwidth**2 * inertia, 2.0 * settings.bandwidth * inertia
    q, qd = np.empty_like(reference), np.empty_like(reference)
    command = np.zeros_like(reference)
    q[0], qd[0] = planned.q[0], planned.qd[0]
    for k in range(len(t) - 1):
        pull = stiffness * (reference[k] - q[k]) + damping * (reference_velocity[k] - qd[k])
        command[k + 1] = pull + (ahead[k] if settings.feed_forward else _gravity(task, q[k]))
        tau = _applied(task, command[k + 1], settings)
        q[k + 1], qd[k + 1] = _drive(task, tau, q[k], qd[k], t[k + 1] - t[k])
    qdd = np.vstack([np.zeros(task.n_joints), np.diff(qd, axis=0) / np.diff(t)[:, None]])
    return Replay(
        t=t,
        q=q,
        qd=qd,
        qdd=qdd,
        tau=_applied(task, command, settings),
        reference=reference,
        rms_jerk=_rms_jerk(qdd),
        peak_command=np.abs(command).max(axis=0) / task.torque_limits,
        tracking_error=np.abs(q[-1] - task.goal),
    )


def slow_down(task: MotionTask, plan: Plan, margin: float) -> Plan | None:
    """Return a plan's motion with time stretched until it needs but a share of the torque limits.

    Hollerbach (1984), section 3: the torques but for gravity's fall with the square of the stretch.
    A plan that needs no more already is returned as it is.

    Args:
        task: The task, with the torque limits.
        plan: The plan.
        margin: The share, in (0, 1].

    Returns:
        The slower plan, or None where gravity alone needs more than the share.
    """
    q, qd, qdd = plan.sample(np.linspace(0.0, plan.duration, _INSTANTS))
    arm, still = task.arm, np.zeros_like(q)
    gravity = inverse_dynamics_batch(arm.table, arm.gravity, q, still, still)
    motion = inverse_dynamics_batch(arm.table, arm.gravity, q, qd, qdd) - gravity
    limits = margin * task.torque_limits
    if not (np.abs(gravity) < limits).all():
        return None
    room = limits - np.sign(motion) * gravity
    slower = float(np.sqrt((np.abs(motion) / room).max()))
    return plan.stretched(slower) if slower > 1.0 else plan


def _ticks(duration: float) -> Array:
    """Return the instants of the servo's ticks before the end of a motion, and that end [s]."""
    ticks = np.arange(int(np.ceil(duration / TICK - 1e-9))) * TICK
    return np.append(ticks, duration)


def _increments(plan: Plan, t: Array, period: float) -> tuple[Array, Array]:
    """Return what the servo aims at, and how fast that moves, each of shape (k, n_joints)."""
    last = np.floor(t / period + 1e-9).astype(np.intp)
    points = plan.sample(np.arange(last[-1] + 2) * period).q
    velocity = (points[last + 1] - points[last]) / period
    return points[last] + velocity * (t - last * period)[:, None], velocity


def _gravity(task: MotionTask, q: Array) -> Array:
    still = np.zeros((1, task.n_joints))
    return inverse_dynamics_batch(task.arm.table, task.arm.gravity, q[None], still, still).ravel()


def _applied(task: MotionTask, command: Array, settings: ServoSettings) -> Array:
    """Return the torques that the motors give for those that are asked for [N m]."""
    if not settings.saturates:
        return command
    return np.clip(command, -task.torque_limits, task.torque_limits)


def _drive(
    task: MotionTask, tau: Array, q: Array, qd: Array, duration: float
) -> tuple[Array, Array]:
    """Return where a constant torque takes the arm, and how fast it is there."""
    instants = np.linspace(0.0, duration, _SUBSTEPS + 1)
    motion = forward_simulate(task.arm, lambda _: tau, q, qd, instants)
    return motion.q[-1], motion.qd[-1]


def _rms_jerk(qdd: Array) -> Array:
    """Return the root mean square of the jerk between full ticks, of shape (n_joints,) [rad/s³].

    The first row is no acceleration of the motion, and the last may belong to a shorter tick.
    """
    jerk = np.diff(qdd[1:-1], axis=0) / TICK
    return np.asarray(np.sqrt((jerk**2).mean(axis=0)), dtype=np.float64)
