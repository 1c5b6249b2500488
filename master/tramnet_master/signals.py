"""What ends a run from outside: Ctrl-C, SIGTERM and a terminal that is closed.

While a run starts or ends, any of them raises ``KeyboardInterrupt`` where it is. While it computes, the first one
asks it to stop in order, and a second one raises. A SIGHUP that is ignored stays so: that is what ``nohup`` is for.
"""

import os
import signal
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_NUMBERS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_OUTPUTS = (1, 2)


@contextmanager
def interrupting() -> Iterator[None]:
    """Have every such signal raise ``KeyboardInterrupt``."""
    with _handled(_raise):
        yield


@contextmanager
def ending(end: Callable[[], None]) -> Iterator[None]:
    """Have the first such signal call ``end``, and raise ``KeyboardInterrupt`` at the second.

    Args:
        end: Called on the main thread, between any two of its instructions.
    """

    def first(number: int, _: FrameType | None) -> None:
        let_go_of_lost_terminal()
        signal.signal(number, _raise)
        end()

    with _handled(first):
        yield


def let_go_of_lost_terminal() -> None:
    """Write to nowhere from now on what went to a terminal that is gone, since writing to it is an error."""
    for descriptor in _OUTPUTS:
        if stat.S_ISCHR(os.fstat(descriptor).st_mode) and not os.isatty(descriptor):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, descriptor)
            os.close(nowhere)


def _raise(_: int, __: FrameType | None) -> None:
    let_go_of_lost_terminal()
    raise KeyboardInterrupt


@contextmanager
def _handled(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    numbers = [n for n in _NUMBERS if n != signal.SIGHUP or signal.getsignal(n) != signal.SIG_IGN]
    before = [signal.signal(number, handler) for number in numbers]
    try:
        yield
    finally:
        for number, earlier in zip(numbers, before, strict=True):
            signal.signal(number, earlier)
