"""What an experiment hands to the runner: the problem for the workers, the engine, and what to make of the end."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypedDict

from tramnet_master.engines.engine import Engine
from tramnet_master.results import BestFound, Booked, Result
from tramnet_master.run_folder import OpenRunFolder
from tramnet_protocol.messages import Setup


class Common(TypedDict):
    """The keys of ``result.json`` that every experiment has."""

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
    link_books: Booked | None


class Timing(TypedDict):
    """How fast a run was.

    Attributes:
        evaluations_per_second: Rate over the whole run [1/s].
        network_overhead_fraction: Share of the run in which the root waited and no worker computed.
    """

    evaluations_per_second: float
    network_overhead_fraction: float


class Load(NamedTuple):
    """What the workers did in a run.

    Attributes:
        exchanges: Pieces of work sent and answered.
        busy_seconds: Compute time of each worker that gave an answer, in the order of seats [s].
    """

    exchanges: int
    busy_seconds: tuple[float, ...]


Conclude = Callable[[OpenRunFolder, Common, Timing, Load], Result]


@dataclass(frozen=True)
class Experiment:
    """One run to be made.

    Attributes:
        name: Name of the job, as the command line knows it.
        method: The method, as the user names it.
        case: Case of the paper, None for a user's own task.
        seed: Seed of all random streams.
        population_size: Individuals in a generation.
        generations: Number of generations.
        setup: The problem, as workers build it.
        engine: The method at work.
        document: What ``run.toml`` keeps so that the same experiment can be prepared again.
        paper: The paper's figure for the objective, None where it has none.
        conclude: Writes the files of the experiment's own and returns the result.
        parallelism: How many workers can compute at once at most, or None where there is no such limit.
        subject: What it is run on, in a few words, where the case does not say it.
    """

    name: str
    method: str
    case: int | None
    seed: int
    population_size: int
    generations: int
    setup: Setup
    engine: Engine
    document: Mapping[str, object]
    paper: float | None
    conclude: Conclude
    parallelism: int | None = None
    subject: str = ""

    @property
    def title(self) -> str:
        """The run in a few words."""
        case = f"case {self.case}" if self.case is not None else "own task"
        return f"{self.name} {self.subject or case}, {self.method}"
