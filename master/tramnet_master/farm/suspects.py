"""Suspect pieces in wait for a fresh process, and the fresh processes asked for."""

from collections import deque

from tramnet_master.farm.batch import Batch, Piece
from tramnet_master.farm.roster import Roster, Standing, Worker


class Suspects:
    """Pieces that may only go to a process that never had other work.

    Attributes:
        waiting: The pieces, first come first served; some may have been closed since.
        expected: When each fresh process asked for is given up [s], ascending.
    """

    def __init__(self) -> None:
        self.waiting: deque[tuple[Batch, Piece]] = deque()
        self.expected: deque[float] = deque()

    def __bool__(self) -> bool:
        return bool(self.waiting)

    def add(self, batch: Batch, piece: Piece) -> None:
        """Let a piece wait."""
        self.waiting.append((batch, piece))

    def first(self) -> tuple[Batch, Piece] | None:
        """The first piece that is still open; it stays first."""
        while self.waiting:
            batch, piece = self.waiting[0]
            if batch.trim(piece):
                return batch, piece
            self.waiting.popleft()
        return None

    def welcome(self) -> None:
        """Expect one fresh process less: one has come."""
        if self.expected:
            self.expected.popleft()

    def lacks_process(self, n_working: int, now: float) -> bool:
        """Whether one more worker should make place for a fresh process.

        Suspects get at most half of the workers, for the others have work to do.
        """
        while self.expected and self.expected[0] <= now:
            self.expected.popleft()
        asked = len(self.expected)
        return asked < min(len(self.waiting), max(1, (n_working + asked) // 2))


def worker_to_replace(roster: Roster) -> Worker | None:
    """The worker that can best be spared: idle, else the one that holds least; never one that holds state."""
    if roster.empty:
        return next(iter(roster.empty.values()))
    busy = [
        worker
        for worker in roster.workers.values()
        if worker.standing is Standing.WORKING
        and not worker.bound
        and not worker.held[0].piece.suspect
    ]
    return min(busy, key=lambda worker: len(worker.held), default=None)
