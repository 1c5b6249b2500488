"""The worker process: ``python -m tramnet_workers.node``, started by a supervisor."""

import argparse
import functools
import logging
import os
import signal
import sys
from pathlib import Path

from tramnet_protocol.security import Credentials
from tramnet_protocol.transport import open_worker
from tramnet_workers.node.lifeline import hold_on_to_parent
from tramnet_workers.node.memory import be_first_to_go
from tramnet_workers.node.pulse import Pulse
from tramnet_workers.node.service import Home, Service
from tramnet_workers.node.supervisor import CRASHED

SWITCH_INTERVAL = 0.0005
"""Longest time a thread keeps the interpreter that another one waits for [s]: routing goes before computing."""


def main() -> int:
    """Run one worker; return its exit status, of which the supervisor knows the meaning."""
    parser = argparse.ArgumentParser(prog="python -m tramnet_workers.node", description=__doc__)
    parser.add_argument("--connect", required=True, help="endpoint of the root")
    parser.add_argument("--network", required=True, help="name of the network")
    parser.add_argument("--supervisor", required=True, help="name of whoever started this")
    parser.add_argument("--patience", type=float, default=10.0, help="seconds to look for a root")
    parser.add_argument("--memory", type=int, default=0, help="memory it may have [MiB], 0 for any")
    parser.add_argument("--tls", type=Path, help="folder with its certificate and key")
    parser.add_argument("--pulse", type=Path, help="folder for signs of life, see pulse.py")
    arguments = parser.parse_args()
    logging.basicConfig(
        level=os.environ.get("TRAMNET_LOG", "WARNING").upper(),
        format=f"worker {os.getpid()}: %(message)s",
    )
    # Ctrl-C is the root's affair: it tells its workers to end, or goes and takes them along.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.setswitchinterval(SWITCH_INTERVAL)
    hold_on_to_parent(lambda: os._exit(0))
    be_first_to_go(arguments.memory)
    credentials = Credentials.load(arguments.tls) if arguments.tls else None
    connect = functools.partial(open_worker, arguments.connect, credentials)
    name = credentials.name if credentials else None
    service = Service(
        Home(
            arguments.network,
            arguments.supervisor,
            arguments.patience,
            connect,
            name,
            Pulse(arguments.pulse),
        )
    )
    signal.signal(signal.SIGTERM, lambda *_: service.stop("terminated"))
    try:
        return service.run()
    except BaseException:  # out of memory, or an evaluation that ends its interpreter
        # At once: an interpreter that ends by itself waits for an open session for ever.
        logging.exception("the worker has failed")
        os._exit(CRASHED)


if __name__ == "__main__":
    sys.exit(main())
