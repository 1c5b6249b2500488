"""Keys of a terminal, one at a time and without their echo; nothing where there is no terminal."""

import os
import select
import sys
import termios
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

_ESCAPE = "\x1b"
_NAMES = {
    "\x1b[A": "up", "\x1b[B": "down", "\x1b[5~": "page up", "\x1b[6~": "page down",
    "\x1b[H": "home", "\x1b[1~": "home", "\x1bOA": "up", "\x1bOB": "down", "\x1bOH": "home",
    _ESCAPE: "escape", "\t": "tab", "\r": "enter", "\n": "enter", "\x7f": "backspace",
    "\b": "backspace",
}  # fmt: skip


def keys_of(text: str) -> list[str]:
    """Return the keys in what a terminal sent at once, special ones by name."""
    keys = []
    while text:
        known = [code for code in _NAMES if text.startswith(code)]
        code = max(known, key=len) if known else text[0]
        if code == _ESCAPE and len(text) > 1:
            break  # a key without a meaning here: its letters are none of the user's
        keys.append(_NAMES.get(code, code))
        text = text[len(code) :]
    return keys


@dataclass(frozen=True)
class Keyboard:
    """The keys of the terminal at standard input.

    Attributes:
        terminal: Its file descriptor, or None where standard input is no terminal.
        stopped: Ends a wait early where there are no keys.
    """

    terminal: int | None
    stopped: threading.Event

    def read(self, patience: float) -> list[str]:
        """Return the keys pressed, after a wait of at most so long [s]."""
        if self.terminal is None:
            self.stopped.wait(patience)
            return []
        ready, _, _ = select.select([self.terminal], [], [], patience)
        if not ready:
            return []
        found = os.read(self.terminal, 1024)
        if not found:  # the terminal is gone
            self.stopped.set()
        return keys_of(found.decode(errors="replace"))


@contextmanager
def open_keyboard(stopped: threading.Event) -> Iterator[Keyboard]:
    """Read keys one at a time until the block ends; the terminal is then as it was."""
    try:
        terminal = sys.stdin.fileno()
        before = termios.tcgetattr(terminal)
    except (OSError, ValueError, termios.error):
        yield Keyboard(None, stopped)
        return
    if _is_another_job_s(terminal):
        yield Keyboard(None, stopped)
        return
    try:
        tty.setcbreak(terminal)
        yield Keyboard(terminal, stopped)
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def _is_another_job_s(terminal: int) -> bool:
    """Whether reading would stop this process, as it stops those that a shell has put in the background."""
    try:
        return os.tcgetpgrp(terminal) != os.getpgrp()
    except OSError:  # a terminal without jobs
        return False
