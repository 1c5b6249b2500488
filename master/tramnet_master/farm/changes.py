"""Workers that joined or were lost and have not been dealt with: what comes within a moment makes one wiring.

Deaths come together, as when a machine with many workers fails: dealt with one by one, work would be given to those
next in the queue, and blamed for each of their deaths.
"""

from tramnet_master.farm.events import Tram

MOMENT = 0.005
"""How long the first change waits for others [s]; a loss is seen after 2 ms."""


class Changes:
    """What has changed since the last wiring.

    Attributes:
        joined: Workers that have become live.
        lost: Workers that are live no longer.
        due: When to deal with them [s], or None while there is nothing.
    """

    def __init__(self) -> None:
        self.joined: list[Tram] = []
        self.lost: list[Tram] = []
        self.due: float | None = None

    def join(self, tram: Tram, now: float) -> None:
        """Note that a worker has become live."""
        self.joined.append(tram)
        self._wait(now)

    def lose(self, tram: Tram, now: float) -> None:
        """Note that a worker is live no longer; one that joined a moment ago has never been there."""
        if tram in self.joined:
            self.joined.remove(tram)
        else:
            self.lost.append(tram)
        self._wait(now)

    def _wait(self, now: float) -> None:
        if self.due is None:
            self.due = now + MOMENT
