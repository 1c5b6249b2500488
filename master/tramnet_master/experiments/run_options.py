"""How a run is made, whatever it runs: workers, network, failures, checkpoints."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec

from tramnet_master.errors import InvalidFile, InvalidOption
from tramnet_master.farm.rules import Rules
from tramnet_master.simulation.machines import T805, machine
from tramnet_master.topologies import find_shape
from tramnet_master.traffic.books import LinkBooks
from tramnet_protocol.edge_list import edge_list_shape
from tramnet_protocol.links import LinkTiming
from tramnet_protocol.messages import Pace
from tramnet_protocol.settings import PRIVATE
from tramnet_protocol.topology import Shape

ANYWHERE_HERE = "tcp/127.0.0.1:0"
"""A free port that only this machine reaches."""

NO_NODE = "none"
"""Stands for a node where no link books are to be kept."""


@dataclass(frozen=True)
class RunOptions:
    """How a run is made; none of it changes the result.

    Attributes:
        workers: Number of local workers.
        topology: Shape of the network, or a file of links.
        network: Name of the network, or None for any free one.
        listen: Endpoint at which workers connect.
        observers: Endpoint at which observers of other machines attach, or None for none.
        first_deadline: Time an individual may take before its cost is known [s].
        on_failure: ``penalise``, ``retry`` or ``stop``.
        allow_mixed: Whether workers of another arithmetic are let in.
        checkpoint_seconds: Time between checkpoints [s].
        checkpoint_generations: Generations between checkpoints, or 0 for as many as that time lasts.
        deadline: No chunk's deadline is shorter [s].
        worker_memory: Memory a local worker may have [MiB], or 0 for any.
        node: Whose machine the link books are kept for, or ``none`` for no books.
        mbaud: Speed of its links [Mbaud].
        pace: Whether frames really take as long as on such links.
        tls: Folder with the root's certificate, its key and its list of who may join, or None to let all in.
    """

    workers: int = 2
    topology: str = "star"
    network: str | None = None
    listen: str = ANYWHERE_HERE
    observers: str | None = None
    first_deadline: float = 60.0
    on_failure: str = "penalise"
    allow_mixed: bool = False
    checkpoint_seconds: float = 1.0
    checkpoint_generations: int = 0
    deadline: float = 3.0
    worker_memory: int = 0
    node: str = T805
    mbaud: int = 20
    pace: bool = False
    tls: Path | None = None

    @property
    def endpoint(self) -> str:
        """Where the root listens: where it was told, or on loopback, in private where it has a certificate."""
        if self.tls and self.listen == ANYWHERE_HERE:
            return ANYWHERE_HERE.replace("tcp", PRIVATE[0])
        return self.listen

    def shape(self) -> Shape:
        """Return the shape of the network.

        Raises:
            BadTopology: There is none of that name, or the links cannot be laid.
            InvalidFile: The file of links cannot be used.
        """
        return find_shape(self.topology)

    def books(self) -> LinkBooks | None:
        """Return empty link books, or None where none are to be kept.

        Raises:
            InvalidOption: There is no such node.
            BadLink: Its links have no such speed.
        """
        if self.node == NO_NODE:
            return None
        if self.node != T805:
            raise InvalidOption("--node", repr(self.node), f"{T805} or {NO_NODE}")
        return LinkBooks(machine(self.node, self.mbaud))

    def pace_of_links(self) -> Pace:
        """Return the speed of the links whose pace frames shall have, 0 for their own [Mbaud].

        Raises:
            BadLink: No link of a transputer has that speed.
        """
        LinkTiming.of(self.mbaud)
        pace: Pace = msgspec.convert(self.mbaud if self.pace else 0, Pace)
        return pace

    def check(self) -> None:
        """Check all of it before anything is begun.

        Raises:
            InvalidOption: A word means nothing.
            BadLink: No link of a transputer has that speed.
            BadTopology: The shape is unknown or has no room for the local workers.
            InvalidFile: The file of links cannot be used.
        """
        if self.tls and self.observers:
            raise InvalidOption(
                "--observers",
                repr(self.observers),
                "none beside --tls",
                "from elsewhere, name the root's certificate: tramnet inspect --connect ... --tls FOLDER",
            )
        self.rules()
        self.books()
        self.pace_of_links()
        self.shape().check_room(1 + self.workers)

    def rules(self) -> Rules:
        """Return the scheduler's rules.

        Raises:
            InvalidOption: There is no such policy.
        """
        if self.on_failure not in ("penalise", "retry", "stop"):
            raise InvalidOption("--on-failure", self.on_failure, "penalise, retry or stop")
        return Rules(
            first_deadline=self.first_deadline,
            least_deadline=self.deadline,
            condemn=self.on_failure != "retry",
        )


@dataclass(frozen=True)
class OldOptions(RunOptions):
    """How a run that is gone on with was made.

    Attributes:
        links: What its file of links said when it began; that is not read again.
    """

    links: tuple[tuple[int, int], ...] = ()

    def shape(self) -> Shape:
        """Return the shape of the network."""
        if self.links:
            return edge_list_shape(Path(self.topology).name, self.links)
        return super().shape()


def read_options(path: Path, document: Mapping[str, object], workers: int | None) -> RunOptions:
    """Return how the run of a ``run.toml`` was made, to go on with it where it can be found again.

    Args:
        path: The file, for messages.
        document: What it says.
        workers: Number of local workers instead of that in the file, or None.

    Raises:
        InvalidFile: The farm it describes cannot be built.
    """
    farm = document.get("farm")
    if not isinstance(farm, dict):
        raise InvalidFile(path, "farm", repr(farm), "the table that tramnet wrote")
    known = {name: value for name, value in farm.items() if name not in ("endpoint", "asked")}
    try:
        options = msgspec.convert(known, OldOptions, strict=True, dec_hook=_path)
    except msgspec.ValidationError as error:
        raise InvalidFile(path, "farm", str(error), "the table that tramnet wrote") from error
    listen = options.listen
    if listen.endswith(":0"):  # those who were connected look for the root where it was
        listen = str(farm.get("endpoint", listen))
    return dataclasses.replace(
        options, listen=listen, workers=options.workers if workers is None else workers
    )


def _path(kind: type, value: object) -> Path:
    """Return what msgspec has no type of its own for."""
    if kind is Path and isinstance(value, str):
        return Path(value)
    raise TypeError(f"found {value!r}, expected a path")
