"""The steps of Progressive Design, each as a problem for connected populations.

Kim & Khosla (1992), section 6. Each step searches fewer variables in smaller ranges: step 1 dimension,
poses and base, step 2 poses and base around what step 1 found, step 3 poses between those of step 2.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels.design import Coupling
from tramnet_workers.kernels.planar import PlanarModel
from tramnet_workers.mpga_settings import GeneticSettings, MpgaSettings, Refinement
from tramnet_workers.problems.connected import ConnectedArms
from tramnet_workers.problems.crank_design import PlanarDesign
from tramnet_workers.problems.design_task import DesignTask
from tramnet_workers.problems.steps import CONSTRAINTS, TERM_NAMES, Step

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Stage:
    """A search that populations are to do.

    Attributes:
        step: Which step it is.
        problem: What they evolve on.
        genetic: Settings of the genetic algorithm.
        stations: Path parameters of the populations' points, of shape (t,).
    """

    step: Step
    problem: ConnectedArms
    genetic: GeneticSettings
    stations: Floats


class Poses(NamedTuple):
    """Arms at stations.

    Attributes:
        stations: Path parameters, of shape (t,).
        lengths: Link lengths without strokes, of shape (n,) [m].
        bases: Base positions, of shape (t, 2) [m].
        joints: Joint angles, then strokes, of shape (t, n + n_strokes) [rad, m].
    """

    stations: Floats
    lengths: Floats
    bases: Floats
    joints: Floats

    @property
    def traits(self) -> Floats:
        """Traits, of shape (t, n_traits); see ``kernels.design``."""
        lengths = np.broadcast_to(self.lengths, (len(self.stations), len(self.lengths)))
        return np.concatenate([lengths, self.bases, self.joints], axis=1)


def design_stage(task: DesignTask, settings: MpgaSettings) -> Stage:
    """Return step 1: dimension, poses and base for the task points, or the placement of a given arm."""
    if task.lengths is not None:
        return _placement_stage(task, settings)
    n, t = task.n_links, len(task.stations)
    lower, upper = _gene_limits(task, t, 2 * (n - 1))
    lower[:, : 2 * (n - 1)], upper[:, : 2 * (n - 1)] = task.genes.lower, task.genes.upper
    task, weights = _same_elbow(task, settings)
    return Stage(
        Step.DESIGN,
        _problem(task, settings, Step.DESIGN, lower, upper, weights, settings.genetic.generations),
        replace(settings.genetic, bits=task.genes.bits),
        np.array(task.stations),
    )


def prototype_stage(task: DesignTask, settings: MpgaSettings, around: Poses) -> Stage:
    """Return step 2: poses and base of an arm with given links, around those of step 1."""
    lower, upper = _ranges_around(task, around, settings.prototype)
    if task.base.free:
        first = task.n_links + len(task.strokes)
        lower[:, first : first + 2] = around.bases - settings.prototype.half_base
        upper[:, first : first + 2] = around.bases + settings.prototype.half_base
    weights = _weights(task, settings, settings.prototype)
    if task.base.free:
        weights, settings = _placed(task, settings, weights)
    problem = _problem(
        task, settings, Step.PROTOTYPE, lower, upper, weights, settings.prototype.generations
    )
    return Stage(
        Step.PROTOTYPE, problem, _refined(settings, settings.prototype), np.array(task.stations)
    )


def planning_stage(
    task: DesignTask,
    settings: MpgaSettings,
    around: Poses,
    neighbours: NDArray[np.int64],
    fixed: Poses,
) -> Stage:
    """Return step 3: poses at sub-task points between poses that are fixed.

    Args:
        task: The task, with the sub-task points as its stations.
        settings: Of the method.
        around: Interpolated poses at these points.
        neighbours: Rows of the neighbours of each, of shape (t, 2), counted on into ``fixed``.
        fixed: Poses of step 2.
    """
    lower, upper = _ranges_around(task, around, settings.planning)
    problem = _problem(
        task,
        settings,
        Step.PLANNING,
        lower,
        upper,
        _weights(task, settings, settings.planning),
        settings.planning.generations,
    )
    problem = replace(
        problem,
        coupling=problem.coupling._replace(neighbours=neighbours, reach=-1.0),
        fixed=fixed.traits,
    )
    return Stage(
        Step.PLANNING, problem, _refined(settings, settings.planning), np.array(task.stations)
    )


def evaluate_poses(task: DesignTask, settings: MpgaSettings, poses: Poses) -> Floats:
    """Return all terms of eq (4) for given poses at the task points, of shape (t, 8)."""
    t = len(poses.stations)
    at = replace(task, stations=tuple(poses.stations))
    genes = np.ascontiguousarray(_genes_of(at, poses)[:, :, None])
    problem = _problem(at, settings, Step.PROTOTYPE, genes[:, :, 0], genes[:, :, 0], {}, 1)
    traits, terms = np.empty((t, poses.traits.shape[1], 1)), np.empty((t, 8, 1))
    problem.evaluate(0, genes, traits, terms)
    problem.rate(0, 0, np.ascontiguousarray(poses.traits), traits, terms, np.empty((t, 1)))
    return terms[:, :, 0]


def ring_neighbours(t: int, closed: bool) -> NDArray[np.int64]:
    """Return the rows before and after each of t task points, of shape (t, 2); -1 where none."""
    rows = np.arange(t)
    neighbours = np.stack([rows - 1, rows + 1], axis=1)
    if closed and t > 2:
        return neighbours % t
    neighbours[neighbours == t] = -1
    return neighbours


def _placement_stage(task: DesignTask, settings: MpgaSettings) -> Stage:
    n = task.n_links
    task, weights = _same_elbow(task, settings)
    weights, settings = _placed(task, settings, weights)
    lower, upper = _gene_limits(task, len(task.stations), n)
    lower[:, :n], upper[:, :n] = task.lower, task.upper
    problem = _problem(
        task, settings, Step.PLACEMENT, lower, upper, weights, settings.genetic.generations
    )
    return Stage(
        Step.PLACEMENT,
        problem,
        replace(settings.genetic, bits=task.genes.bits),
        np.array(task.stations),
    )


def _gene_limits(task: DesignTask, t: int, n_pose: int) -> tuple[Floats, Floats]:
    """Return limits of genes whose pose rows are still open: strokes, base and given lengths."""
    n, n_strokes = task.n_links, len(task.strokes)
    lower, upper = np.zeros((2, t, n_pose + n_strokes + 2 + n))
    base = n_pose + n_strokes
    upper[:, n_pose:base] = [stroke.length for stroke in task.strokes]
    lower[:, base : base + 2] = task.base.lower if task.base.free else task.base.position
    upper[:, base : base + 2] = task.base.upper if task.base.free else task.base.position
    if task.lengths is not None:
        lower[:, base + 2 :] = upper[:, base + 2 :] = task.lengths
    return lower, upper


def _ranges_around(
    task: DesignTask, around: Poses, refinement: Refinement
) -> tuple[Floats, Floats]:
    """Return limits of angles and strokes about poses; all else is given as it is there."""
    n = task.n_links
    centre = _genes_of(task, around)
    lower, upper = centre.copy(), centre.copy()
    lower[:, :n] -= refinement.half_angle
    upper[:, :n] += refinement.half_angle
    for s, stroke in enumerate(task.strokes):
        share = refinement.half_angle / (np.pi / 2) * stroke.length
        lower[:, n + s] = np.maximum(centre[:, n + s] - share, 0.0)
        upper[:, n + s] = np.minimum(centre[:, n + s] + share, stroke.length)
    return lower, upper


def _genes_of(task: DesignTask, poses: Poses) -> Floats:
    """Return the genes, by angle, of poses, of shape (t, n_genes)."""
    lengths = np.broadcast_to(poses.lengths, (len(poses.stations), task.n_links))
    return np.concatenate([poses.joints, poses.bases, lengths], axis=1)


def _same_elbow(task: DesignTask, settings: MpgaSettings) -> tuple[DesignTask, dict[str, float]]:
    """Return the task and weights for step 1 under the settings' elbow rule."""
    weights, rule = _weights(task, settings), settings.elbow
    if rule is None or task.n_links < 2 or len(task.stations) < 2:
        return task, weights
    if len(task.stations) <= rule.few:
        return task, {**weights, "jac": task.weights.get("jac", rule.jac)}
    lower, upper = list(task.lower), list(task.upper)
    for k in range(1, task.n_links):
        if upper[k] >= -lower[k]:
            lower[k] = max(lower[k], 0.0)
        else:
            upper[k] = min(upper[k], 0.0)
    one_sided = replace(task, lower=tuple(lower), upper=tuple(upper))
    return one_sided, {**weights, "jlc": task.weights.get("jlc", rule.jlc)}


def _placed(
    task: DesignTask, settings: MpgaSettings, weights: dict[str, float]
) -> tuple[dict[str, float], MpgaSettings]:
    """Return weights and settings under the settings' placement rule."""
    rule = settings.placement
    own = {"rc": rule.rc, "lc": rule.connecting, "bpc": rule.connecting}
    return {**weights, **own, **task.weights}, replace(settings, ramp=rule.ramp)


def _weights(
    task: DesignTask, settings: MpgaSettings, refinement: Refinement | None = None
) -> dict[str, float]:
    weights = asdict(settings.weights)
    if refinement is not None and refinement.jac is not None:
        weights["jac"] = refinement.jac
    if task.mobility is not None:  # neighbours alone hold the base: each step has to count
        weights["bpc"] = settings.placement.connecting
    return {**weights, **task.weights}


def _refined(settings: MpgaSettings, refinement: Refinement) -> GeneticSettings:
    return replace(settings.genetic, bits=refinement.bits, generations=refinement.generations)


def _problem(
    task: DesignTask,
    settings: MpgaSettings,
    step: Step,
    lower: Floats,
    upper: Floats,
    weights: Mapping[str, float],
    generations: int,
) -> PlanarDesign:
    n, t = task.n_links, len(task.stations)
    active = CONSTRAINTS[step] - ({"bpc"} if task.mobility == np.inf else set())
    return PlanarDesign(
        points=task.points,
        lower=lower,
        upper=upper,
        model=PlanarModel(
            by_place=step is Step.DESIGN,
            limits=np.array([task.lower, task.upper]),
            strokes=np.array([(s.link, s.scale) for s in task.strokes]).reshape(-1, 2),
            boxes=np.array(task.boxes).reshape(-1, 4),
            printed_hc=settings.printed_hc,
        ),
        coupling=Coupling(
            n_links=n,
            n_base=2,
            n_angles=n,
            n_populations=t,
            neighbours=ring_neighbours(t, task.trajectory.closed),
            weights=np.array(
                [weights.get(name, 0.0) if name in active else 0.0 for name in TERM_NAMES]
            ),
            reach=-1.0 if task.mobility is None else min(task.mobility, 1e9),
        ),
        ramp=settings.ramp,
        generations=generations,
        fixed=np.zeros((0, 2 * n + 2 + len(task.strokes))),
        terms=task.terms,
    )
