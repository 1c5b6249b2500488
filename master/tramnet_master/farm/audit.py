"""Finds workers that lie about what they computed: recomputes a sample of it, and always the best of a generation.

A worker that is let in can answer anything to the work it is given, and nothing tells a true objective from a lie
but computing it again. Which ones are, depends on a secret of this process, so nobody knows which answer will be
looked at; the best individual of a generation always is, for that is where a lie pays. A lie about one is found
with the sampled fraction for its probability, or at once if it makes that one the best.

The scheduler and the result know nothing of this: where nobody lies, an audit changes nothing.
"""

import hashlib
import struct
from collections import defaultdict
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from tramnet_master.farm.events import Tram
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evaluate, Evaluated, Outcome, PopulationSnapshot, Work, WorkId

_SLOT = struct.Struct("<5q")
_DRAW_BYTES = 8

Answer = tuple[Outcome, PopulationSnapshot | None]
Recompute = Callable[[Work], Answer]


class Audit:
    """Looks at answers again.

    Args:
        fraction: Share of the individuals, or of works that are done whole, that is recomputed.
        secret: What the sample depends on.
        recompute: Computes the outcome of a work, and its snapshot if the work asks for one; it may raise anything.

    Attributes:
        checked: Number of individuals, or of works that are done whole, recomputed so far.
    """

    def __init__(self, fraction: float, secret: bytes, recompute: Recompute) -> None:
        self.checked = 0
        self._limit = round(fraction * 2.0 ** (8 * _DRAW_BYTES))
        self._secret = secret
        self._recompute = recompute
        self._givers: defaultdict[WorkId, list[tuple[WorkId, Tram]]] = defaultdict(list)

    def note(self, whole: WorkId, part: WorkId, tram: Tram) -> None:
        """Note who gave an accepted part of a submitted work."""
        self._givers[whole].append((part, tram))

    def wants(self, work: WorkId) -> bool:
        """Return whether a work that is done whole is in the sample."""
        return self._draw(work, work.first) < self._limit

    def liars(self, work: Work, answer: Answer) -> set[Tram]:
        """Return the workers whose part of an answer differs from what is recomputed.

        Args:
            work: A work whose slots are all accepted or condemned; one on populations carries their state.
            answer: What came of it.
        """
        given = self._givers.pop(work.work, [])
        if isinstance(work, Evaluate):
            wrong = set(self._wrong_slots(work, answer[0], given))
            return {
                tram for part, tram in given if wrong.intersection(range(part.first, part.last))
            }
        if not self.wants(work.work):
            return set()
        self.checked += 1
        return set() if self._is_same(work, answer) else {tram for _, tram in given}

    def _wrong_slots(
        self, work: Evaluate, outcome: Outcome, given: list[tuple[WorkId, Tram]]
    ) -> Iterator[int]:
        assert isinstance(outcome, Evaluated), "inspected before it was accepted"
        first, genomes = work.work.first, work.genomes.unpack()
        objectives = outcome.objectives.unpack()
        answered = [slot for part, _ in given for slot in range(part.first, part.last)]
        if not answered:
            return
        best = min(answered, key=lambda slot: objectives[slot - first])
        sample = [s for s in answered if s == best or self._draw(work.work, s) < self._limit]
        self.checked += len(sample)
        again = self._objectives(work.work, genomes[np.array(sample) - first])
        for slot, objective in zip(sample, again, strict=True):
            if objectives[slot - first].tobytes() != objective:
                yield slot

    def _objectives(self, work: WorkId, genomes: NDArray[np.generic]) -> list[bytes]:
        """Return the bits of each objective; none for an individual that cannot be evaluated."""
        # Under an identity of their own: an objective depends on no place.
        identity = WorkId(work.kind, work.population, work.step, 0, len(genomes))
        again = self._try(Evaluate(identity, Array.pack(genomes)))
        if again is None:
            alone = ([genome] for genome in genomes) if len(genomes) > 1 else ()
            return [self._objectives(work, np.array(one))[0] for one in alone] or [b""]
        assert isinstance(again[0], Evaluated), "an evaluation yields objectives"
        return [objective.tobytes() for objective in again[0].objectives.unpack()]

    def _is_same(self, work: Work, answer: Answer) -> bool:
        again = self._try(work)
        return again is not None and [list(_arrays(a)) for a in again] == [
            list(_arrays(a)) for a in answer
        ]

    def _try(self, work: Work) -> Answer | None:
        try:
            return self._recompute(work)
        except Exception:  # a user's problem may raise anything
            return None

    def _draw(self, work: WorkId, slot: int) -> int:
        content = _SLOT.pack(int(work.kind), work.population, work.step, slot, 0)
        digest = hashlib.blake2b(content, digest_size=_DRAW_BYTES, key=self._secret).digest()
        return int.from_bytes(digest, "little")


def _arrays(message: Outcome | PopulationSnapshot | None) -> Iterator[Array]:
    if message is None:
        return
    fields = (getattr(message, name) for name in message.__struct_fields__)
    yield from (field for field in fields if isinstance(field, Array))
