import msgspec
import pytest

from tramnet_protocol.codec import Header, decode, encode, encode_raw
from tramnet_protocol.exchange import Exchange, Identity
from tramnet_protocol.inbox import Inbox
from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import Setup, Stop, TagCounters, Wiring

KEYS = Keys("net")
ROOT_ID = Identity(run=5, seat=0, incarnation=9)
WORKER_ID = Identity(run=5, seat=1, incarnation=3)
WIRING = Wiring(4, "star", {0: 9, 1: 3, 2: 4}, ((0, 1), (0, 2)))
SETUP = Setup("sphere", {"dimension": 2})


@pytest.fixture
def root() -> Exchange:
    return Exchange(KEYS, ROOT_ID, WIRING)


@pytest.fixture
def worker() -> Exchange:
    return Exchange(KEYS, WORKER_ID, WIRING)


def test_what_one_end_sends_the_other_takes(root, worker):
    key, payload = root.outgoing((1, 3), Stop("enough"))

    frame = worker.incoming(key, payload)

    assert key == "tramnet/v1/net/link/0/1"
    assert frame is not None
    assert frame.message() == Stop("enough")
    assert (frame.header.source, frame.header.source_incarnation) == (0, 9)


def test_frames_are_numbered_per_link(root):
    sequences = [
        decode(root.outgoing((seat, 1), Stop("x"))[1]).header.sequence for seat in (1, 2, 1, 1, 2)
    ]

    assert sequences == [0, 0, 1, 2, 1]


@pytest.mark.parametrize(
    "header",
    [
        Header(run=6, destination=1, destination_incarnation=3),
        Header(run=5, destination=1, destination_incarnation=2),
    ],
    ids=["another run", "an earlier incarnation"],
)
def test_what_is_not_meant_for_this_life_of_this_tram_is_counted_and_dropped(worker, header):
    assert worker.incoming(KEYS.link(0, 1), encode(header, Stop("x"))) is None
    assert worker.foreign == 1


def test_what_is_no_frame_is_counted_and_dropped(worker):
    assert worker.incoming(KEYS.link(0, 1), b"\xc1 rubbish") is None
    assert worker.malformed == 1


def test_both_ends_count_the_same_traffic_and_a_gap_is_seen(root, worker):
    sent = [root.outgoing((1, 3), Stop("x")) for _ in range(4)]
    for key, payload in (sent[0], sent[1], sent[3]):
        worker.incoming(key, payload)

    (out,) = root.counters()
    (came,) = worker.counters()

    assert (out.source, out.destination, out.frames) == (0, 1, 4)
    assert (came.source, came.destination, came.frames, came.gaps) == (0, 1, 3, 1)
    assert out.bytes == came.bytes + len(sent[2][1])


def test_messages_are_counted_by_tag_where_they_are_made_and_where_they_arrive(root, worker):
    sent = [root.outgoing((1, 3), message) for message in (Stop("x"), SETUP, Stop("xy"))]
    for key, payload in sent:
        worker.incoming(key, payload)
    sizes = [len(payload) for _, payload in sent]

    assert list(root.tags()) == [
        TagCounters("setup", 1, sizes[1], 0, 0),
        TagCounters("stop", 2, sizes[0] + sizes[2], 0, 0),
    ]
    assert list(worker.tags()) == [
        TagCounters("setup", 0, 0, 1, sizes[1]),
        TagCounters("stop", 0, 0, 2, sizes[0] + sizes[2]),
    ]


def test_tags_of_others_and_unknown_ones_are_not_counted(worker):
    meant = Header(run=5, destination=1, destination_incarnation=3)
    foreign = encode(msgspec.structs.replace(meant, run=6), Stop("x"))
    unknown = encode_raw(msgspec.structs.replace(meant, tag="of another day"), b"")
    for payload in (foreign, unknown):
        worker.incoming(KEYS.link(0, 1), payload)

    assert not list(worker.tags())


def test_what_waits_is_told_with_the_link_it_waits_for(root, worker):
    key, payload = root.outgoing((1, 3), Stop("x"))
    worker.incoming(key, payload)

    (out,) = root.counters({key: 3})
    (came,) = worker.counters({key: 2})

    assert (out.queued, came.queued) == (3, 2)


def test_an_inbox_keeps_what_this_process_says_and_bounds_what_others_do():
    inbox: Inbox[str] = Inbox()
    for _ in range(100):
        inbox.put_from("loud", 100_000, "noise")
    inbox.put("own")

    taken = []
    while (item := inbox.get(0)) is not None:
        taken.append(item)

    assert taken.count("own") == 1
    assert 0 < taken.count("noise") < 100
    assert inbox.dropped["loud"] == 100 - taken.count("noise")


def test_an_inbox_tells_what_waits_by_source():
    inbox: Inbox[int] = Inbox()
    for source in ("a", "b", "a"):
        inbox.put_from(source, 10, 1)

    assert inbox.waiting == {"a": 2, "b": 1}

    inbox.get(0)

    assert inbox.waiting == {"a": 1, "b": 1}


def test_credit_comes_back_when_a_message_is_taken_out():
    inbox: Inbox[int] = Inbox()
    for i in range(1000):
        inbox.put_from("steady", 100_000, i)
        assert inbox.get(0) == i

    assert inbox.empty
    assert not inbox.dropped


@pytest.mark.parametrize("source", ["x", "*", "99999", "01"])
def test_a_key_that_is_no_link_is_counted_and_dropped(worker, source):
    _, payload = Exchange(KEYS, ROOT_ID, WIRING).outgoing((1, 3), Stop("x"))

    assert worker.incoming(f"tramnet/v1/net/link/{source}/1", payload) is None
    assert worker.malformed == 1


def test_a_link_to_a_seat_that_another_worker_takes_is_numbered_from_zero(root):
    root.outgoing((1, 3), Stop("x"))
    root.outgoing((2, 4), Stop("x"))

    root.rewire(Wiring(5, "star", {0: 9, 1: 4, 2: 4}, ((0, 1), (0, 2))))

    assert decode(root.outgoing((2, 4), Stop("x"))[1]).header.sequence == 1
    assert decode(root.outgoing((1, 4), Stop("x"))[1]).header.sequence == 0


def test_gaps_beyond_counting_still_travel_in_statistics(worker):
    for sequence in (1, 2**63 - 1, 0, 2**63 - 1):
        header = Header(run=5, destination=1, destination_incarnation=3, sequence=sequence)
        worker.incoming(KEYS.link(0, 1), encode(header, Stop("x")))

    (counters,) = worker.counters()

    assert counters.gaps == 2**63 - 1


LINE = ((0, 1), (1, 2), (2, 3))
IN_LINE = Wiring(4, "pipeline", {0: 9, 1: 3, 2: 4, 3: 6}, LINE)


def exchanges(wiring, *seats):
    return [Exchange(KEYS, Identity(5, seat, wiring.incarnations[seat]), wiring) for seat in seats]


def test_a_frame_three_hops_away_passes_three_links_with_its_body_untouched():
    root, *workers = exchanges(IN_LINE, 0, 1, 2, 3)
    key, payload = root.outgoing((3, 6), Stop("enough"))
    body = decode(payload).body
    keys = [key]

    for worker in workers:
        frame = worker.incoming(key, payload)
        if not worker.is_ours(frame):
            key, payload = worker.forward(key, frame)
            keys.append(key)

    assert keys == [KEYS.link(0, 1), KEYS.link(1, 2), KEYS.link(2, 3)]
    assert frame.body == body
    assert (frame.header.source, frame.header.destination) == (0, 3)


def test_what_is_passed_on_has_the_numbers_of_its_next_link():
    root, first = exchanges(IN_LINE, 0, 1)
    root.outgoing((1, 3), Stop("for the first"))
    root_frame = root.outgoing((3, 6), Stop("for the last"))

    _, payload = first.forward(root_frame[0], first.incoming(*root_frame))

    assert decode(root_frame[1]).header.sequence == 1
    assert decode(payload).header.sequence == 0
    assert [(c.source, c.destination, c.frames) for c in first.counters()] == [(1, 2, 1), (0, 1, 1)]


def test_a_frame_whose_next_tram_is_gone_is_dropped_and_counted():
    root, first = exchanges(IN_LINE, 0, 1)
    key, payload = root.outgoing((3, 6), Stop("x"))
    frame = first.incoming(key, payload)

    first.rewire(Wiring(5, "pipeline", {0: 9, 1: 3, 3: 6}, ((0, 1), (1, 3))))

    assert first.forward(key, frame) is None
    assert first.stranded == 1
    assert next(c for c in first.counters() if c.source == 0).dropped == 1


def test_only_messages_for_this_node_count_among_its_own():
    root, first = exchanges(IN_LINE, 0, 1)

    first.incoming(*root.outgoing((3, 6), Stop("x")))
    first.incoming(*root.outgoing((1, 3), Stop("x")))

    assert [(tag.tag, tag.received) for tag in first.tags()] == [("stop", 1)]
