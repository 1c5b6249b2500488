import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.channel import Lane
from tramnet_protocol.errors import ChannelClosed
from tramnet_protocol.links import LinkTiming
from tramnet_protocol.pacing import Departures, Pacer

TWENTY = LinkTiming.of(20)
SECOND = 1_000_000_000


class Sink:
    """Remembers what was published, and when."""

    def __init__(self) -> None:
        self.frames: list[tuple[str, bytes]] = []
        self.times: list[float] = []
        self.enough = threading.Event()
        self.wanted = 10**9
        self.open = True

    def publish(self, key: str, payload: bytes, lane: Lane) -> None:
        assert lane is Lane.LINK
        if not self.open:
            raise ChannelClosed("publish")
        self.frames.append((key, payload))
        self.times.append(time.monotonic())
        if len(self.frames) >= self.wanted:
            self.enough.set()


@given(st.lists(st.tuples(st.integers(1, 70_000), st.integers(0, 10_000_000)), min_size=1))
def test_a_link_carries_one_frame_after_another_each_in_its_own_time(frames):
    departures, now, free = Departures(TWENTY), 0, 0

    for size, later in frames:
        now += later
        arrival = departures.arrival("a link", size, now)
        free = max(free, now) + TWENTY.occupied(size)
        assert arrival == free + TWENTY.wake_up


def test_links_do_not_wait_for_each_other():
    departures = Departures(TWENTY)

    departures.arrival("one", 60_000, 0)

    assert departures.arrival("another", 100, 0) == TWENTY.hop(100)


def test_frames_of_a_link_keep_their_order_and_the_pace_of_the_link():
    sink = Sink()
    sink.wanted = 20
    with Pacer(sink, TWENTY) as pacer:
        began = time.monotonic()
        for i in range(20):
            pacer.publish("link", bytes([i]) * 10_000, Lane.LINK)
        taken = time.monotonic() - began
        assert sink.enough.wait(10.0)

    assert [payload[0] for _, payload in sink.frames] == list(range(20))
    modelled = 20 * TWENTY.occupied(10_000) / SECOND
    assert sink.times[-1] - began >= modelled
    assert taken < modelled / 2  # whoever sends does not wait


def test_a_short_frame_on_a_free_link_overtakes_a_long_one_on_another():
    sink = Sink()
    with Pacer(sink, LinkTiming.of(5)) as pacer:
        pacer.publish("slow", bytes(50_000), Lane.LINK)
        pacer.publish("fast", bytes(10), Lane.LINK)

    assert [key for key, _ in sink.frames] == ["fast", "slow"]


def test_closing_delivers_what_is_on_its_way_and_then_nothing():
    sink = Sink()
    pacer = Pacer(sink, LinkTiming.of(5))
    for _ in range(3):
        pacer.publish("link", bytes(1_000_000), Lane.LINK)  # seconds each

    pacer.close()
    pacer.close()

    assert len(sink.frames) == 3
    with pytest.raises(ChannelClosed):
        pacer.publish("link", b"x", Lane.LINK)


def test_a_closed_channel_ends_the_pacer_quietly():
    sink = Sink()
    pacer = Pacer(sink, TWENTY)
    sink.open = False

    pacer.publish("link", b"x", Lane.LINK)
    pacer.close()

    assert sink.frames == []
