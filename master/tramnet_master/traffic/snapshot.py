"""A network at one moment, for people and programs alike."""

import csv
import io
from collections.abc import Sequence

import msgspec
from msgspec import Struct

from tramnet_master.traffic.inspector import Inspector
from tramnet_master.traffic.rows import LinkRow, Row, TagRow, TopicRow, TramRow
from tramnet_master.traffic.selection import Selection
from tramnet_master.traffic.sniffer import Cost, Sniffer
from tramnet_master.traffic.status import Status, WorkerStatus, read_status
from tramnet_protocol.messages import ROOT


class Snapshot(Struct, frozen=True):
    """What was known of a network at one moment.

    Attributes:
        status: What the root said of itself.
        said: The same, as it came.
        trams: TRAMs.
        links: Directed links.
        tags: Kinds of messages.
        topics: Link topics, where somebody sniffed.
        cost: What sniffing took, or None.
    """

    status: Status
    said: dict[str, object]
    trams: list[TramRow]
    links: list[LinkRow]
    tags: list[TagRow]
    topics: list[TopicRow]
    cost: Cost | None

    @property
    def evaluations_per_s(self) -> float:
        """Evaluations of all workers per second [1/s]."""
        return sum(row.evaluations_per_s for row in self.trams if row.seat != ROOT)

    def table(self, name: str) -> Sequence[Row]:
        """Return the rows of a table."""
        tables: dict[str, Sequence[Row]] = {
            "trams": self.trams, "links": self.links, "tags": self.tags, "topics": self.topics,
        }  # fmt: skip
        return tables[name]


def take(said: dict[str, object], inspector: Inspector, sniffer: Sniffer | None) -> Snapshot:
    """Put together what is known now.

    Args:
        said: What the root said of itself last.
        inspector: What the heartbeats told.
        sniffer: What the frames told, or None.

    Raises:
        RunFailed: What the root said is no status.
    """
    status = read_status(said)
    inspector.keep({worker.seat: worker.incarnation for worker in status.workers})
    trams = inspector.trams()
    heard = {row.seat for row in trams}
    trams += [_building(worker) for worker in status.workers if worker.seat not in heard]
    return Snapshot(
        status=status,
        said=said,
        trams=sorted(trams, key=lambda row: row.seat),
        links=inspector.links(),
        tags=inspector.tags(status.generation),
        topics=sniffer.topics() if sniffer else [],
        cost=sniffer.cost() if sniffer else None,
    )


def document(snapshot: Snapshot, selection: Selection, time: float) -> dict[str, object]:
    """Return a snapshot as plain values for programs.

    Args:
        snapshot: The snapshot.
        selection: Which rows, in which order.
        time: When it was taken [s since 1970].
    """
    tables = {
        name: selection.of(snapshot.table(name)) for name in ("trams", "links", "tags", "topics")
    }
    if snapshot.cost is None:
        return {"time_s": time, **snapshot.said, **tables}
    return {
        "time_s": time,
        **snapshot.said,
        **tables,
        "sniffing": msgspec.to_builtins(snapshot.cost),
    }


def csv_lines(rows: Sequence[Row], table: type[Row], time: float, head: bool) -> str:
    """Return rows as lines of CSV, the time they are of in front [s since 1970].

    Args:
        rows: The rows.
        table: Their type.
        time: When they were taken [s since 1970].
        head: Whether to begin with the names of the columns.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    if head:
        writer.writerow(("time_s", *table.__struct_fields__))
    writer.writerows((f"{time:.3f}", *msgspec.structs.astuple(row)) for row in rows)
    return text.getvalue()


def _building(worker: WorkerStatus) -> TramRow:
    state = "live" if worker.live else "building"
    return TramRow(
        worker.seat, worker.incarnation, worker.host, worker.pid, state, 0, 0, 0.0, 0.0, 0.0, 0.0, 0, 0.0
    )  # fmt: skip
