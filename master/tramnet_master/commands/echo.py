"""``tramnet echo``: frames as they pass, decoded."""

import time
from dataclasses import dataclass
from typing import Annotated, TypeAlias

import typer

from tramnet_master.commands.watching import watching
from tramnet_master.console import people, write
from tramnet_master.errors import InvalidOption, NothingHeard
from tramnet_master.options import Attach, Network, Tls
from tramnet_master.traffic.echo import Echo, Wanted, full_pattern
from tramnet_master.traffic.intake import Intake
from tramnet_master.traffic.observing import Observation
from tramnet_master.traffic.status import read_status
from tramnet_master.traffic.words import json_line, shortened
from tramnet_protocol.codec import MESSAGES

LOOK_UP = 0.1
"""Longest wait between two looks at whether to end [s]."""

Key: TypeAlias = Annotated[
    str,
    typer.Argument(
        help="Key or pattern: link/0/1, 'link/**', 'stats/*', events; everything if omitted."
    ),
]
Count: TypeAlias = Annotated[
    int, typer.Option(min=0, help="End after so many frames; 0 goes on for ever.")
]
Timeout: TypeAlias = Annotated[
    float, typer.Option(min=0.0, help="End after so many seconds; 0 goes on for ever.")
]
Tags: TypeAlias = Annotated[
    list[str] | None,
    typer.Option("--tag", help="Only messages of this kind, evaluate for one; may be repeated."),
]
Trams: TypeAlias = Annotated[
    list[int] | None,
    typer.Option(
        "--tram", min=0, max=4094, help="Only frames of or for this TRAM; may be repeated."
    ),
]
Elements: TypeAlias = Annotated[
    int, typer.Option(min=0, help="Elements of an array to show; the rest is cut off.")
]


def echo(
    key: Key = "**",
    connect: Attach = None,
    network: Network = None,
    tls: Tls = None,
    tag: Tags = None,
    tram: Trams = None,
    count: Count = 0,
    timeout: Timeout = 0.0,
    elements: Elements = 6,
) -> None:
    """Print frames as they pass, decoded, one JSON object a line.

    Bytes that are no frame, and frames of another run, are shown as such. Ends with the network, by Ctrl-C, or
    after --count or --timeout; with exit code 1 if fewer frames came than were asked for.
    """
    began = time.monotonic()
    wanted = Wanted(frozenset(_known_tags(tag or [])), frozenset(tram or []))
    with watching(connect, network, tls) as (observation, said):
        intake = Intake()
        observation.channel.subscribe(full_pattern(observation.live.network, key), intake.put)
        echoes = Echo(wanted, read_status(said).run, shortened(elements))
        shown = _Printer(observation, intake, echoes).print_until(count, timeout)
    missed = echoes.missed + intake.dropped
    if missed:
        people.print(f"{missed} frames passed unseen: an observer never holds the network up")
    least = count or (1 if timeout else 0)
    if shown < least and not observation.stopped.is_set():
        raise NothingHeard(key, shown, least, time.monotonic() - began)


@dataclass(frozen=True)
class _Printer:
    observation: Observation
    intake: Intake
    echoes: Echo

    def print_until(self, count: int, timeout: float) -> int:
        """Print what arrives until it is enough, too late or over; return how much it was."""
        end = time.monotonic() + timeout if timeout else float("inf")
        shown = 0
        while not self.observation.over and time.monotonic() < end:
            if count and shown >= count:
                break
            shown += self._print_next(min(LOOK_UP, end - time.monotonic()))
        return shown

    def _print_next(self, patience: float) -> bool:
        arrival = self.intake.get(patience)
        if arrival is None:
            return False
        values = self.echoes.describe(arrival.key, arrival.payload)
        if values is None:
            return False
        write(json_line({"time_s": arrival.time / 1e9, **values}) + "\n")
        return True


def _known_tags(tags: list[str]) -> list[str]:
    for tag in tags:
        if tag not in MESSAGES:
            raise InvalidOption("--tag", repr(tag), f"one of {', '.join(MESSAGES)}")
    return tags
