import pytest

from tramnet_master.traffic.inspector import SILENT, Inspector
from tramnet_master.traffic.rows import LINK_BYTES_PER_SECOND
from tramnet_protocol.codec import Header, encode
from tramnet_protocol.messages import LinkCounters, Stats, Stop, TagCounters


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def inspector(clock):
    return Inspector(clock)


def heartbeat(seat, uptime, incarnation=1, **fields):
    filled = {
        "state": "busy", "busy": 0.0, "blocked": 0.0, "evaluations": 0, "chunks": 0, "queued": 0,
        "malformed": 0, "links": (), "pid": 7, "host": "a", **fields,
    }  # fmt: skip
    return encode(
        Header(source=seat), Stats(seat=seat, incarnation=incarnation, uptime=uptime, **filled)
    )


def test_rates_are_those_between_two_heartbeats(inspector):
    inspector.take(heartbeat(1, 10.0, busy=6.0, blocked=1.0, evaluations=1000))
    inspector.take(heartbeat(1, 12.0, busy=7.0, blocked=1.2, evaluations=1500))

    (row,) = inspector.trams()

    assert row.evaluations_per_s == 250.0
    assert (row.busy, row.blocked, row.idle) == pytest.approx((0.5, 0.1, 0.4))


def test_one_heartbeat_tells_no_rate(inspector):
    inspector.take(heartbeat(1, 10.0, evaluations=1000))

    (row,) = inspector.trams()

    assert (row.evaluations, row.evaluations_per_s) == (1000, 0.0)
    assert not inspector.rated


def test_another_life_of_a_seat_begins_anew(inspector):
    inspector.take(heartbeat(1, 10.0, incarnation=1, evaluations=1000))
    inspector.take(heartbeat(1, 0.5, incarnation=2, evaluations=3))

    (row,) = inspector.trams()

    assert (row.incarnation, row.evaluations, row.evaluations_per_s) == (2, 3, 0.0)


def test_what_is_gone_is_forgotten_and_the_root_is_not(inspector):
    for seat in (0, 1, 2):
        inspector.take(heartbeat(seat, 1.0, incarnation=seat + 4))

    inspector.keep({1: 5, 2: 99})

    assert [row.seat for row in inspector.trams()] == [0, 1]


def test_a_tram_whose_heartbeat_is_overdue_is_silent(inspector, clock):
    inspector.take(heartbeat(1, 1.0))
    clock.now += SILENT + 0.1

    (row,) = inspector.trams()

    assert row.state == "silent"


def test_a_link_is_told_by_its_sender_and_its_receiver(inspector):
    for uptime, frames in ((1.0, 100), (2.0, 150)):
        sent = LinkCounters(0, 1, frames, frames * 1740, queued=2)
        got = LinkCounters(0, 1, frames - 3, 1, dropped=1, gaps=2, queued=3)
        inspector.take(heartbeat(0, uptime, links=(sent,)))
        inspector.take(heartbeat(1, uptime, links=(got,)))

    (row,) = inspector.links()

    assert (row.link, row.frames, row.mean_bytes) == ("link/0/1", 150, 1740.0)
    assert (row.queued, row.dropped, row.gaps) == (5, 1, 2)
    assert row.utilisation == pytest.approx(50 * 1740 / LINK_BYTES_PER_SECOND)


def test_tags_are_told_by_the_root_both_ways_and_per_generation(inspector):
    tags = (TagCounters("evolve", 40, 4000, 0, 0), TagCounters("population-means", 0, 0, 40, 800))
    inspector.take(heartbeat(0, 1.0, tags=tags))

    sent, got = inspector.tags(generations=10)

    assert (sent.tag, sent.way, sent.frames_per_generation) == ("evolve", "from root", 4.0)
    assert (got.tag, got.way, got.mean_bytes) == ("population-means", "to root", 20.0)


@pytest.mark.parametrize("payload", [b"", b"\xc1", encode(Header(), Stop("x"))])
def test_what_is_no_heartbeat_is_ignored(inspector, payload):
    inspector.take(payload)

    assert not inspector.trams()
    assert not inspector.links()
    assert not inspector.tags(0)
