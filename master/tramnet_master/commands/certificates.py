"""The command that makes certificates for the hosts of a network."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from tramnet_master.console import programs
from tramnet_master.files import write_atomically, writing
from tramnet_protocol.errors import BadCredentials
from tramnet_protocol.limits import MAX_SEATS
from tramnet_protocol.security import SEATS, check_name, read_seats

ROOT = "root"

Folder = Annotated[
    Path, typer.Argument(metavar="FOLDER", help="Where the authority is, or shall be.")
]
Names = Annotated[list[str] | None, typer.Argument(metavar="NAME...", help="Hosts of workers.")]
Address = Annotated[
    list[str] | None,
    typer.Option(help="Name or IP address at which workers reach the root; may be repeated."),
]
SeatsEach = Annotated[int, typer.Option(min=1, max=1000, help="Seats of each host.")]
Days = Annotated[int, typer.Option(min=1, max=3650, help="How long the certificates are valid.")]


def certificates(
    folder: Folder,
    names: Names = None,
    address: Address = None,
    seats: SeatsEach = 64,
    days: Days = 365,
) -> None:
    """Make a small authority, a certificate for the root and one for each host of workers.

    The root's is made the first time, in FOLDER/root; run again with other names to add hosts.
    """
    from tramnet_master.authority import HERE, Authority  # noqa: PLC0415  slow to import

    hosts = [check_name(name) for name in names or []]
    with writing(folder):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    authority = Authority.open(folder, days)
    root = folder / ROOT
    if not root.exists():
        authority.issue(root, ROOT, [*HERE, *(address or [])], days)
        _write_seats(root / SEATS, {ROOT: range(1, seats + 1)})
    for host in hosts:
        authority.issue(folder / host, host, [], days)
        own = _add_seats(root / SEATS, host, seats)
        programs.print(f"{folder / host}: seats {own.start} to {own.stop - 1}")
    programs.print(f"root:    tramnet run ... --tls {root} --listen tls/0.0.0.0:7447")
    programs.print("workers: tramnet worker --connect tls/ADDRESS:7447 --tls THEIR-FOLDER")


def _add_seats(path: Path, name: str, count: int) -> range:
    """Give a name the seats after all others, and return them."""
    taken = read_seats(path, tomllib.loads(path.read_text()))
    first = max(seats.stop for seats in taken.values())
    if first + count > MAX_SEATS:
        raise BadCredentials(path, f"found {MAX_SEATS - first} seats left, expected {count}")
    added = range(first, first + count)
    _write_seats(path, {**taken, name: added})
    return added


def _write_seats(path: Path, seats: Mapping[str, range]) -> None:
    lines = [f'"{name}" = [{own.start}, {own.stop - 1}]' for name, own in seats.items()]
    text = "\n".join(["# Who may join, and on which seats: first and last.", "[seats]", *lines, ""])
    write_atomically(path, text.encode())
