"""What the farm tells whoever keeps its books (``traffic/books.py``)."""

from typing import Protocol

from tramnet_master.farm.events import Tram
from tramnet_protocol.messages import Outcome, PopulationSnapshot, Wiring, Work


class Books(Protocol):
    """What the farm tells whoever keeps its books."""

    def rewired(self, wiring: Wiring) -> None:
        """There is a new wiring."""

    def sent(self, tram: Tram, work: Work) -> None:
        """A chunk was sent."""

    def answered(self, tram: Tram, outcome: Outcome, snapshot: PopulationSnapshot | None) -> None:
        """An outcome of open work has arrived, and perhaps a snapshot with it."""

    def idle(self) -> None:
        """No work is open any more."""


class NoBooks:
    """Keeps none."""

    def rewired(self, wiring: Wiring) -> None:
        """Forget it."""

    def sent(self, tram: Tram, work: Work) -> None:
        """Forget it."""

    def answered(self, tram: Tram, outcome: Outcome, snapshot: PopulationSnapshot | None) -> None:
        """Forget it."""

    def idle(self) -> None:
        """Forget it."""
