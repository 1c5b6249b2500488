"""Whether a run gained from its workers: who was idle, why, and whether one alone would be faster."""

from collections.abc import Sequence
from typing import NamedTuple

SHORT_OF = 0.9
"""A worker that computed less than this share of what the busiest one did was idle for want of work."""


class Shared(NamedTuple):
    """How the steps of a run were shared among workers.

    Attributes:
        what: What may be computed at once: ``sub-populations`` or ``scenes``.
        parts: How many of these there are.
        steps: Steps, over all scenes.
        wall_seconds: Time of the run [s].
        compute_seconds: Compute time of all its steps [s].
        busy_seconds: Compute time of each worker [s].
    """

    what: str
    parts: int
    steps: int
    wall_seconds: float
    compute_seconds: float
    busy_seconds: Sequence[float]


def advice(run: Shared) -> str:
    """Return what the workers were good for, in words."""
    workers, split = len(run.busy_seconds), run.what == "sub-populations"
    took, alone = (1e3 * s / max(run.steps, 1) for s in (run.wall_seconds, run.compute_seconds))
    if run.parts == 1 and workers > 1:
        return (
            f"Each point starts from the posture at the one before, so one of {workers} workers computes at a time "
            "and the others are idle: one worker is the faster choice (--workers 1). More of them pay with several "
            "--scenes."
        )
    if workers <= 1 and not split:
        return f"One worker computed {alone:.3g} ms of each step of {took:.3g} ms."
    way = "--workers 1 --subpopulations 1" if split else "--workers 1"
    verdict = (
        f"alone and without exchanges, one would need about {alone:.3g} ms and is the faster choice ({way})"
        if alone <= took
        else f"one would need {alone:.3g} ms, {alone / took:.2f} times as long"
    )
    who = "One worker" if workers <= 1 else f"{workers} workers"
    return f"{who} took {took:.3g} ms a step; {verdict}. {_idle(run)}".rstrip()


def _idle(run: Shared) -> str:
    most = max(run.busy_seconds, default=0.0)
    short = [i + 1 for i, busy in enumerate(run.busy_seconds) if busy < SHORT_OF * most]
    if not short:
        return "All of them computed for as long." if len(run.busy_seconds) > 1 else ""
    who = f"Worker{'s' if len(short) > 1 else ''} {', '.join(map(str, short))}"
    workers = len(run.busy_seconds)
    if run.parts < workers:
        why = f"there are {run.parts} {run.what} for {workers} workers"
    elif run.parts % workers:
        why = f"{run.parts} {run.what} do not divide among {workers} workers"
    else:
        why = "of what each was given, or because it came later"
    return f"{who} computed less: {why}."
