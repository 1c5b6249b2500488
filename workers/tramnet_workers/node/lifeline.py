"""Two ties of a worker process to whoever started it, so that it never outlives that process.

End-of-file on the inherited pipe ends a healthy interpreter; the kernel's parent-death signal ends one whose
interpreter hangs. Either alone has a gap: a hung interpreter reads no pipe, and the signal is Linux's own.
"""

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable

_PR_SET_PDEATHSIG = 1


def hold_on_to_parent(end: Callable[[], None]) -> None:
    """Call ``end`` when the standard input ends, and die with the parent at the latest.

    Args:
        end: Called on a thread of its own.
    """
    parent = os.getppid()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it died before the tie was made
        os._exit(0)
    threading.Thread(target=_watch, args=(end,), name="lifeline", daemon=True).start()


def _watch(end: Callable[[], None]) -> None:
    while os.read(0, 4096):
        pass
    end()
