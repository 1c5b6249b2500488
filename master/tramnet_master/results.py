"""``result.json``: what a run found, in fixed keys that never hold NaN.

``Result`` has the keys every experiment writes (design section 6); an experiment adds its own by a subclass.
"""

import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import msgspec
from msgspec import Struct

from tramnet_master.errors import DamagedFile
from tramnet_master.files import write_atomically
from tramnet_master.plain_values import plain_leaf

PACKAGES = ("tramnet", "numpy", "numba", "pin", "eclipse-zenoh", "msgpack", "msgspec")


class BestFound(Struct, frozen=True):
    """The best individual of a run.

    Attributes:
        objective: Its objective.
        generation: Generation in which it appeared first.
    """

    objective: float
    generation: int


class Messages(Struct, frozen=True):
    """Messages of one kind that the root sent and received.

    Attributes:
        sent: How many it sent.
        sent_bytes: Their size [B].
        received: How many it received.
        received_bytes: Their size [B].
    """

    sent: int
    sent_bytes: int
    received: int
    received_bytes: int


class Booked(Struct, frozen=True):
    """The link books in a few numbers, all of virtual time.

    Attributes:
        node: What would have computed.
        mbaud: Speed of its links [Mbaud].
        rounds: Rounds of the run: generations or steps.
        booked: Of these, how many were booked; all numbers below are of these alone.
        seconds_each: Time of a slot (individual, population or point) there, by kind of work [s].
        seconds: Time there, without what the root does between two rounds [s].
        computing_seconds: Compute time of all workers, added up [s].
        frames: Messages on links; one over three links counts three times.
        bytes: Modelled bytes on links, counted likewise [B].
        busiest: The directed link that was busy longest, None where nothing passed.
        utilisation: Share of the time for which it was.
    """

    node: str
    mbaud: int
    rounds: int
    booked: int
    seconds_each: dict[str, float]
    seconds: float
    computing_seconds: float
    frames: int
    bytes: int
    busiest: tuple[int, int] | None
    utilisation: float


class Result(Struct, frozen=True, kw_only=True):
    """What every run writes.

    Attributes:
        experiment: Name of the job, ``puma560`` for one.
        method: The method, as the user names it.
        case: Case of the paper, None for a user's own task.
        seed: Seed of all random streams.
        population_size: Individuals in a generation.
        generations: Generations evaluated.
        evaluations: Individuals evaluated.
        best: The best individual.
        wall_seconds: From the first generation to the last, over all resumed parts [s].
        workers: Workers at the end of the run.
        topology: Shape of the network.
        lost_workers: Workers lost on the way.
        condemned: Individuals given the worst fitness because they ended three workers.
        reproducible: Whether the same seed gives the same result anywhere.
        final_population_sha256: Hash of the last population, genomes and objectives.
        paper: The paper's figure for the same quantity, None where it has none.
        versions: Versions of what computed it.
        expelled: Workers that an audit found to answer what is not so; nothing they answered is in the result.
        link_books: What the network would have been like if it had been made of transputers, in virtual time; None
            where no books were kept.
    """

    experiment: str
    method: str
    case: int | None
    seed: int
    population_size: int
    generations: int
    evaluations: int
    best: BestFound
    wall_seconds: float
    workers: int
    topology: str
    lost_workers: int
    condemned: list[dict[str, object]]
    reproducible: bool
    final_population_sha256: str
    paper: float | None
    versions: dict[str, str]
    messages: dict[str, Messages] = {}
    expelled: list[dict[str, object]] = []
    link_books: Booked | None = None


class Check(Struct, frozen=True):
    """One line of a plan's verification.

    Attributes:
        name: What is checked, in words.
        value: What was found.
        limit: The value that is still good, in the same unit; None where the line only informs.
        unit: Unit of both, empty for a ratio.
        passed: Whether it is good.
        at_least: Whether larger values than the limit are good, not smaller ones.
    """

    name: str
    value: float
    limit: float | None
    unit: str
    passed: bool
    at_least: bool = False


class Limits(Struct, frozen=True):
    """The limits a plan had to keep, one number a joint.

    Attributes:
        torque_nm: Largest torques [N m].
        velocity_rad_s: Largest speeds, None where there is none [rad/s].
        position_lower_rad: Smallest angles, None where there is none [rad].
        position_upper_rad: Largest angles, None where there is none [rad].
    """

    torque_nm: list[float]
    velocity_rad_s: list[float | None]
    position_lower_rad: list[float | None]
    position_upper_rad: list[float | None]


class Tracking(Struct, frozen=True):
    """How far from the goal a servo leaves an arm whose plan may use a share of the torque limits.

    Attributes:
        margin: The share.
        motion_time_s: Duration of the plan, slowed down to it [s].
        error_rad: Largest distance of a joint from the goal at the end [rad].
        error_feed_forward_rad: The same with the plan's torques added by the servo [rad].
    """

    margin: float
    motion_time_s: float
    error_rad: float
    error_feed_forward_rad: float


class ServoResult(Struct, frozen=True):
    """What replays of a plan through a servo showed: Wang & Zalzala (1995), section 6.

    Attributes:
        period_ms: Time between two set-points [ms].
        bandwidth_rad_s: Natural frequency of each joint's controller [rad/s].
        feed_forward: Whether the replay that was written has the plan's torques added.
        rms_jerk_rad_s3: Root mean square of each joint's jerk, without saturation [rad/s³].
        rms_jerk_ratio: The same over that with set-points every 1.75 ms, a joint each.
        peak_command_ratio: Largest torque asked of each joint over its limit.
        tracking: Errors at the end, for plans that leave the motors less or more to spare.
    """

    period_ms: float
    bandwidth_rad_s: float
    feed_forward: bool
    rms_jerk_rad_s3: list[float]
    rms_jerk_ratio: list[float]
    peak_command_ratio: list[float]
    tracking: list[Tracking]


class MotionResult(Result, frozen=True, kw_only=True):
    """What a run of ``puma560`` writes beside.

    Attributes:
        robot: Name of the arm.
        start_rad: Joint angles at the start [rad].
        goal_rad: Joint angles at the goal [rad].
        limits: What the plan had to keep.
        motion_time_s: Duration of the plan [s].
        objective: Its objective.
        end_velocity_rad_s: Sum over the joints of the speeds at its end, eq 8 [rad/s].
        torque_ratio_max: Largest torque over its limit, anywhere on the plan.
        straight_line_time_s: Duration of the straight line, timed optimally [s].
        limit_time_s: The least time there is, None where it is not known [s].
        gap_to_limit: Duration over the least time, minus 1; None where that is not known.
        gap_to_straight_line: Duration over that of the straight line, minus 1.
        evaluations_per_second: Rate over the whole run [1/s].
        network_overhead_fraction: Share of the run in which no worker computed.
        verified: Whether every check passed.
        verification: The checks.
        failures: Why the plan cannot be carried out, in words; empty if it can.
        servo: What replays through a servo showed, None where none was asked for.
    """

    robot: str
    start_rad: list[float]
    goal_rad: list[float]
    limits: Limits
    motion_time_s: float
    objective: float
    end_velocity_rad_s: float
    torque_ratio_max: float
    straight_line_time_s: float | None
    limit_time_s: float | None
    gap_to_limit: float | None
    gap_to_straight_line: float | None
    evaluations_per_second: float
    network_overhead_fraction: float | None
    verified: bool
    verification: list[Check]
    failures: list[str]
    servo: ServoResult | None = None


def write_result(path: Path, result: Result) -> None:
    """Write a result, whole or not at all; what is not finite becomes null.

    Raises:
        CannotWrite: The disk refuses.
    """
    # msgspec writes NaN and infinities as null.
    content = msgspec.json.encode(result, enc_hook=plain_leaf)
    write_atomically(path, msgspec.json.format(content, indent=2) + b"\n")


def read_result(path: Path) -> dict[str, object]:
    """The keys of a ``result.json``.

    Raises:
        DamagedFile: It is no JSON object.
    """
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[str, object])
    except (msgspec.MsgspecError, ValueError) as error:
        raise DamagedFile(path, str(error), "a JSON object") from error


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that decide a result."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found
