"""The folder of a run: what makes it repeatable, what it found, and what a resume needs.

run.toml          everything needed to repeat the run, on disk before its first generation
history.csv       a row a generation (``history``)
log.jsonl         what happened, an object a line; locked by the process that writes the folder
checkpoint-*      the last two states (``checkpoints``)
trajectory.csv    the plan, in steps of 0.5 ms or finer (``trajectories``), or the path that was followed, point by
                  point (``tracked_paths``); trajectory-<name>.csv where there are several scenes
nodes.csv         the plan's nodes
straight_line.csv the straight line, timed optimally, to compare the plan with
links.csv         what the links of a transputer machine would have carried (``traffic/totals``)
servo-*.csv       the plan replayed through a servo
design.json       the arm that was designed, with its poses
arm.urdf          the arm for simulators and planners
arm_dh.csv        the arm as a Denavit-Hartenberg table
populations.csv   how each population evolved
motion.csv        joint motion along the path
violations.csv    which constraint fails where
result.json       what was found; its presence says that the run is finished (``results``)
*.png, *.svg      the figures (``reports``), made from the files above alone
"""

import contextlib
import datetime
import fcntl
import itertools
import os
import time
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Self

import msgspec
import tomli_w

from tramnet_master.checkpoints import CheckpointStore
from tramnet_master.errors import FolderInUse, InvalidFile, NotARunFolder, OccupiedFolder
from tramnet_master.files import write_atomically, writing
from tramnet_master.plain_values import plain, plain_leaf, without_none
from tramnet_master.results import Result, read_result, write_result

RUN = "run.toml"
HISTORY = "history.csv"
LOG = "log.jsonl"
TRAJECTORY = "trajectory.csv"
NODES = "nodes.csv"
STRAIGHT_LINE = "straight_line.csv"
LINKS = "links.csv"
RESULT = "result.json"
SERVO = "servo-{period}ms.csv"
DESIGN = "design.json"
ARM_URDF = "arm.urdf"
ARM_TABLE = "arm_dh.csv"
POPULATIONS = "populations.csv"
MOTION = "motion.csv"
VIOLATIONS = "violations.csv"
_SCENE_TRAJECTORY = "trajectory-{name}.csv"

_OF_MOTIONS = (TRAJECTORY, _SCENE_TRAJECTORY.format(name="*"), NODES, STRAIGHT_LINE, "servo-*.csv")
_OF_DESIGNS = (DESIGN, ARM_URDF, ARM_TABLE, POPULATIONS, MOTION, VIOLATIONS)
_OURS = (RUN, HISTORY, LINKS, RESULT, *_OF_MOTIONS, *_OF_DESIGNS)
_OUR_FIGURES = (
    "objective",
    "position",
    "torque",
    "velocity",
    "acceleration",
    "comparison",
    "servo",
    "joint_angles",
    "joint_angles-*",
    "tracking",
    "tracking-*",
    "postures",
    "postures-*",
    "scenes",
    "fitness",
    "total_length",
    "task_poses",
    "planned_poses",
    "configurations",
    "null_motion",
    "dexterity",
    "constraints",
)
_HEAD = b"# A run of tramnet: everything needed to repeat it.\n\n"


class RunFolder:
    """A run folder, to read.

    Attributes:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        """Look at a run folder.

        Raises:
            NotARunFolder: There is no ``run.toml`` in it.
        """
        if not (path / RUN).is_file():
            raise NotARunFolder(path, RUN)
        self.path = path

    @property
    def finished(self) -> bool:
        """Whether the run has its result."""
        return (self.path / RESULT).is_file()

    def run(self) -> dict[str, object]:
        """What ``run.toml`` says.

        Raises:
            InvalidFile: It is no TOML.
        """
        path = self.path / RUN
        try:
            return tomllib.loads(path.read_text())
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InvalidFile(path, "", str(error), "TOML as tramnet wrote it") from error

    def result(self) -> dict[str, object]:
        """What ``result.json`` says.

        Raises:
            NotARunFolder: The run has no result yet.
            DamagedFile: It is no JSON object.
        """
        if not self.finished:
            raise NotARunFolder(self.path, RESULT)
        return read_result(self.path / RESULT)


class OpenRunFolder(RunFolder):
    """A run folder that this process writes; nobody else can meanwhile.

    Made by ``create`` or ``resume``; a context manager that lets go of the folder.

    Attributes:
        checkpoints: The states to resume from.
    """

    def __init__(self, path: Path, log: int) -> None:
        super().__init__(path)
        self.checkpoints = CheckpointStore(path, self._log_warning)
        self._log = log
        self._began = time.monotonic()

    @classmethod
    def create(cls, path: Path, run: Mapping[str, object], overwrite: bool = False) -> Self:
        """Make the folder of a new run, with its ``run.toml``.

        Args:
            path: The folder; made where it is missing. Files that are not a run's are left alone.
            run: Plain values, arrays, structs; what is None is left out.
            overwrite: Whether a run that is there already gives way.

        Raises:
            OccupiedFolder: There is a run already.
            FolderInUse: Another process writes one there.
            CannotWrite: The disk refuses.
        """
        with writing(path):
            path.mkdir(parents=True, exist_ok=True)
        log = _lock(path)
        try:
            if (path / RUN).exists() and not overwrite:
                raise OccupiedFolder(path, finished=(path / RESULT).exists())
            _clear(path, log)
            document = without_none(plain(run))
            assert isinstance(document, dict), "a run is a map"
            write_atomically(path / RUN, _HEAD + tomli_w.dumps(document).encode())
            return cls(path, log)
        except BaseException:
            os.close(log)
            raise

    @classmethod
    def resume(cls, path: Path) -> Self:
        """Open the folder of a run that is to go on.

        Raises:
            NotARunFolder: There is no run.
            FolderInUse: Its process still runs.
        """
        RunFolder(path)
        log = _lock(path)
        return cls(path, log)

    def log(self, event: str, detail: Mapping[str, object] | None = None) -> None:
        """Append an object to ``log.jsonl`` at once.

        Args:
            event: What happened, in a word: ``joined``, ``lost``, ``checkpoint`` ...
            detail: Plain values that belong to it.
        """
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        elapsed = round(time.monotonic() - self._began, 6)
        line = {"time": now, "elapsed_s": elapsed, "event": event, **(detail or {})}
        with writing(self.path / LOG):
            os.write(self._log, msgspec.json.encode(line, enc_hook=plain_leaf) + b"\n")

    def write_result(self, result: Result) -> None:
        """Write ``result.json``, with which the run is finished."""
        write_result(self.path / RESULT, result)

    def close(self) -> None:
        """Let go of the folder."""
        if self._log >= 0:
            os.close(self._log)
            self._log = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _log_warning(self, text: str) -> None:
        self.log("warning", {"text": text})


def trajectory_file(scene: str) -> str:
    """Name of the file with what a scene's arm did; ``scene`` is empty for the only one of a run."""
    return _SCENE_TRAJECTORY.format(name=scene) if scene else TRAJECTORY


def default_folder(parent: Path, experiment: str, today: datetime.date) -> Path:
    """Make an empty folder for a run that was given none: ``runs/<experiment>-<date>-<n>``.

    Args:
        parent: Folder of the folders, ``runs`` for one; made where it is missing.
        experiment: Name of the job.
        today: The date to put into the name.

    Returns:
        The folder, of the lowest number that is free; nobody else was given it.

    Raises:
        CannotWrite: The disk refuses.
    """
    with writing(parent):
        parent.mkdir(parents=True, exist_ok=True)
    for number in itertools.count(1):
        path = parent / f"{experiment}-{today.isoformat()}-{number}"
        with writing(path), contextlib.suppress(FileExistsError):
            path.mkdir()
            return path
    raise AssertionError("there is always a number that is free")


def _lock(path: Path) -> int:
    """Descriptor of the log, locked until it is closed; the kernel lets go of a killed process's."""
    with writing(path / LOG):
        log = os.open(path / LOG, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
    try:
        fcntl.flock(log, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(log)
        raise FolderInUse(path) from error
    return log


def _clear(path: Path, log: int) -> None:
    """Remove what an earlier run left, and nothing else."""
    figures = [f"{name}.{kind}" for name in _OUR_FIGURES for kind in ("png", "svg")]
    CheckpointStore(path).clear()
    with writing(path):
        os.ftruncate(log, 0)
        for pattern in (*_OURS, *figures):
            for file in path.glob(pattern):
                file.unlink()
