import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tramnet_master.farm.events import (
    Answered,
    Event,
    Instruction,
    Raised,
    Send,
    Tick,
    Tram,
    WorkerReady,
    WorkSubmitted,
)
from tramnet_master.farm.rules import Rules
from tramnet_master.farm.scheduler import Scheduler
from tramnet_protocol.messages import Kind, WorkId


class Farm:
    """A scheduler in a story: it is checked after every event, and remembers who was sent what."""

    def __init__(self, workers: int = 0, rules: Rules | None = None) -> None:
        self.scheduler = Scheduler(rules)
        self.now = 0.0
        self.told: list[Instruction] = []
        for seat in range(1, workers + 1):
            self.tell(WorkerReady(Tram(seat, 1)))

    def tell(self, event: Event, after: float = 0.0) -> list[Instruction]:
        """Instructions that follow from an event, ``after`` seconds from the last one."""
        self.now += after
        out = self.scheduler.handle(event, self.now)
        self.scheduler.validate()
        self.told += out
        return out

    def submit(self, *works: WorkId, **options: object) -> list[Instruction]:
        return [i for work in works for i in self.tell(WorkSubmitted(work, **options))]

    def answer(
        self, sent: Send, seconds: float = 0.0, bad: tuple[int, ...] = ()
    ) -> list[Instruction]:
        return self.tell(Answered(sent.tram, sent.work, seconds, bad), after=seconds)

    def fail(self, sent: Send) -> list[Instruction]:
        return self.tell(Raised(sent.tram, sent.work, "ValueError"))

    def teach(self, kind: Kind, cost: float, workers: int) -> None:
        """Let every worker answer one slot twice, so that the cost of a slot is known."""
        for step in (1_000_000, 1_000_001):
            for sent in self.submit(WorkId(kind, 99, step, 0, workers)):
                if isinstance(sent, Send):
                    self.answer(sent, cost)

    def wait(self, seconds: float) -> list[Instruction]:
        """Tick whenever the scheduler asks for it, until some time has passed."""
        end = self.now + seconds
        out = []
        while (due := self.scheduler.next_time()) is not None and due <= end:
            self.now = max(self.now, due)
            out += self.tell(Tick())
        self.now = end
        return out


@pytest.fixture
def make_farm() -> type[Farm]:
    return Farm


@pytest.fixture
def busy_farm() -> Farm:
    """Two workers, and one slot of evaluation known to take 10 ms."""
    farm = Farm(workers=2)
    farm.teach(Kind.EVALUATE, 0.010, workers=2)
    return farm


def _assert_in_order(figure: Any) -> None:
    """Nothing is cut off, and no legend or title covers a panel."""
    width, height = figure.get_size_inches()
    box = figure.get_tightbbox()
    assert min(box.x0, box.y0) >= 0.0
    assert box.x1 <= width
    assert box.y1 <= height
    for over in (*figure.legends, *figure.texts):
        for axes in figure.get_axes():
            assert not over.get_window_extent().overlaps(axes.get_tightbbox())


@pytest.fixture
def assert_in_order() -> Callable[[Any], None]:
    """What must hold for a figure that was drawn."""
    return _assert_in_order


@pytest.fixture(scope="session")
def golden() -> dict[str, bytes]:
    """A frame with each kind of message, by tag."""
    text = (Path(__file__).parents[1] / "golden/frames.json").read_text()
    return {tag: bytes.fromhex(frame) for tag, frame in json.loads(text).items()}
