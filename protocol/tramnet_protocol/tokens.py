"""What one watcher of tokens was told: what was there at the start, and every change since, in a sound order.

Zenoh's own history may tell of a token after it told that the token is gone, for it comes on another thread; a
dead node would then be alive for good. So what was there before is asked for apart, and what was heard since counts
more.
"""

import threading
from collections.abc import Callable


class TokenView:
    """The tokens one watcher was told of.

    Args:
        deliver: Is told each change once: key, and whether the token appears or disappears.
    """

    def __init__(self, deliver: Callable[[str, bool], None]) -> None:
        self._deliver = deliver
        self._lock = threading.Lock()
        self._alive: dict[str, bool] = {}  # every key heard of since the watch began

    def change(self, key: str, alive: bool) -> None:
        """Hand on that a token appears or disappears, unless that is known."""
        with self._lock:
            if self._alive.get(key) is not alive:
                self._alive[key] = alive
                self._deliver(key, alive)

    def found(self, key: str) -> None:
        """Hand on that a token was there when the watch began, unless more is known."""
        with self._lock:
            if key not in self._alive:
                self._alive[key] = True
                self._deliver(key, True)

    def lose_all(self) -> None:
        """Hand on that every token has disappeared: the only connection to those who show them is closed."""
        with self._lock:
            gone = [key for key, alive in self._alive.items() if alive]
            for key in gone:
                self._alive[key] = False
                self._deliver(key, False)
