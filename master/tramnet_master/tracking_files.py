"""Users' own tasks for ``redundant8``, read once, here; what passes can be relied on everywhere else.

A task file says what differs from the task of Lin, Chen & Yu (2017); whatever it leaves out is theirs:

    start_deg = [0, -90, -50, 0, 50, 0, -25, 0]    # the tip is then on the path's first point

    [arm]
    dh = [[0, 28, 0, 0], [0, 15, 0, -76], ...]     # theta [deg], d [cm], a [cm], alpha [deg]
    fixed_rows = [0]                               # rows without a joint; [] if each has one
    radius_cm = 0                                  # of the links
    # urdf = "my_arm.urdf"                         # instead of dh and fixed_rows

    [path]                                         # a polyline, cut into equal steps
    points_cm = [[17.0, 57.6, 30.5], [11.0, 110.0, 40.0]]
    # csv = "my_path.csv"                          # instead: x_cm,y_cm,z_cm, a point a line
    steps = 1000

    [[box]]                                        # as many as there are; `box = []` for none
    lower_cm = [5, 50, 50]
    upper_cm = [15, 100, 50]

    [limits]
    step_deg = 0.5                                 # of all joints, or a list
    zone_cm = 0.1

    [weights]                                      # of the cost w1 e^2 / 2 + w2 / d^2
    error = 1.0
    clearance = 0.1                                # the method's own if left out

A file of scenes has the same tables for all of them, and ``[[scene]]`` entries with a ``name`` and the
tables in which they differ: ``[scene.path]``, ``[[scene.box]]``, ``[scene.limits]``, ``[scene.weights]`` and
``start_deg``. A scene's boxes, or its points, replace those of all; other keys are taken one by one.
"""

import re
from pathlib import Path
from typing import Annotated, NamedTuple, TypeAlias

from msgspec import Meta, Struct
from msgspec.structs import asdict

from tramnet_master.errors import InvalidFile
from tramnet_master.strict_toml import read_strictly
from tramnet_master.tracking_tables import (
    Boxes,
    LimitsTable,
    PathTable,
    Start,
    TaskTables,
    WeightsTable,
    overlaid,
    overlaid_path,
)
from tramnet_master.tracking_tasks import Names, TaskBuilder
from tramnet_master.wording import spell
from tramnet_workers.problems.tracking_task import TrackingTask

_SAFE = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")

_NAME = "1 to 64 letters, digits, dots, dashes or underscores, the first a letter or digit"
_Name: TypeAlias = Annotated[str, Meta(description=_NAME)]


class Scene(NamedTuple):
    """A path to follow, and what it is called.

    Attributes:
        name: Name of the scene, safe in names of files; empty for the only one of a run.
        task: The task.
    """

    name: str
    task: TrackingTask


class _SceneTable(Struct, frozen=True, kw_only=True):
    name: _Name
    start_deg: Start | None = None
    path: PathTable = PathTable()
    box: Boxes | None = None
    limits: LimitsTable = LimitsTable()
    weights: WeightsTable = WeightsTable()


_Scenes: TypeAlias = Annotated[
    list[_SceneTable], Meta(min_length=1, description="[[scene]] tables, each with a name")
]


class _ScenesFile(TaskTables, frozen=True, kw_only=True):
    scene: _Scenes


def read_tracking_task(path: Path) -> TrackingTask:
    """Read a task file of ``redundant8``.

    Raises:
        InvalidFile: With the field that is wrong, what was found and what was expected.
    """
    return TaskBuilder(path, read_strictly(path, TaskTables)).build()


def read_scenes(path: Path) -> tuple[Scene, ...]:
    """Read a file of scenes: paths past boxes that differ in some of their tables.

    All of them have the same arm and number of steps.

    Raises:
        InvalidFile: With the field that is wrong, what was found and what was expected.
    """
    file = read_strictly(path, _ScenesFile)
    _check_names(path, [scene.name for scene in file.scene])
    scenes = tuple(_build_scene(path, file, i) for i in range(len(file.scene)))
    for i, scene in enumerate(scenes):
        found, expected = scene.task.n_steps, scenes[0].task.n_steps
        if found != expected:
            wanted = f"{expected}, as in scene {spell(scenes[0].name)}: all have as many steps"
            raise InvalidFile(path, f"scene[{i}].path.steps", f"{found} steps", wanted)
    return scenes


def _check_names(path: Path, names: list[str]) -> None:
    seen: dict[str, int] = {}
    for i, name in enumerate(names):
        field = f"scene[{i}].name"
        if not _SAFE.fullmatch(name):
            raise InvalidFile(path, field, spell(name), _NAME, "it becomes part of file names")
        # Some file systems do not tell capitals from small letters.
        first = seen.setdefault(name.casefold(), i)
        if first != i:
            raise InvalidFile(path, field, spell(name), f"another name than that of scene[{first}]")


def _build_scene(path: Path, file: _ScenesFile, index: int) -> Scene:
    own = file.scene[index]
    tables = TaskTables(
        arm=file.arm,
        start_deg=file.start_deg if own.start_deg is None else own.start_deg,
        path=overlaid_path(file.path, own.path),
        box=file.box if own.box is None else own.box,
        limits=overlaid(file.limits, own.limits),
        weights=overlaid(file.weights, own.weights),
    )
    names = Names(f"scene[{index}].", _said(own))
    return Scene(own.name, TaskBuilder(path, tables, names).build())


def _said(scene: _SceneTable) -> frozenset[str]:
    """Dotted names of what a scene says itself."""
    said = {name for name in ("start_deg", "box") if getattr(scene, name) is not None}
    for table in ("path", "limits", "weights"):
        said |= {f"{table}.{k}" for k, v in asdict(getattr(scene, table)).items() if v is not None}
    return frozenset(said)
