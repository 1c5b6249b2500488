"""What the design of a spatial arm ends with, as plain values: the content of its ``design.json``."""

from typing import NamedTuple

import numpy as np

from tramnet_workers.kernels.design import DM
from tramnet_workers.kernels.order import wrap
from tramnet_workers.problems.checks import Violation, term_violations
from tramnet_workers.problems.design_report import describe_terms, describe_violations
from tramnet_workers.problems.spatial_task import SpatialFound, SpatialTask
from tramnet_workers.robots.revolute_chain import ChainRow, chain_urdf_of, with_lengths


class SpatialArm(NamedTuple):
    """A spatial arm as the method ends with it.

    Attributes:
        task: The task.
        found: The arm at its task points.
    """

    task: SpatialTask
    found: SpatialFound

    @property
    def violations(self) -> tuple[Violation, ...]:
        """What violates a limit; stations are numbers of points, from 0."""
        return term_violations(np.arange(float(len(self.found.terms))), self.found.terms)

    @property
    def rows(self) -> tuple[ChainRow, ...]:
        """The Denavit-Hartenberg rows, with the designed lengths put in."""
        return with_lengths(self.task.arm, self.found.lengths.tolist())

    @property
    def base(self) -> tuple[float, float, float]:
        """Where it stands [m]."""
        x, y, z = self.found.base.tolist()
        return x, y, z

    def urdf(self, name: str) -> str:
        """Return the arm as URDF text."""
        return chain_urdf_of(self.task.arm, self.found.lengths.tolist(), self.base, name)

    def describe(self) -> dict[str, object]:
        """Return the design as plain values; keys carry their units."""
        found, violations = self.found, self.violations
        return {
            "arm": "spatial",
            "link_lengths_m": found.lengths.tolist(),
            "designed_lengths_m": found.lengths.tolist(),
            "base_m": found.base.tolist(),
            "dexterity_mean": float(found.terms[:, DM].mean()),
            "link_spread_m": found.spread,
            "lower_rad": [row.lower for row in self.rows],
            "upper_rad": [row.upper for row in self.rows],
            "rows": [[row.a, row.d, row.alpha] for row in self.rows],
            "path": {
                "kind": "polyline",
                "vertices_m": [list(point) for point in self.task.points],
                "closed": self.task.closed,
            },
            "points": [self._describe_point(i, violations) for i in range(len(found.terms))],
            "violations": describe_violations(violations),
        }

    def _describe_point(self, i: int, violations: tuple[Violation, ...]) -> dict[str, object]:
        return {
            "station": float(i),
            "task_point": True,
            "point_m": list(self.task.points[i]),
            "base_m": self.found.base.tolist(),
            "pose_rad": [wrap(angle) for angle in self.found.angles[i].tolist()],
            **describe_terms(self.found.terms[i], float(i), violations),
        }
