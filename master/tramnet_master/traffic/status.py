"""What a root says of itself, checked where it arrives."""

import msgspec
from msgspec import Struct

from tramnet_master.errors import RunFailed


class WorkerStatus(Struct, frozen=True):
    """A worker with a seat.

    Attributes:
        seat: Its seat.
        incarnation: Its incarnation.
        live: Whether it can take work.
        host: Its host.
        pid: Its process.
    """

    seat: int
    incarnation: int
    live: bool
    host: str = ""
    pid: int = 0


class Status(Struct, frozen=True):
    """A root's answer to ``status``; what it says beside this is not looked at here.

    Attributes:
        network: Name of the network.
        title: What runs.
        observers: Endpoints of the root for observers, as its own machine reaches them.
        run: Number of the run, or None.
        topology: Shape of the network.
        epoch: Number of its wiring.
        uptime: Since the root started [s].
        generation: Generations done.
        generations: Generations to do.
        evaluations: Individuals evaluated.
        best: Best objective so far, or None before the first.
        lost: Workers lost.
        refused: Workers turned away.
        malformed: Payloads that were no frames.
        foreign: Frames of other runs, TRAMs or incarnations.
        over_credit: Messages beyond the credit of their source.
        dropped: Answers dropped, by reason.
        workers: Workers with a seat.
    """

    network: str = ""
    title: str = ""
    observers: tuple[str, ...] = ()
    run: int | None = None
    topology: str = ""
    epoch: int = 0
    uptime: float = 0.0
    generation: int = 0
    generations: int = 0
    evaluations: int = 0
    best: float | None = None
    lost: int = 0
    refused: int = 0
    malformed: int = 0
    foreign: int = 0
    over_credit: int = 0
    dropped: dict[str, int] = {}
    workers: tuple[WorkerStatus, ...] = ()


def read_status(values: dict[str, object]) -> Status:
    """Check what a root said of itself.

    Raises:
        RunFailed: It is no status.
    """
    try:
        return msgspec.convert(values, Status, strict=False)
    except msgspec.ValidationError as error:
        raise RunFailed(
            f"the root's status cannot be understood: {error}; is it of another version of tramnet?"
        ) from error
