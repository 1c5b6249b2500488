"""Services of ``docker-compose.yml`` without an engine: processes on machines made of namespaces.

A machine has its own network, host name, process ids and mounts, and an address on an Ethernet that nothing else is
attached to. A service runs there by its very command, in the environment that the compose file gives it. What an
image would bring (Python, the package, a home) is this machine's own; the working directory stands for the volume.
"""

import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import yaml
from processes import PATIENCE, descendants, is_alive, wait_until

REPOSITORY = Path(__file__).parents[2]
SERVICES: Mapping[str, dict] = yaml.safe_load((REPOSITORY / "docker-compose.yml").read_text())[
    "services"
]

_INHERITED = ("HOME", "LANG", "PATH", "PYTHONPATH", "XDG_CACHE_HOME")
_NEW = ("unshare", "--uts", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc")
# $1 its name, $2 who else has one; then the command, as the first process of the machine.
_BOOT = (
    'echo "$1" >/proc/sys/kernel/hostname && mount --bind "$2" /etc/hosts && shift 2 && exec "$@"'
)


def health_check(service: str) -> list[str]:
    """Return the command by which the image of a service tells its health."""
    text = (REPOSITORY / SERVICES[service]["build"]["dockerfile"]).read_text()
    (line,) = [line for line in text.splitlines() if line.startswith("HEALTHCHECK ")]
    return yaml.safe_load(line.partition(" CMD ")[2])


def environment(service: str, shell: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that Compose gives a service; what has no value is taken from the shell."""
    given = SERVICES[service].get("environment", {})
    values = {
        name: shell.get(name) if value is None else str(value) for name, value in given.items()
    }
    return {name: value for name, value in values.items() if value is not None}


class Container:
    """A service that runs on a machine.

    Attributes:
        process: What holds the machine's process ids together, and ends with the service's exit code.
    """

    def __init__(
        self, name: str, process: subprocess.Popen, variables: dict[str, str], log: Path
    ) -> None:
        self.name = name
        self.process = process
        self._variables = variables
        self._log = log

    @property
    def output(self) -> str:
        return self._log.read_text()

    @property
    def ended(self) -> bool:
        return self.process.poll() is not None

    @property
    def first(self) -> int:
        """Process id of the service itself."""
        found: list[int] = []

        def booted() -> bool:
            assert not self.ended, f"{self.name} has ended: {self.output}"
            found[:] = descendants(self.process.pid)[:1]
            return bool(found) and b"unshare" not in Path(f"/proc/{found[0]}/cmdline").read_bytes()

        wait_until(booted, f"the start of {self.name}")
        return found[0]

    def signal(self, number: signal.Signals) -> None:
        os.kill(self.first, number)

    def execute(self, command: Sequence[str]) -> subprocess.CompletedProcess:
        """Run another command inside, as ``docker exec`` and health checks do."""
        inside = ["nsenter", "--target", str(self.first), "--net", "--uts", "--mount", "--pid"]
        return subprocess.run(
            [*inside, *_as_installed(command)],
            env=self._variables,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )

    def finish(self) -> int:
        return self.process.wait(timeout=PATIENCE)


class Machines:
    """Machines on one Ethernet, gone at the end of the block with all that runs on them.

    Args:
        folder: Where logs and runtime folders go; the working directory of all that runs.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.namespaces: list[str] = []
        self._prefix = f"tramnet-{os.getpid()}"
        self._hosts = folder / "hosts"
        self._switch = f"{self._prefix}-switch"
        self._addresses: dict[str, str] = {}
        self._containers: list[Container] = []

    def open(self) -> None:
        """Lay the Ethernet.

        Raises:
            OSError: There are no tools to make it with.
            subprocess.CalledProcessError: The system does not allow it.
        """
        try:
            self._add_namespace(self._switch)
            _ip("-n", self._switch, "link", "add", "bridge", "type", "bridge")
            _ip("-n", self._switch, "link", "set", "bridge", "up")
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def add(self, name: str) -> None:
        """Add a machine; all that are started later know its name."""
        namespace = self._namespace(name)
        port = f"port{len(self._addresses)}"
        self._addresses[name] = f"10.77.0.{len(self._addresses) + 1}"
        self._add_namespace(namespace)
        _ip(
            "link",
            "add",
            port,
            "netns",
            self._switch,
            "type",
            "veth",
            "peer",
            "name",
            "eth0",
            "netns",
            namespace,
        )
        _ip("-n", self._switch, "link", "set", port, "master", "bridge", "up")
        _ip("-n", namespace, "address", "add", f"{self._addresses[name]}/24", "dev", "eth0")
        for interface in ("eth0", "lo"):
            _ip("-n", namespace, "link", "set", interface, "up")
        known = [f"{address} {name}" for name, address in self._addresses.items()]
        self._hosts.write_text("\n".join(["127.0.0.1 localhost", *known, ""]))

    def start(
        self,
        service: str,
        name: str,
        shell: Mapping[str, str],
        command: Sequence[str] | None = None,
    ) -> Container:
        """Start a service on a machine, by another command than its own if one is given."""
        runtime = self.folder / f"{name}-runtime"
        runtime.mkdir(mode=0o700, exist_ok=True)
        variables = {n: os.environ[n] for n in _INHERITED if n in os.environ}
        variables |= {
            "PYTHONUNBUFFERED": "1",
            "XDG_RUNTIME_DIR": str(runtime),
            **environment(service, shell),
        }
        words = ["tramnet", *(command or SERVICES[service]["command"])]
        log = self.folder / f"{name}-{len(self._containers)}.log"
        with log.open("w") as output:
            process = subprocess.Popen(
                ["ip", "netns", "exec", self._namespace(name), *_NEW, "--", "sh", "-c", _BOOT, "sh", name,
                 str(self._hosts), *_as_installed(words)],
                cwd=self.folder,
                env=variables,
                stdout=output,
                stderr=subprocess.STDOUT,
            )  # fmt: skip
        self._containers.append(Container(name, process, variables, log))
        return self._containers[-1]

    def slow_down(self, name: str, rate: str) -> None:
        """Let no more out of a machine than so much."""
        limit = f"qdisc add dev eth0 root tbf rate {rate} burst 16kb latency 400ms"
        _run("tc", "-n", self._namespace(name), *shlex.split(limit))

    def let_go(self, name: str) -> None:
        """Lift that limit."""
        _run("tc", "-n", self._namespace(name), "qdisc", "del", "dev", "eth0", "root")

    def _namespace(self, name: str) -> str:
        return f"{self._prefix}-{name}"

    def _add_namespace(self, name: str) -> None:
        _ip("netns", "add", name)
        self.namespaces.append(name)

    def close(self) -> None:
        """End all that runs there, and take everything down."""
        pids = [
            pid
            for one in self._containers
            for pid in (one.process.pid, *descendants(one.process.pid))
        ]
        for container in self._containers:
            container.process.kill()  # and the kernel all those inside
            container.process.wait()
        wait_until(lambda: not any(map(is_alive, pids)), "the end of all processes")
        for namespace in self.namespaces:
            _ip("netns", "delete", namespace)


def namespaces() -> set[str]:
    """Return the names of all network namespaces."""
    return {line.split()[0] for line in _ip("netns", "list").splitlines()}


def _as_installed(command: Sequence[str]) -> list[str]:
    program, *words = command
    assert program == "tramnet"
    return [sys.executable, "-m", "tramnet_master", *words]


def _ip(*words: str) -> str:
    return _run("ip", *words)


def _run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout
