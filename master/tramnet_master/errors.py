"""Errors of the master, each saying what was found, what was expected and what would work.

* MasterError
  x BadInput: what the user gave cannot be used (exit code 2)
    + InvalidFile: a task or run file, with the field that is wrong
    + InvalidOption: an option of the command line
    + TaskTooLarge: a problem that does not fit into a message
    + OccupiedFolder: the output folder holds a run already
    + OccupiedFile: the output file is there already
    + NotARunFolder: the folder named is not a run's
  x CannotWrite: the disk is full, read-only or not ours
  x FolderInUse: another process writes to this run folder
  x DamagedFile: a file of a run is torn or altered
    + DamagedCheckpoint
  x UnknownCheckpointVersion
  x RunFailed: the run could not be finished
  x RunStopped: the run cannot go on now, and can be resumed once the cause is gone
  x Interrupted: the run was asked to stop (exit code 130)
  x NetworkTaken: a live root holds that network name
  x NoNetwork: nothing to connect to
  x AmbiguousNetwork: several networks are alive and none was named
  x NotWell: nothing of what was asked after is here, or not all of it works
  x NothingHeard: less was said in time than somebody waited for
  x UnsafeFolder: the runtime folder is not private
"""

from pathlib import Path
from typing import ClassVar


class MasterError(Exception):
    """Anything the master tells its user about in one message.

    Attributes:
        exit_code: What the command line returns for it.
    """

    exit_code: ClassVar[int] = 1


class BadInput(MasterError):
    """What the user gave cannot be used."""

    exit_code: ClassVar[int] = 2


class InvalidFile(BadInput):
    """A field of a file is wrong.

    Attributes:
        path: The file.
        field: Dotted name of the field, ``limits.torque_nm[2]`` for one; empty for the whole file.
        found: What stands there.
        expected: What should.
        hint: What would work, or an empty string.
    """

    def __init__(self, path: Path, field: str, found: str, expected: str, hint: str = "") -> None:
        self.path, self.field, self.found = path, field, found
        self.expected, self.hint = expected, hint
        where = f"{path}: {field}" if field else f"{path}"
        advice = f" ({hint})" if hint else ""
        super().__init__(f"{where}: found {found}, expected {expected}{advice}")


class InvalidOption(BadInput):
    """An option of the command line is wrong.

    Attributes:
        option: The option, ``--case`` for one.
        found: What was given.
        expected: What can be given.
        hint: What would work, or an empty string.
    """

    def __init__(self, option: str, found: str, expected: str, hint: str = "") -> None:
        self.option, self.found, self.expected, self.hint = option, found, expected, hint
        advice = f" ({hint})" if hint else ""
        super().__init__(f"{option}: found {found}, expected {expected}{advice}")


class TaskTooLarge(BadInput):
    """A problem does not fit into the message that tells workers of it.

    Attributes:
        problem: Name of the problem.
        reason: Which limit it is above.
    """

    def __init__(self, problem: str, reason: str) -> None:
        self.problem, self.reason = problem, reason
        super().__init__(
            f"{problem}: found a task that is too large to travel ({reason}), expected one within the limits of "
            "protocol/README.md; run fewer points, boxes or scenes at once"
        )


class OccupiedFolder(BadInput):
    """The output folder holds a run already.

    Attributes:
        folder: The folder.
        finished: Whether that run has its result.
    """

    def __init__(self, folder: Path, finished: bool) -> None:
        self.folder, self.finished = folder, finished
        what = "a finished run" if finished else "a run that was not finished"
        way = "" if finished else f"continue it with `tramnet resume {folder}`, "
        super().__init__(
            f"{folder}: found {what}, expected a folder without one "
            f"({way}name another folder with --out, or replace it with --overwrite)"
        )


class OccupiedFile(BadInput):
    """The output file is there already.

    Attributes:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        super().__init__(
            f"{path}: found a file, expected none (name another, or replace it with --overwrite)"
        )


class NotARunFolder(BadInput):
    """The folder is not a run's.

    Attributes:
        folder: The folder.
        missing: The file it lacks.
    """

    def __init__(self, folder: Path, missing: str) -> None:
        self.folder, self.missing = folder, missing
        found = f"no {missing} in it" if folder.is_dir() else "no such folder"
        super().__init__(
            f"{folder}: found {found}, expected the folder of a run, as `tramnet run` makes one"
        )


class CannotWrite(MasterError):
    """A file could not be written.

    Attributes:
        path: The file or folder.
        reason: Why, in the system's words.
    """

    def __init__(self, path: Path, reason: str) -> None:
        self.path, self.reason = path, reason
        super().__init__(
            f"{path}: cannot be written: {reason} "
            "(free some space, or name another folder with --out)"
        )


class FolderInUse(MasterError):
    """Another process writes to this run folder.

    Attributes:
        folder: The folder.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        super().__init__(f"{folder}: another tramnet process is writing to this run folder")


class DamagedFile(MasterError):
    """A file of a run is torn or altered.

    Attributes:
        path: The file.
        found: What is wrong with it.
        expected: What a good one has.
    """

    def __init__(self, path: Path, found: str, expected: str) -> None:
        self.path, self.found, self.expected = path, found, expected
        super().__init__(f"{path}: damaged: found {found}, expected {expected}")


class DamagedCheckpoint(DamagedFile):
    """A checkpoint is torn or altered, and is not used."""


class UnknownCheckpointVersion(MasterError):
    """A checkpoint was written by a version of tramnet with another format.

    Attributes:
        path: The file.
        found: Version of its format.
        expected: Version this tramnet reads.
    """

    def __init__(self, path: Path, found: int, expected: int) -> None:
        self.path, self.found, self.expected = path, found, expected
        super().__init__(
            f"{path}: found checkpoint format {found}, expected {expected} "
            "(resume with the version of tramnet that wrote it)"
        )


class RunFailed(MasterError):
    """The run could not be finished."""


class RunStopped(MasterError):
    """The run cannot go on now; what it has so far is on disk.

    Attributes:
        folder: The run folder.
        reason: Why it stopped, and what would help.
    """

    def __init__(self, folder: Path, reason: str) -> None:
        self.folder, self.reason = folder, reason
        super().__init__(f"{reason}\nthen go on with: tramnet resume {folder}")


class Interrupted(MasterError):
    """The run was asked to stop; its state is on disk if it had any.

    Attributes:
        folder: The run folder.
    """

    exit_code: ClassVar[int] = 130

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        super().__init__(f"interrupted; go on with: tramnet resume {folder}")


class NetworkTaken(MasterError):
    """A live root holds that network name.

    Attributes:
        network: The name.
        holder: Process id of the root that holds it, where known.
    """

    def __init__(self, network: str, holder: int | None) -> None:
        self.network, self.holder = network, holder
        who = f"process {holder}" if holder is not None else "another root"
        super().__init__(
            f"network {network!r}: held by {who}, expected a free name "
            "(name another with --network, or stop that root)"
        )


class NoNetwork(BadInput):
    """There is no live network to talk to.

    Attributes:
        network: The name asked for, or None for any.
        live: Names of the live ones on this machine.
    """

    def __init__(self, network: str | None, live: list[str]) -> None:
        self.network, self.live = network, live
        what = f"network {network!r}" if network is not None else "a running network"
        there = f"live here: {', '.join(live)}" if live else "none is live here"
        super().__init__(
            f"{what}: not found; {there} "
            "(start one with `tramnet run`, or name an endpoint with --connect)"
        )


class AmbiguousNetwork(BadInput):
    """Several networks are alive and none was named.

    Attributes:
        live: Their names.
    """

    def __init__(self, live: list[str]) -> None:
        self.live = live
        super().__init__(
            f"found {len(live)} live networks ({', '.join(live)}), expected one "
            "(name it with --network)"
        )


class NotWell(MasterError):
    """Nothing of what somebody asks after is here, or not all of it works."""


class NothingHeard(MasterError):
    """Less was said in time than somebody waited for.

    Attributes:
        key: Where they listened.
        heard: Number of frames that came.
        wanted: Number of frames waited for.
        seconds: How long they waited [s].
    """

    def __init__(self, key: str, heard: int, wanted: int, seconds: float) -> None:
        self.key, self.heard, self.wanted, self.seconds = key, heard, wanted, seconds
        super().__init__(
            f"{key}: found {heard} frames in {seconds:.1f} s, expected {wanted} "
            "(is anything said there? `tramnet inspect` shows it; '**' echoes everything)"
        )


class UnsafeFolder(MasterError):
    """The runtime folder can be reached by others.

    Attributes:
        folder: The folder.
        owner: User id of its owner.
        mode: Its permission bits.
    """

    def __init__(self, folder: Path, owner: int, mode: int) -> None:
        self.folder, self.owner, self.mode = folder, owner, mode
        super().__init__(
            f"{folder}: found owner {owner} and mode {mode:04o}, expected this user and 0700 "
            "(remove it, or set XDG_RUNTIME_DIR)"
        )
