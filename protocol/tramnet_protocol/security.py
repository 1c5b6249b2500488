"""Who a node is and who may join: its folder of certificates, and the root's list of names and seats.

A folder holds three files, made by ``tramnet certificates`` or by openssl, and the root's a fourth:

    ca.pem           certificate of the authority that signed all others
    certificate.pem  this host's own; its common name is the host's name
    key.pem          its private key, readable by its user only
    seats.toml       (the root's) ``[seats]``: for each name that may join, the first and last seat it may take

Keys stay in their file: the transport is told where that is, and nobody else reads it.
"""

import itertools
import re
import stat
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from tramnet_protocol.errors import BadCredentials
from tramnet_protocol.limits import MAX_SEATS

CA, CERTIFICATE, KEY, SEATS = "ca.pem", "certificate.pem", "key.pem", "seats.toml"

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,62}")


@dataclass(frozen=True)
class Credentials:
    """What shows who a node is.

    Attributes:
        name: Common name of its certificate.
        folder: Where the files are.
    """

    name: str
    folder: Path

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Look at a folder of certificates.

        Raises:
            BadCredentials: A file is missing or cannot be used, or others may read the key.
        """
        for file in (CA, CERTIFICATE, KEY):
            if not (folder / file).is_file():
                raise BadCredentials(
                    folder, f"found no {file}, expected {CA}, {CERTIFICATE} and {KEY}"
                )
        mode = stat.S_IMODE((folder / KEY).stat().st_mode)
        if mode & 0o077:
            raise BadCredentials(
                folder / KEY, f"found mode {mode:04o}, expected 0600: others may read the key"
            )
        return cls(_common_name(folder / CERTIFICATE), folder.absolute())

    @property
    def ca(self) -> str:
        """Path of the authority's certificate."""
        return str(self.folder / CA)

    @property
    def certificate(self) -> str:
        """Path of the certificate."""
        return str(self.folder / CERTIFICATE)

    @property
    def key(self) -> str:
        """Path of the private key."""
        return str(self.folder / KEY)

    def seats(self) -> dict[str, range]:
        """Return the seats that each name may take.

        Raises:
            BadCredentials: ``seats.toml`` is missing, or says something else.
        """
        path = self.folder / SEATS
        try:
            document = tomllib.loads(path.read_text())
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise BadCredentials(path, f"{error}; expected a table [seats]") from error
        return read_seats(path, document)


def check_name(name: str) -> str:
    """Return the name of a host if it is one.

    Raises:
        BadCredentials: It is not.
    """
    if not _NAME.fullmatch(name):
        raise BadCredentials(
            Path(),
            f"found the name {name[:80]!r}, expected 1 to 63 letters, digits, '.', '_' and '-', "
            "the first a letter or digit",
        )
    return name


def read_seats(path: Path, document: Mapping[str, object]) -> dict[str, range]:
    """Return the seats in a document as ``seats.toml`` holds it.

    Args:
        path: The file, for messages.
        document: ``{"seats": {name: [first, last], ...}}``.

    Raises:
        BadCredentials: It is no such document, or a seat belongs to two names.
    """
    table = document.get("seats")
    if set(document) != {"seats"} or not isinstance(table, dict):
        raise BadCredentials(path, f"found {sorted(document)}, expected one table [seats]")
    seats: dict[str, range] = {}
    for name, bounds in table.items():
        match bounds:
            case [int(first), int(last)] if 0 < first <= last < MAX_SEATS:
                seats[check_name(name)] = range(first, last + 1)
            case _:
                raise BadCredentials(
                    path,
                    f"{name}: found {bounds!r}, expected [first, last] within 1 to {MAX_SEATS - 1}",
                )
    _check_apart(path, seats)
    return seats


def _check_apart(path: Path, seats: Mapping[str, range]) -> None:
    in_order = sorted(seats.items(), key=lambda item: item[1].start)
    for (one, before), (other, after) in itertools.pairwise(in_order):
        if after.start < before.stop:
            raise BadCredentials(path, f"seat {after.start} belongs to both {one} and {other}")


def _common_name(path: Path) -> str:
    from cryptography import x509  # noqa: PLC0415  slow to import, and only needed here

    try:
        certificate = x509.load_pem_x509_certificate(path.read_bytes())
    except ValueError as error:
        raise BadCredentials(path, f"{error}; expected a certificate in PEM") from error
    names = certificate.subject.get_attributes_for_oid(x509.NameOID.COMMON_NAME)
    if len(names) != 1:
        raise BadCredentials(path, f"found {len(names)} common names, expected one")
    return check_name(str(names[0].value))
