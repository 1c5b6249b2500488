"""A finished run of ``redundant8`` as the reports see it: the files of its folder, read once."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from tramnet_master.errors import DamagedFile
from tramnet_master.reports.findings import Findings
from tramnet_master.run_folder import RUN, RunFolder, trajectory_file
from tramnet_master.tracked_paths import TrackedPath
from tramnet_workers.errors import InvalidTask
from tramnet_workers.kernels.distances import segment_box_distances
from tramnet_workers.problems.tracking_task import TrackingTask

Array = NDArray[np.float64]

EXPERIMENT = "redundant8"

MOST_DRAWN = 4  # scenes with figures of their own


@dataclass(frozen=True, eq=False)
class FollowedScene:
    """A scene and how it was followed.

    Attributes:
        name: Name of the scene, empty for the only one of a run.
        task: The task.
        path: What the arm did.
        caption: What ran, in a line.
    """

    name: str
    task: TrackingTask
    path: TrackedPath
    caption: str

    @property
    def suffix(self) -> str:
        """What the names of the scene's figures end in."""
        return f"-{self.name}" if self.name else ""

    @cached_property
    def most_clearance(self) -> Array:
        """Distance of each point of the path from the boxes, of shape (n_steps + 1,) [cm].

        No arm whose tip is there has more clearance. Infinite without boxes.
        """
        points = self.task.path.copy()
        most = np.full(len(points), np.inf)
        for box in self.task.boxes:
            distances = segment_box_distances(points, points, np.tile(box, (len(points), 1)))
            most = np.minimum(most, np.maximum(distances - self.task.radius, 0.0))
        return most

    @cached_property
    def beside_boxes(self) -> NDArray[np.bool_]:
        """Whether each point of the path is above, below or in a box, of shape (n_steps + 1,)."""
        x, y = self.task.path[:, 0, None], self.task.path[:, 1, None]
        lower, upper = self.task.boxes[:, :3], self.task.boxes[:, 3:]
        inside = (lower[:, 0] <= x) & (x <= upper[:, 0]) & (lower[:, 1] <= y) & (y <= upper[:, 1])
        beside: NDArray[np.bool_] = np.any(inside, axis=1).astype(np.bool_)
        return beside


@dataclass(frozen=True, eq=False)
class TrackingRecord:
    """Everything a run folder holds that a picture can show.

    Attributes:
        folder: The folder.
        found: What ``result.json`` says.
        scenes: The scenes whose files are there.
    """

    folder: Path
    found: Findings
    scenes: tuple[FollowedScene, ...]

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Read a run folder.

        Raises:
            NotARunFolder: There is no finished run in it.
            DamagedFile: A file of it is torn.
        """
        found, document = Findings.read(folder), _read_document(folder)
        tasks = dict(zip(document.names, document.tasks, strict=True))
        files = {name: folder / trajectory_file(name) for name in tasks}
        scenes = (
            _scene(folder, found, name, tasks[name])
            for name, file in files.items()
            if file.is_file()
        )
        return cls(folder, found, tuple(scenes))

    @property
    def drawn(self) -> list[FollowedScene]:
        """The scenes that have figures of their own: all, or those of most error and least clearance."""
        if len(self.scenes) <= MOST_DRAWN:
            return list(self.scenes)
        farthest = max(self.scenes, key=lambda scene: float(scene.path.error[1:].max()))
        nearest = min(self.scenes, key=lambda scene: _least(scene.path.clearance[1:]))
        return [scene for scene in self.scenes if scene in (farthest, nearest)]


class _Document(Struct, frozen=True):
    """What of ``run.toml`` is needed here."""

    names: list[str]
    tasks: list[dict[str, object]]


def _read_document(folder: Path) -> _Document:
    try:
        document = msgspec.convert(RunFolder(folder).run().get(EXPERIMENT), _Document, strict=True)
    except msgspec.ValidationError as error:
        raise DamagedFile(folder / RUN, str(error), f"the table {EXPERIMENT}") from error
    if len(document.names) != len(document.tasks):
        found = f"{len(document.names)} names of {len(document.tasks)} tasks"
        raise DamagedFile(folder / RUN, found, "a name for each task")
    return document


def _scene(
    folder: Path, found: Findings, name: str, parameters: Mapping[str, object]
) -> FollowedScene:
    try:
        task = TrackingTask.from_parameters(parameters)
    except InvalidTask as error:
        raise DamagedFile(folder / RUN, str(error), "tasks as tramnet wrote them") from error
    file = folder / trajectory_file(name)
    path = TrackedPath.read(file)
    if path.q.shape != (task.n_steps + 1, task.n_joints):
        expected = f"{task.n_steps + 1} points of {task.n_joints} joints"
        raise DamagedFile(file, f"{len(path.q)} points of {path.q.shape[1]} joints", expected)
    caption = f"{found.caption}  ·  {name}" if name else found.caption
    return FollowedScene(name, task, path, caption)


def _least(clearance: Array) -> float:
    return float(np.min(clearance, initial=np.inf, where=~np.isnan(clearance)))
