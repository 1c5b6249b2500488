"""Which worker holds which populations. Pure bookkeeping."""

from tramnet_master.farm.events import Tram
from tramnet_protocol.messages import WorkId


class Holders:
    """The workers that hold populations, as their last answers show it."""

    def __init__(self) -> None:
        self._found: dict[tuple[int, int, int], Tram] = {}  # (search, first, last)

    def note(self, work: WorkId, tram: Tram) -> None:
        """Note that a worker has brought populations to the step of a work; nobody else has them so far."""
        search, first, last = work.population, work.first, work.last
        self._found = {
            place: holder
            for place, holder in self._found.items()
            if place[0] == search and (place[2] <= first or last <= place[1])
        }
        self._found[search, first, last] = tram

    def find(self, work: WorkId) -> Tram | None:
        """Return the worker that holds just the populations of a work, if there is one."""
        return self._found.get((work.population, work.first, work.last))
