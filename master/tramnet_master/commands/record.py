"""``tramnet record``: every frame with its time into an MCAP file."""

import enum
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import IO, Annotated, TypeAlias

import typer

from tramnet_master.commands.watching import watching
from tramnet_master.console import people
from tramnet_master.errors import OccupiedFile
from tramnet_master.files import writing
from tramnet_master.options import Attach, Network, Tls
from tramnet_master.traffic.echo import full_pattern
from tramnet_master.traffic.intake import Intake
from tramnet_master.traffic.observing import Observation
from tramnet_master.traffic.recorder import Recorder
from tramnet_master.traffic.status import read_status
from tramnet_master.traffic.words import complete, summarised
from tramnet_protocol.messages import PROTOCOL_VERSION

FLUSH = 1.0
"""Time between two writes to the disk: what a kill -9 may cost [s]."""

LOOK_UP = 0.1
"""Longest wait between two looks at whether to end [s]."""


class Arrays(enum.StrEnum):
    """What becomes of arrays in a recording."""

    BASE64 = "base64"
    SUMMARY = "summary"


Out: TypeAlias = Annotated[Path, typer.Argument(metavar="FILE", help="The file, out.mcap for one.")]
Key: TypeAlias = Annotated[
    str, typer.Option(help="Key or pattern to record: 'link/**', 'stats/*', events.")
]
Count: TypeAlias = Annotated[
    int, typer.Option(min=0, help="End after so many frames; 0 goes on for ever.")
]
Timeout: TypeAlias = Annotated[
    float, typer.Option(min=0.0, help="End after so many seconds; 0 goes on for ever.")
]
ArraysOption: TypeAlias = Annotated[
    Arrays,
    typer.Option(
        help="base64 keeps arrays whole, so that a recording holds all that was said; "
        "summary keeps type, shape and range only."
    ),
]
Overwrite: TypeAlias = Annotated[bool, typer.Option("--overwrite", help="Replace a file.")]


def record(
    out: Out,
    connect: Attach = None,
    network: Network = None,
    tls: Tls = None,
    key: Key = "**",
    count: Count = 0,
    timeout: Timeout = 0.0,
    arrays: ArraysOption = Arrays.BASE64,
    overwrite: Overwrite = False,
) -> None:
    """Record every frame with its time into an MCAP file, which Foxglove and the mcap tools open.

    Messages are JSON with schemas. Ends with the network, by Ctrl-C or SIGTERM (the file is complete then, exit
    code 0), or after --count or --timeout. After kill -9 the file lacks its index and at most the last second;
    `mcap recover` and `tramnet traffic` read the rest.
    """
    if out.exists() and not overwrite:
        raise OccupiedFile(out)
    with watching(connect, network, tls) as (observation, said):
        intake = Intake()
        observation.channel.subscribe(full_pattern(observation.live.network, key), intake.put)
        about = _about(said, arrays)
        words = complete if arrays is Arrays.BASE64 else summarised
        with writing(out), _create(out, overwrite) as file:
            recorder = Recorder(file, about, words)
            people.print(f"recording {observation.live.network} into {out}; Ctrl-C ends it")
            try:
                _Recording(observation, intake, recorder).go_on(count, timeout)
            finally:
                recorder.finish()
    people.print(
        f"{recorder.frames:,} frames, {recorder.missed + recorder.dropped:,} missed, "
        f"{out.stat().st_size / 1e6:,.1f} MB in {out}"
    )


@dataclass(frozen=True)
class _Recording:
    observation: Observation
    intake: Intake
    recorder: Recorder

    def go_on(self, count: int, timeout: float) -> None:
        """Record until it is enough, too late or over; what has arrived by then is still recorded."""
        end = time.monotonic() + timeout if timeout else float("inf")
        flush = time.monotonic() + FLUSH
        while not self.observation.over and (now := time.monotonic()) < end:
            if now >= flush:
                self.recorder.flush()
                flush = now + FLUSH
            if self._is_enough(count, min(LOOK_UP, end - now, flush - now)):
                return
        while not self._is_enough(count, 0.0) and not self.intake.empty:
            pass

    def _is_enough(self, count: int, patience: float) -> bool:
        """Record the next arrival; return whether it was the last one wanted."""
        arrival = self.intake.get(patience)
        if arrival is not None:
            self.recorder.record(arrival)
        return bool(count) and self.recorder.frames >= count


def _about(said: dict[str, object], arrays: Arrays) -> Mapping[str, str]:
    status = read_status(said)
    return {
        "network": status.network,
        "title": status.title,
        "run": str(status.run),
        "topology": status.topology,
        "epoch": str(status.epoch),
        "arrays": arrays.value,
        "tramnet": version("tramnet"),
        "protocol": str(PROTOCOL_VERSION),
    }


@contextmanager
def _create(path: Path, overwrite: bool) -> Iterator[IO[bytes]]:
    try:
        file = path.open("wb" if overwrite else "xb")
    except FileExistsError as error:
        raise OccupiedFile(path) from error
    with file:
        yield file
