"""Open works, and who was given which chunk of them: what decides whether an answer counts."""

from tramnet_master.farm.batch import Assignment, Batch
from tramnet_master.farm.events import Reason, Tram
from tramnet_protocol.messages import WorkId


class Ledger:
    """All open works and every assignment made of them, for as long as they are open.

    Attributes:
        open: Works not resolved, by submitted identity.
        given: Assignments by chunk and worker; only chunks of open works.
    """

    def __init__(self) -> None:
        self.open: dict[WorkId, Batch] = {}
        self.given: dict[WorkId, dict[Tram, Assignment]] = {}

    def record(self, assignment: Assignment) -> None:
        """Remember that a worker was given a chunk."""
        trams = self.given.get(assignment.work)
        if trams is None:
            trams = self.given[assignment.work] = {}
            assignment.batch.chunks.append(assignment.work)
        trams[assignment.tram] = assignment

    def judge(self, tram: Tram, work: WorkId) -> Assignment | Reason:
        """The assignment this worker may answer, or why its answer does not count."""
        trams = self.given.get(work)
        if trams is None:
            return Reason.CLOSED
        assignment = trams.get(tram)
        if assignment is None:
            return Reason.STRANGER
        return Reason.DUPLICATE if assignment.answered else assignment

    def settle(self, batch: Batch) -> bool:
        """Forget a work if nothing of it is open any more; whether that is so."""
        if batch.open or self.open.get(batch.work) is not batch:
            return False
        del self.open[batch.work]
        for chunk in batch.chunks:
            del self.given[chunk]
        return True
