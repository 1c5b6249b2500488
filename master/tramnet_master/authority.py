"""A small authority of one's own: a key that signs the certificates of the hosts of one network.

Keys are of the curve P-256 and never leave the folder they are made in but by the hand of their user; each is
readable by its user only from the moment it exists.
"""

import datetime
import ipaddress
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from tramnet_master.files import writing
from tramnet_protocol.errors import BadCredentials
from tramnet_protocol.security import CA, CERTIFICATE, KEY, check_name

AUTHORITY_KEY = "ca-key.pem"
HERE = ("localhost", "127.0.0.1")
"""Addresses of a root, for the workers that it starts itself."""

_SLACK = datetime.timedelta(hours=1)  # clocks of hosts differ


class Authority:
    """Signs certificates.

    Attributes:
        certificate: Its own.
    """

    def __init__(self, certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> None:
        self.certificate = certificate
        self._key = key

    @classmethod
    def open(cls, folder: Path, days: int) -> Self:
        """Return the authority of a folder, made where there is none.

        Args:
            folder: Where its certificate and key are.
            days: How long a new one is valid.

        Raises:
            BadCredentials: Only one of the two is there, or one cannot be used.
            CannotWrite: The disk refuses.
        """
        certificate, key = folder / CA, folder / AUTHORITY_KEY
        if certificate.exists() != key.exists():
            raise BadCredentials(folder, f"found one of {CA} and {AUTHORITY_KEY}, expected both")
        if not certificate.exists():
            return cls._make(folder, days)
        try:
            found = serialization.load_pem_private_key(key.read_bytes(), password=None)
            signed = x509.load_pem_x509_certificate(certificate.read_bytes())
        except (OSError, ValueError, TypeError) as error:
            raise BadCredentials(folder, f"cannot use its authority: {error}") from error
        if not isinstance(found, ec.EllipticCurvePrivateKey):
            raise BadCredentials(key, f"found {type(found).__name__}, expected a key of P-256")
        return cls(signed, found)

    @classmethod
    def _make(cls, folder: Path, days: int) -> Self:
        key = ec.generate_private_key(ec.SECP256R1())
        name = _name("tramnet authority")
        certificate = (
            _certificate(name, name, key.public_key(), days)
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(_usage(signs=True), critical=True)
            .sign(key, hashes.SHA256())
        )
        _write_key(folder / AUTHORITY_KEY, key)
        _write(folder / CA, certificate)
        return cls(certificate, key)

    def issue(self, folder: Path, name: str, addresses: Sequence[str], days: int) -> None:
        """Make a folder with the key and certificate of a host.

        Args:
            folder: The folder; it must not exist.
            name: Name of the host, which becomes the common name.
            addresses: Names and IP addresses at which others reach it; a host without any may only go to others.
            days: How long it is valid.

        Raises:
            BadCredentials: The name is none, or the folder exists.
            CannotWrite: The disk refuses.
        """
        check_name(name)
        if folder.exists():
            raise BadCredentials(folder, "found certificates already, expected a new name")
        with writing(folder):
            folder.mkdir(mode=0o700)
        key = ec.generate_private_key(ec.SECP256R1())
        purposes = [ExtendedKeyUsageOID.CLIENT_AUTH]
        purposes += [ExtendedKeyUsageOID.SERVER_AUTH] if addresses else []
        alternatives = [_alternative(address) for address in addresses or [name]]
        certificate = (
            _certificate(_name(name), self.certificate.subject, key.public_key(), days)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_usage(signs=False), critical=True)
            .add_extension(x509.ExtendedKeyUsage(purposes), critical=False)
            .add_extension(x509.SubjectAlternativeName(alternatives), critical=False)
            .sign(self._key, hashes.SHA256())
        )
        _write_key(folder / KEY, key)
        _write(folder / CERTIFICATE, certificate)
        _write(folder / CA, self.certificate)


def _certificate(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePublicKey, days: int
) -> x509.CertificateBuilder:
    now = datetime.datetime.now(datetime.UTC)
    return x509.CertificateBuilder(
        issuer_name=issuer,
        subject_name=subject,
        public_key=key,
        serial_number=x509.random_serial_number(),
        not_valid_before=now - _SLACK,
        not_valid_after=now + datetime.timedelta(days=days),
    )


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _alternative(address: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(address))
    except ValueError:
        return x509.DNSName(address)


def _usage(signs: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs,
        key_cert_sign=signs,
        crl_sign=signs,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _write_key(path: Path, key: ec.EllipticCurvePrivateKey) -> None:
    pem = key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    with writing(path):
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "wb") as file:
            file.write(pem)


def _write(path: Path, certificate: x509.Certificate) -> None:
    with writing(path):
        path.write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
