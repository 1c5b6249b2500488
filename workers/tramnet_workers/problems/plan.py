"""Plans: motions with their timing, that can be sampled at any instant.

Between its breaks the acceleration of a plan is smooth. At a break it may jump, and a sample just
there belongs to what follows; a sample before 0 or after the end is the first or the last one.
"""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels.smooth_paths import path_modes, path_points

Array = NDArray[np.float64]


class Samples(NamedTuple):
    """States of n joints at k instants.

    Attributes:
        q: Joint angles, of shape (k, n) [rad].
        qd: Joint velocities, of shape (k, n) [rad/s].
        qdd: Joint accelerations, of shape (k, n) [rad/s²].
    """

    q: Array
    qd: Array
    qdd: Array


class Plan(Protocol):
    """A motion from rest."""

    @property
    def duration(self) -> float:
        """Motion time [s]."""

    @property
    def breaks(self) -> Array:
        """Instants where the acceleration may jump, from 0 to the duration, of shape (m + 1,) [s]."""

    def sample(self, t: Array) -> Samples:
        """Return the states at instants of shape (k,) [s]."""

    def stretched(self, factor: float) -> Self:
        """Return the same motion, driven more slowly by a factor.

        Hollerbach (1984), "Dynamic scaling of manipulator trajectories": torques but for gravity
        fall with the square of the factor.
        """


@dataclass(frozen=True, eq=False)
class ParabolicPlan:
    """A plan of m segments of constant acceleration: Wang & Zalzala (1995), eqs 3-4.

    Attributes:
        h: Durations of the segments, of shape (m,) [s].
        q: Joint angles at the nodes, of shape (m + 1, n_joints) [rad].
        qd: Joint velocities at the nodes, of shape (m + 1, n_joints) [rad/s].
        qdd: Joint accelerations in the segments, of shape (m, n_joints) [rad/s²].
    """

    h: Array
    q: Array
    qd: Array
    qdd: Array

    def __post_init__(self) -> None:
        _freeze(self)

    @cached_property
    def breaks(self) -> Array:
        """Instants of the nodes, of shape (m + 1,) [s]."""
        return _instants(self.h)

    @property
    def duration(self) -> float:
        """Motion time [s]."""
        return float(self.breaks[-1])

    def sample(self, t: Array) -> Samples:
        """Return the states at instants of shape (k,) [s]."""
        i, past = _locate(self.breaks, t)
        past = past[:, None]
        qd = self.qd[i] + self.qdd[i] * past
        q = self.q[i] + (self.qd[i] + 0.5 * self.qdd[i] * past) * past
        return Samples(q, qd, self.qdd[i])

    def stretched(self, factor: float) -> Self:
        """Return the same motion, driven more slowly by a factor."""
        return type(self)(self.h * factor, self.q, self.qd / factor, self.qdd / factor**2)


@dataclass(frozen=True, eq=False)
class SmoothPath:
    """A path from one joint position to another: the joint line and a few smooth modes.

    Attributes:
        start: Joint angles at s = 0, of shape (n_joints,) [rad].
        goal: Joint angles at s = 1, of shape (n_joints,) [rad].
        amplitudes: Amplitudes of the modes (see ``kernels.smooth_paths``), of shape
            (n_joints, n_modes) [rad]; with no mode at all this is the straight line.
    """

    start: Array
    goal: Array
    amplitudes: Array

    def __post_init__(self) -> None:
        _freeze(self)

    def points(self, s: Array) -> tuple[Array, Array, Array]:
        """Return q, dq/ds and d²q/ds² at places of shape (k,), each of shape (k, n_joints) [rad]."""
        modes = path_modes(s, self.amplitudes.shape[1])
        return path_points(self.start, self.goal, self.amplitudes, s, modes)


@dataclass(frozen=True, eq=False)
class PathPlan:
    """A smooth path, driven with a path acceleration that is constant in each interval.

    Attributes:
        path: Where the arm goes.
        s: Grid on the path, from 0 to 1, of shape (m + 1,).
        x: Squared path speeds at the grid points, of shape (m + 1,) [1/s²].
        u: Path accelerations in the intervals, of shape (m,) [1/s²].
    """

    path: SmoothPath
    s: Array
    x: Array
    u: Array

    def __post_init__(self) -> None:
        _freeze(self)

    @cached_property
    def speed(self) -> Array:
        """Path speeds at the grid points, of shape (m + 1,) [1/s]."""
        return np.sqrt(self.x)

    @cached_property
    def breaks(self) -> Array:
        """Instants of the grid points, of shape (m + 1,) [s]."""
        return _instants(2.0 * np.diff(self.s) / (self.speed[:-1] + self.speed[1:]))

    @property
    def duration(self) -> float:
        """Motion time [s]."""
        return float(self.breaks[-1])

    def sample(self, t: Array) -> Samples:
        """Return the states at instants of shape (k,) [s]."""
        i, past = _locate(self.breaks, t)
        u = self.u[i]
        s = self.s[i] + (self.speed[i] + 0.5 * u * past) * past
        speed = (self.speed[i] + u * past)[:, None]
        q, dq, ddq = self.path.points(np.clip(s, self.s[i], self.s[i + 1]))
        return Samples(q, dq * speed, ddq * speed**2 + dq * u[:, None])

    def stretched(self, factor: float) -> Self:
        """Return the same motion, driven more slowly by a factor."""
        return type(self)(self.path, self.s, self.x / factor**2, self.u / factor**2)


def _instants(durations: Array) -> Array:
    """Return when each of a row of pieces begins, and when the last ends; read-only [s]."""
    instants = np.concatenate([[0.0], np.cumsum(durations)])
    instants.setflags(write=False)
    return instants


def _locate(breaks: Array, t: Array) -> tuple[NDArray[np.intp], Array]:
    """Return the piece that each instant falls into, and how long that has gone on [s]."""
    inside = np.clip(t, 0.0, breaks[-1])
    i = np.clip(np.searchsorted(breaks, inside, side="right") - 1, 0, len(breaks) - 2)
    return i, inside - breaks[i]


def _freeze(plan: "ParabolicPlan | SmoothPath | PathPlan") -> None:
    """Replace each array of a plan by a read-only copy."""
    for field in fields(plan):
        value = getattr(plan, field.name)
        if isinstance(value, SmoothPath):
            continue
        array = np.array(value, dtype=np.float64)
        array.setflags(write=False)
        object.__setattr__(plan, field.name, array)
