"""Commands that join, steer or question a running network."""

import functools
import signal
import threading
from collections.abc import Callable
from typing import Annotated

import typer

from tramnet_master.console import people, programs
from tramnet_master.control import ask, locate
from tramnet_master.errors import RunFailed
from tramnet_master.keeping import keeping
from tramnet_master.options import Attach, Connect, Network, Tls, WorkerMemory
from tramnet_protocol.codec import decode
from tramnet_protocol.errors import CannotConnect, MalformedFrame
from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import ControlRequest, Event
from tramnet_protocol.security import Credentials
from tramnet_protocol.transport import ZenohChannel, open_worker
from tramnet_workers.node.supervisor import GAVE_UP, Ended, Supervisor, new_name

PERIOD = 0.2
"""Time between two looks at the workers [s]."""

Count = Annotated[
    int, typer.Option(min=1, max=4094, envvar="TRAMNET_COUNT", help="Worker processes to keep.")
]
Patience = Annotated[
    float,
    typer.Option(
        min=0.0,
        envvar="TRAMNET_PATIENCE",
        help="Seconds to look for a root, at first and after one is gone.",
    ),
]


def worker(
    connect: Connect = None,
    network: Network = None,
    count: Count = 1,
    patience: Patience = 600.0,
    worker_memory: WorkerMemory = 0,
    tls: Tls = None,
) -> None:
    """Join worker processes to a network, before or during a run; Ctrl-C ends them."""
    live = locate(connect, network)
    credentials = Credentials.load(tls) if tls else None
    name = new_name()
    arguments = ["--connect", live.endpoint, "--network", live.network]
    arguments += ["--supervisor", name, "--patience", str(patience)]
    arguments += ["--memory", str(worker_memory)]
    if tls:
        arguments += ["--tls", str(tls)]
    stopped = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: stopped.set())
    gave_up: list[Ended] = []

    def notice(ended: Ended) -> None:
        if ended.status == GAVE_UP:
            gave_up.append(ended)
        if ended.died:
            people.print(f"worker {ended.pid} died with status {ended.status}: starting another")

    people.print(f"{count} worker(s) for network {live.network} at {live.endpoint}")
    with (
        keeping(count) as folder,
        Supervisor([*arguments, "--pulse", str(folder)], count, notice) as supervisor,
    ):
        connect_again = functools.partial(open_worker, live.endpoint, credentials)
        _watch(connect_again, Keys(live.network), name, supervisor, stopped)
    if gave_up:
        raise RunFailed(f"{len(gave_up)} worker(s) gave up; they say above why")


def scale(
    workers: Annotated[int, typer.Argument(min=0, max=4094, help="Local workers to keep.")],
    connect: Attach = None,
    network: Network = None,
    tls: Tls = None,
) -> None:
    """Grow or shrink the local workers of a running network."""
    reply = ask(locate(connect, network), ControlRequest("scale", workers), tls)
    programs.print(reply.text)


def stop(connect: Attach = None, network: Network = None, tls: Tls = None) -> None:
    """Stop a running network after it has written a checkpoint."""
    reply = ask(locate(connect, network), ControlRequest("stop"), tls)
    programs.print(reply.text)


def _watch(
    connect: Callable[[], ZenohChannel],
    keys: Keys,
    name: str,
    supervisor: Supervisor,
    stopped: threading.Event,
) -> None:
    """Replace processes whenever the root asks for it, until all have ended or we are told to."""

    def take(_: str, payload: bytes) -> None:
        try:
            event = decode(payload).message()
        except MalformedFrame:
            return
        if isinstance(event, Event) and event.name == "replace":
            pid = event.detail.get("pid")
            if event.detail.get("supervisor") == name and isinstance(pid, int):
                supervisor.replace(pid)  # only leaves a wish, so it may be called from here

    channel: ZenohChannel | None = None
    try:
        while not stopped.is_set() and not supervisor.finished.is_set():
            if channel is None:
                try:
                    channel = connect()
                    channel.subscribe(keys.events, take)
                except CannotConnect:
                    pass  # the root is not there yet
            stopped.wait(PERIOD)
    finally:
        if channel is not None:
            channel.close()
