"""Real runs in processes of their own, each in a runtime folder of its own; nothing of them outlives its test."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from tramnet_master import networks
from tramnet_master.control import ask
from tramnet_master.errors import NoNetwork
from tramnet_protocol.errors import ProtocolError
from tramnet_protocol.messages import ControlRequest

PATIENCE = float(os.environ.get("TRAMNET_TEST_PATIENCE", "120"))
"""Longest wait for a condition, on a machine that does much else [s]."""


def wait_until(condition: Callable[[], object], what: str) -> None:
    """Wait for a condition, and fail with its name."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, f"waited {PATIENCE:g} s for {what}"
        time.sleep(0.01)


class Run:
    """A ``tramnet`` command in a process of its own."""

    def __init__(
        self,
        folder: Path,
        arguments: list[str],
        within: Sequence[str] = (),
        terminal: int | None = None,
    ) -> None:
        self.folder = folder
        outputs = subprocess.PIPE if terminal is None else terminal
        self.process = subprocess.Popen(
            [*within, sys.executable, "-m", "tramnet_master", *arguments],
            stdin=terminal,
            stdout=outputs,
            stderr=outputs,
            text=True,
        )
        self.output = ""
        self.seen: set[int] = set()  # every worker process it told of

    @property
    def pid(self) -> int:
        return self.process.pid

    def status(self) -> dict[str, object]:
        """What the root says of itself, or nothing where it does not answer."""
        try:
            return ask(networks.find(), ControlRequest("status")).status
        except (NoNetwork, ProtocolError):
            return {}

    def workers(self) -> list[int]:
        """Process ids of the live workers."""
        members = self.status().get("workers", [])
        pids = [member["pid"] for member in members if member["live"]]
        self.seen.update(pids)
        return pids

    def wait_for_workers(self, count: int) -> list[int]:
        found: list[int] = []

        def enough() -> bool:
            assert not self.ended, f"the run ended with {len(found)} workers: {self.finish()}"
            found[:] = self.workers()
            return len(found) >= count

        wait_until(enough, f"{count} workers")
        return found

    def events(self) -> list[dict[str, object]]:
        """What its log says so far."""
        lines = (self.folder / "log.jsonl").read_text().splitlines()
        return [json.loads(line) for line in lines]

    def wait_for_generation(self, number: int) -> None:
        wait_until(
            lambda: self.status().get("generation", -1) >= number or self.ended,
            f"generation {number}",
        )

    @property
    def ended(self) -> bool:
        return self.process.poll() is not None

    def finish(self) -> int:
        """Wait for the end; return the exit code."""
        out, err = self.process.communicate(timeout=PATIENCE)
        self.output = (out or "") + (err or "")
        return self.process.returncode

    def result(self) -> dict[str, object]:
        code = self.finish()
        assert code == 0, self.output
        return json.loads((self.folder / "result.json").read_text())


@pytest.fixture
def start(tmp_path) -> Iterator[Callable[..., Run]]:
    """Starts ``tramnet`` commands; ends them, and checks that nothing of them is left."""
    with starting(tmp_path) as begin:
        yield begin


@contextmanager
def starting(folder: Path) -> Iterator[Callable[..., Run]]:
    """Start commands in a runtime folder of their own, and end them with the block."""
    (folder / "runtime").mkdir(mode=0o700)
    runs: list[Run] = []
    pids: list[int] = []

    def begin(
        *arguments: object,
        out: str = "run",
        within: Sequence[str] = (),
        terminal: int | None = None,
    ) -> Run:
        words = [str(word) for word in arguments]
        if words[0] == "run":
            words += ["--out", str(folder / out), "--no-pictures"]
            words += ["--progress", "quiet" if terminal is None else "auto"]
        runs.append(Run(folder / out, words, within, terminal))
        pids.append(runs[-1].pid)
        return runs[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(folder / "runtime"))
        yield begin
        for run in runs:
            pids += [*descendants(run.pid), *run.seen]
        for run in runs:
            if not run.ended:
                run.process.send_signal(signal.SIGCONT)
                run.process.kill()
        try:
            wait_until(lambda: not any(map(is_alive, pids)), "the end of all processes")
        finally:
            for pid in filter(is_alive, pids):
                end(pid)
            for run in runs:
                run.process.communicate()


def descendants(pid: int) -> list[int]:
    """Process ids of the children of a process, and of their children."""
    found: list[int] = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            children = [int(word) for word in task.read_text().split()]
        except (FileNotFoundError, ProcessLookupError):
            continue
        found += [*children, *(grand for child in children for grand in descendants(child))]
    return found


def is_alive(pid: int) -> bool:
    """Whether a process exists and is no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def end(pid: int, number: signal.Signals = signal.SIGKILL) -> None:
    os.kill(pid, number)
