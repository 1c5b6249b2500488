"""Installed as ``sitecustomize`` by tests: ends one worker of a run by SIGKILL, at a moment that is named.

``TRAMNET_TEST_MOMENT`` names it, ``TRAMNET_TEST_VICTIM`` a file that the first process to reach it makes, so that
there is one victim, and into which it writes when it went.
"""

# ruff: noqa: PLC0415  every interpreter starts with this file, so it imports nothing that it does not need

import os
import signal
import sys
import time

NTH = 4
"""How often the moment passes before it is taken."""


def end(victim: int) -> None:
    try:
        file = os.open(os.environ["TRAMNET_TEST_VICTIM"], os.O_WRONLY | os.O_CREAT | os.O_EXCL)
    except FileExistsError:
        return
    os.write(file, f"{victim} {time.time()}".encode())
    os.kill(victim, signal.SIGKILL)


def before(owner: type, name: str, victim=os.getpid, when=lambda *_: True) -> None:
    """Have the victim end the n-th time that a method is called, before it does anything."""
    real, passed = getattr(owner, name), []

    def method(self, *arguments, **named):
        if when(*arguments):
            passed.append(None)
            if len(passed) == NTH:
                end(victim())
        return real(self, *arguments, **named)

    setattr(owner, name, method)


def a_worker() -> int:
    """A child of this process."""
    for task in os.listdir("/proc/self/task"):
        with open(f"/proc/self/task/{task}/children") as file:
            for pid in file.read().split():
                return int(pid)
    return 0


def in_worker(moment: str) -> None:
    from tramnet_protocol.exchange import Exchange
    from tramnet_protocol.messages import Evolve
    from tramnet_workers.node.evaluator import Evaluator
    from tramnet_workers.node.links import Links
    from tramnet_workers.node.states import WorkerStates

    match moment:
        case "before it takes a chunk":
            before(WorkerStates, "_received")
        case "in mid-evaluation":
            before(Evaluator, "compute")
        case "before it answers":
            before(Links, "send")
        case "while it forwards":
            before(Exchange, "forward")
        case "while it holds a population":
            before(Evaluator, "compute", when=lambda work: is_on_held_populations(work, Evolve))


def is_on_held_populations(work: object, evolve: type) -> bool:
    """Whether work brings no populations along, so that it is on those that this worker holds."""
    return isinstance(work, evolve) and work.populations is None


def in_root(moment: str) -> None:
    from tramnet_master.checkpoints import CheckpointStore

    if moment == "at a checkpoint":
        before(CheckpointStore, "save", victim=a_worker)


if os.environ.get("TRAMNET_TEST_MOMENT"):
    if "tramnet_workers.node" in sys.orig_argv:
        in_worker(os.environ["TRAMNET_TEST_MOMENT"])
    elif "tramnet_master" in sys.orig_argv:
        in_root(os.environ["TRAMNET_TEST_MOMENT"])
