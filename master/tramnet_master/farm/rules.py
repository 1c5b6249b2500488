"""The numbers the farm is run by (design: credit, deadlines, trials)."""

from msgspec import Struct


class Rules(Struct, frozen=True):
    """Limits and targets of the scheduler.

    Attributes:
        credit_chunks: Chunks a worker may hold: one in work and one waiting.
        credit_bytes: Unacknowledged bytes a worker may hold [byte]; a larger slot travels alone.
        chunk_seconds: Time a chunk should take [s]: long against a round trip of 0.1 ms.
        queue_behind: A second chunk is sent only behind one that takes less than this [s]; behind a
            long one it would gain nothing and could not be had back for an idle worker.
        first_deadline: Deadline of one slot before its cost is known [s].
        least_deadline: No deadline is shorter [s].
        slack: A chunk may take this many times its measured cost.
        trials: Failures before a chunk is bisected, put into a fresh process, or condemned.
        condemn: Whether a suspect is ever given up; otherwise it is tried for as long as the run lasts.
    """

    credit_chunks: int = 2
    credit_bytes: int = 256 * 1024
    chunk_seconds: float = 0.015
    queue_behind: float = 0.05
    first_deadline: float = 60.0
    least_deadline: float = 3.0
    slack: float = 10.0
    trials: int = 3
    condemn: bool = True
