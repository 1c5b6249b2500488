"""Hosts of a network of their own, each with a cable that can be cut: network namespaces joined by a bridge."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

ROOT_ADDRESS = "10.77.0.1"


class Hosts:
    """A host for the root, and others on cables of their own.

    Attributes:
        others: What runs a command on each of these.
    """

    def __init__(self) -> None:
        self.others: list[tuple[str, ...]] = []
        self._processes: list[subprocess.Popen[bytes]] = []
        self._cables: list[str] = []
        self._here = self._hold("unshare", "--user", "--map-root-user", "--net")
        self._do("ip", "link", "set", "lo", "up")
        self._do("ip", "link", "add", "br0", "type", "bridge")
        self._do("ip", "addr", "add", f"{ROOT_ADDRESS}/24", "dev", "br0")
        self._do("ip", "link", "set", "br0", "up")

    @property
    def root(self) -> tuple[str, ...]:
        """What runs a command on the root's host."""
        return _enter(self._here)

    def add(self) -> None:
        """Add a host."""
        host = self._hold(*self.root, "unshare", "--net")
        number = len(self._cables) + 2
        cable = f"cable{number}"
        self._do(
            "ip",
            "link",
            "add",
            cable,
            "type",
            "veth",
            "peer",
            "name",
            "eth0",
            "netns",
            str(host.pid),
        )
        self._do("ip", "link", "set", cable, "master", "br0", "up")
        inside = _enter(host)
        for words in (
            ("link", "set", "lo", "up"),
            ("addr", "add", f"10.77.0.{number}/24", "dev", "eth0"),
            ("link", "set", "eth0", "up"),
        ):
            subprocess.run([*inside, "ip", *words], check=True, capture_output=True)
        self._cables.append(cable)
        self.others.append(inside)

    def cut(self, *hosts: int) -> None:
        """Let nothing pass the cables of some hosts, numbered from 0."""
        for host in hosts:
            self._do("ip", "link", "set", self._cables[host], "down")

    def heal(self, *hosts: int) -> None:
        """End a cut."""
        for host in hosts:
            self._do("ip", "link", "set", self._cables[host], "up")

    def close(self) -> None:
        """End the namespaces."""
        for process in reversed(self._processes):
            process.kill()
            process.communicate()

    def _hold(self, *command: str) -> subprocess.Popen[bytes]:
        """Keep a namespace by a process in it that does nothing."""
        held = subprocess.Popen(
            [*command, "sh", "-c", "echo; exec sleep 1000"],
            stdout=subprocess.PIPE,
            stdin=subprocess.DEVNULL,
        )
        self._processes.append(held)
        assert held.stdout is not None
        if held.stdout.readline() != b"\n":
            raise PermissionError("no namespaces here")
        return held

    def _do(self, *command: str) -> None:
        subprocess.run([*self.root, *command], check=True, capture_output=True)


def _enter(host: subprocess.Popen[bytes]) -> tuple[str, ...]:
    return ("nsenter", "--target", str(host.pid), "--user", "--net", "--preserve-credentials")


@contextmanager
def hosts(count: int) -> Iterator[Hosts]:
    """Make a root's host and some others, or skip the test where that is not allowed."""
    if missing := [tool for tool in ("unshare", "nsenter", "ip") if shutil.which(tool) is None]:
        pytest.skip(f"network namespaces need {', '.join(missing)}")
    made = None
    try:
        made = Hosts()
        for _ in range(count):
            made.add()
    except (PermissionError, subprocess.CalledProcessError) as error:
        if made is not None:
            made.close()
        pytest.skip(f"network namespaces are not allowed here: {error}")
    try:
        yield made
    finally:
        made.close()
