import contextlib
import itertools
import os
import queue
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from tramnet_protocol.arrays import Array
from tramnet_protocol.channel import Channel, Lane
from tramnet_protocol.codec import Header, encode
from tramnet_protocol.errors import (
    AddressInUse,
    BadEndpoint,
    BadKey,
    CannotConnect,
    ChannelClosed,
    MessageTooLarge,
    NoAnswer,
)
from tramnet_protocol.keys import Keys
from tramnet_protocol.limits import MAX_MESSAGE_BYTES, WAIT_BEFORE_CLOSE_SECONDS
from tramnet_protocol.messages import Evaluate, Kind, WorkId
from tramnet_protocol.settings import root_settings
from tramnet_protocol.transport import open_observer, open_root, open_worker

pytestmark = pytest.mark.system

KEYS = Keys("test")
LOOPBACK = ["tcp/127.0.0.1:0"]
PATIENCE = 30.0
CHUNK = Evaluate(WorkId(Kind.EVALUATE, 0, 0, 0, 1), Array.pack(np.zeros((1, 64 * 1024), np.uint8)))


@pytest.fixture
def root():
    with open_root("test", LOOPBACK) as channel:
        yield channel


@pytest.fixture
def worker(root):
    with open_worker(root.endpoint) as channel:
        yield channel


@pytest.fixture
def folder():
    # Not tmp_path, which can be longer than the path of a socket may be.
    with tempfile.TemporaryDirectory(prefix="tramnet-") as name:
        yield Path(name)


@pytest.fixture(params=["unixsock-stream", "ws"])
def observers(request, folder):
    """Where observers attach: on this machine, and from others."""
    return f"unixsock-stream/{folder}/o" if request.param == "unixsock-stream" else free("ws")


def free(protocol):
    """Return an endpoint that nobody listens on."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return f"{protocol}/127.0.0.1:{taken.getsockname()[1]}"


class Collected:
    """What a channel delivers, to be waited for."""

    def __init__(self):
        self._queue = queue.SimpleQueue()

    def put(self, *arguments):
        self._queue.put(arguments)

    def next(self, timeout=PATIENCE):
        return self._queue.get(timeout=timeout)

    def until(self, wanted):
        """Return everything up to what is waited for."""
        seen = [self.next()]
        while seen[-1] != wanted:
            seen.append(self.next())
        return seen


def subscribed(channel, key):
    got = Collected()
    channel.subscribe(key, got.put)
    return got


def watched(channel, key=KEYS.all_alive):
    seen = Collected()
    channel.watch_tokens(key, seen.put)
    return seen


def ready(root, worker, seat):
    """Wait until the root knows what the worker subscribed to before."""
    seen = watched(root, KEYS.alive(seat))
    worker.declare_token(KEYS.alive(seat))
    assert seen.next() == (KEYS.alive(seat), True)


@contextlib.contextmanager
def process(code, *arguments):
    """Run a node in a process of its own, and leave none behind."""
    command = [sys.executable, "-c", code, *arguments]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        try:
            yield child
        finally:
            with contextlib.suppress(ProcessLookupError):
                child.send_signal(signal.SIGCONT)
                child.kill()


HOLDER = """
import sys
from tramnet_protocol.keys import Keys
from tramnet_protocol.transport import open_worker
with open_worker(sys.argv[1]) as channel:
    kept = []
    channel.subscribe(Keys("test").links_to(5), lambda key, payload: None)
    channel.serve(Keys("test").control, lambda query: kept.append(query) or print("asked", flush=True))
    channel.declare_token(Keys("test").alive(5))
    sys.stdin.read()
"""

OBSERVER = """
import queue, sys
from tramnet_protocol.codec import decode
from tramnet_protocol.keys import Keys
from tramnet_protocol.sequences import SequenceChecker
from tramnet_protocol.transport import open_observer
keys = Keys("test")
with open_observer(sys.argv[1]) as channel:
    got = queue.SimpleQueue()
    channel.subscribe(keys.all_links, lambda key, payload: got.put((key, payload)))
    channel.declare_token(keys.alive(9))
    links = SequenceChecker()
    while not links.missed:
        links.arrived(decode(got.get()[1]).header.sequence)
    print(links.missed, flush=True)
    channel.declare_token(keys.alive(10))
    sys.stdin.read()
"""


def numbered(sequence):
    return encode(Header(source=0, destination=1, sequence=sequence), CHUNK)


def accepts(channel: Channel) -> Channel:
    return channel


def test_messages_arrive_in_order_and_in_both_directions(root, worker):
    to_worker, to_root = subscribed(worker, KEYS.links_to(1)), subscribed(root, KEYS.links_to(0))
    ready(root, worker, 1)

    for number in range(200):
        root.publish(KEYS.link(0, 1), b"%d" % number, Lane.LINK)
        worker.publish(KEYS.link(1, 0), b"%d" % number, Lane.LINK)

    assert [to_worker.next() for _ in range(200)] == [
        (KEYS.link(0, 1), b"%d" % number) for number in range(200)
    ]
    assert [to_root.next() for _ in range(200)] == [
        (KEYS.link(1, 0), b"%d" % number) for number in range(200)
    ]


@pytest.mark.parametrize("lane", Lane)
def test_a_message_travels_on_every_lane(root, worker, lane):
    got = subscribed(worker, KEYS.events)
    ready(root, worker, 1)

    root.publish(KEYS.events, b"now", lane)

    assert got.next() == (KEYS.events, b"now")


def test_one_worker_s_frames_do_not_reach_another(root, worker):
    with open_worker(root.endpoint) as other:
        own, foreign = subscribed(worker, KEYS.links_to(1)), subscribed(other, KEYS.links_to(2))
        ready(root, worker, 1)
        ready(root, other, 2)

        root.publish(KEYS.link(0, 1), b"for 1", Lane.LINK)
        root.publish(KEYS.link(0, 2), b"for 2", Lane.LINK)

        assert own.next() == (KEYS.link(0, 1), b"for 1")
        assert foreign.next() == (KEYS.link(0, 2), b"for 2")


def test_workers_talk_to_each_other_through_the_root(root, worker):
    with open_worker(root.endpoint) as other:
        got = subscribed(other, KEYS.links_to(2))
        ready(worker, other, 2)

        worker.publish(KEYS.link(1, 2), b"neighbour", Lane.LINK)

        assert got.next() == (KEYS.link(1, 2), b"neighbour")


def test_the_largest_message_travels_and_a_larger_one_does_not_leave(root, worker):
    got = subscribed(worker, KEYS.links_to(1))
    ready(root, worker, 1)
    largest = os.urandom(MAX_MESSAGE_BYTES)

    with pytest.raises(MessageTooLarge):
        root.publish(KEYS.link(0, 1), largest + b"!", Lane.LINK)
    root.publish(KEYS.link(0, 1), largest, Lane.LINK)

    assert got.next() == (KEYS.link(0, 1), largest)


def test_a_question_is_answered(root, worker):
    asked = Collected()
    root.serve(KEYS.join, lambda query: asked.put(query.payload) or query.reply(b"seat 1"))

    answer = worker.ask(KEYS.join, b"a seat, please", PATIENCE)

    assert answer == b"seat 1"
    assert asked.next() == (b"a seat, please",)


def test_a_question_can_be_answered_later_from_another_thread(root, worker):
    waiting = Collected()
    root.serve(KEYS.join, waiting.put)
    answers = Collected()
    asker = threading.Thread(target=lambda: answers.put(worker.ask(KEYS.join, b"", PATIENCE)))
    asker.start()
    (query,) = waiting.next()
    query.reply(b"at last")
    asker.join(PATIENCE)

    assert answers.next() == (b"at last",)


def test_nobody_answers_where_nobody_serves(worker):
    with pytest.raises(NoAnswer, match="nobody answers"):
        worker.ask(KEYS.join, b"", PATIENCE)


def test_an_answer_that_does_not_come_in_time_is_none(root, worker):
    kept = []
    root.serve(KEYS.join, kept.append)

    with pytest.raises(NoAnswer, match=r"within 0.2 s"):
        worker.ask(KEYS.join, b"", 0.2)


def test_a_question_to_a_process_that_is_killed_ends_at_once(root):
    seen = watched(root)
    with process(HOLDER, root.endpoint) as child:
        assert seen.next() == (KEYS.alive(5), True)
        outcome = Collected()

        def ask():
            try:
                outcome.put(root.ask(KEYS.control, b"", 10 * PATIENCE))
            except NoAnswer as error:
                outcome.put(str(error))

        asker = threading.Thread(target=ask)
        asker.start()
        assert child.stdout.readline() == b"asked\n"
        child.kill()

        (words,) = outcome.next()
        asker.join(PATIENCE)
    assert "nobody answers" in words


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_token_disappears_when_its_process_is_killed(root, number):
    seen = watched(root)
    with process(HOLDER, root.endpoint) as child:
        assert seen.next() == (KEYS.alive(5), True)

        child.send_signal(number)

        assert seen.next() == (KEYS.alive(5), False)


def test_a_process_whose_callbacks_are_declared_ends_by_itself(root):
    with process(HOLDER, root.endpoint) as child:
        child.stdin.close()

        assert child.wait(PATIENCE) == 0


def test_a_token_is_seen_by_those_who_come_later_and_until_it_is_withdrawn(root, worker):
    ready(root, worker, 1)
    seen = watched(root)

    worker.withdraw_token(KEYS.alive(1))

    assert [seen.next(), seen.next()] == [(KEYS.alive(1), True), (KEYS.alive(1), False)]


def test_a_token_disappears_with_its_channel(root):
    seen = watched(root)
    with open_worker(root.endpoint) as channel:
        channel.declare_token(KEYS.alive(1))
        assert seen.next() == (KEYS.alive(1), True)

    assert seen.next() == (KEYS.alive(1), False)


ROOT = """
import sys
from tramnet_protocol.keys import Keys
from tramnet_protocol.transport import open_root
with open_root("test", ["tcp/127.0.0.1:0"]) as channel:
    channel.declare_token(Keys("test").alive(0))
    print(channel.endpoint, flush=True)
    sys.stdin.read()
"""


def test_a_worker_sees_the_token_of_a_killed_root_disappear():
    with process(ROOT) as root:
        endpoint = root.stdout.readline().decode().strip()
        with open_worker(endpoint) as worker:
            seen = watched(worker, KEYS.alive(0))
            assert seen.next() == (KEYS.alive(0), True)

            root.kill()

            assert seen.next() == (KEYS.alive(0), False)


def test_a_worker_connects_again_when_the_root_comes_back():
    with open_root("test", LOOPBACK) as first:
        endpoint = first.endpoint
        worker = open_worker(endpoint)
    with worker:
        seen = watched(worker, KEYS.alive(0))
        with open_root("test", [endpoint]) as second:
            second.declare_token(KEYS.alive(0))

            assert seen.next() == (KEYS.alive(0), True)


def test_a_frozen_worker_that_is_sent_more_than_it_takes_does_not_hold_up_another(root, worker):
    with process(HOLDER, root.endpoint) as frozen:
        seen, got = watched(root), subscribed(worker, KEYS.links_to(1))
        assert seen.next() == (KEYS.alive(5), True)
        ready(root, worker, 1)
        frozen.send_signal(signal.SIGSTOP)
        began = time.monotonic()
        for number in range(300):  # far more than buffers hold
            root.publish(KEYS.link(0, 5), bytes(64 * 1024), Lane.LINK)
            root.publish(KEYS.link(0, 1), bytes([number % 256]), Lane.LINK)
        for _ in range(300):
            got.next()

        assert time.monotonic() - began < 4.0 * WAIT_BEFORE_CLOSE_SECONDS


# Observers.


def test_a_stopped_observer_holds_up_nobody_and_reports_what_it_missed(observers):
    frames = 256
    with (
        open_root("test", LOOPBACK, [observers]) as root,
        open_worker(root.endpoint) as worker,
        process(OBSERVER, root.endpoints[-1]) as observer,
    ):
        seen, got = watched(root), subscribed(worker, KEYS.links_to(1))
        assert seen.next() == (KEYS.alive(9), True)
        ready(root, worker, 1)
        seen.until((KEYS.alive(1), True))

        observer.send_signal(signal.SIGSTOP)
        for number in range(frames):
            root.publish(KEYS.link(0, 1), numbered(number), Lane.LINK)
        arrived = [got.next()[1] for _ in range(frames)]
        observer.send_signal(signal.SIGCONT)
        changes = []
        numbers = itertools.count(frames)
        while (KEYS.alive(10), True) not in changes:
            root.publish(KEYS.link(0, 1), numbered(next(numbers)), Lane.LINK)
            with contextlib.suppress(queue.Empty):
                changes.append(seen.next(timeout=0.05))
        missed = int(observer.stdout.readline())

    assert arrived == [numbered(number) for number in range(frames)]
    assert changes == [(KEYS.alive(10), True)]  # its connection was never closed
    assert 0 < missed < frames


def test_an_observer_hears_everything_said_on_the_network(observers):
    with (
        open_root("test", LOOPBACK, [observers]) as root,
        open_worker(root.endpoint) as worker,
        open_observer(root.endpoints[-1]) as observer,
    ):
        heard = subscribed(observer, KEYS.everything)
        ready(worker, observer, 9)
        ready(root, observer, 10)

        root.publish(KEYS.link(0, 1), b"down", Lane.LINK)
        worker.publish(KEYS.link(1, 0), b"up", Lane.LINK)

        assert {heard.next(), heard.next()} == {
            (KEYS.link(0, 1), b"down"),
            (KEYS.link(1, 0), b"up"),
        }


def test_an_observer_steers_the_network(observers):
    with (
        open_root("test", LOOPBACK, [observers]) as root,
        open_observer(root.endpoints[-1]) as observer,
    ):
        root.serve(KEYS.control, lambda query: query.reply(b"done: " + query.payload))

        assert observer.ask(KEYS.control, b"scale", PATIENCE) == b"done: scale"


def test_observers_of_this_machine_and_of_others_are_both_dropped_for(folder):
    ways = [f"unixsock-stream/{folder}/o", "ws/127.0.0.1:7448"]
    (rule,) = root_settings("test", LOOPBACK, ways)["qos"]["network"]

    assert rule["link_protocols"] == ["unixsock-stream", "ws"]
    assert rule["flows"] == ["egress"]
    assert rule["overwrite"] == {"priority": "background", "congestion_control": "drop"}


def test_observers_may_not_share_a_protocol_with_workers(folder):
    with pytest.raises(BadEndpoint, match="expected a protocol of its own") as caught:
        open_root("test", LOOPBACK, [f"unixsock-stream/{folder}/o", "tcp/127.0.0.1:0"])

    assert caught.value.endpoint == "tcp/127.0.0.1:0"


# Addresses.


def test_a_root_knows_the_port_it_took(root):
    protocol, _, port = root.endpoint.rpartition(":")

    assert protocol == "tcp/127.0.0.1"
    assert int(port) > 0


def test_a_root_that_listens_everywhere_is_reached_from_this_machine():
    with (
        open_root("test", ["tcp/0.0.0.0:0"]) as root,
        open_worker(root.endpoint) as worker,
    ):
        assert root.endpoint.startswith("tcp/127.0.0.1:")
        ready(root, worker, 1)


def test_a_busy_port_is_told_from_other_errors(root):
    with pytest.raises(AddressInUse, match=r"listens at tcp/127\.0\.0\.1:\d+ already") as caught:
        open_root("other", [root.endpoint])

    assert caught.value.endpoint == root.endpoint


def test_a_busy_port_for_observers_is_named():
    observers = free("ws")

    with open_root("test", LOOPBACK, [observers]), pytest.raises(AddressInUse) as caught:
        open_root("other", LOOPBACK, [observers])

    assert caught.value.endpoint == observers


def test_a_busy_socket_is_told_from_a_stale_one(folder):
    observers = f"unixsock-stream/{folder}/o"
    (folder / "o").touch()
    (folder / "o.lock").touch()

    with open_root("test", LOOPBACK, [observers]), pytest.raises(AddressInUse):
        open_root("test", LOOPBACK, [observers])


@pytest.mark.parametrize(
    "endpoint",
    ["", "nonsense", "tcp", "foo/127.0.0.1:0", "tcp/192.0.2.1:0", "tcp/127.0.0.1:port"],
)
def test_an_endpoint_that_cannot_be_listened_on_is_named(endpoint):
    with pytest.raises(BadEndpoint) as caught:
        open_root("test", [endpoint])

    assert caught.value.endpoint == endpoint
    assert ".rs" not in str(caught.value)


def test_a_path_too_long_for_a_socket_is_refused(folder):
    with pytest.raises(BadEndpoint, match="shorter"):
        open_root("test", LOOPBACK, [f"unixsock-stream/{folder}/{'o' * 120}"])


@pytest.mark.parametrize("opens", [open_worker, open_observer])
def test_where_nobody_listens_nobody_connects(opens, root):
    endpoint = root.endpoint
    root.close()

    with pytest.raises(CannotConnect, match="start the root there first") as caught:
        opens(endpoint)

    assert caught.value.endpoint == endpoint
    assert ".rs" not in str(caught.value)


def test_a_name_that_is_none_opens_nothing():
    with pytest.raises(BadKey):
        open_root("no/name", LOOPBACK)


def test_a_closed_channel_says_so(root):
    worker = accepts(open_worker(root.endpoint))
    worker.declare_token(KEYS.alive(1))
    worker.publish(KEYS.events, b"", Lane.LINK)
    worker.close()
    worker.close()
    worker.withdraw_token(KEYS.alive(1))

    for action in (
        lambda: worker.publish(KEYS.events, b"", Lane.LINK),
        lambda: worker.publish(KEYS.stats(1), b"", Lane.LINK),
        lambda: worker.subscribe(KEYS.events, print),
        lambda: worker.declare_token(KEYS.alive(2)),
        lambda: worker.watch_tokens(KEYS.all_alive, print),
        lambda: worker.serve(KEYS.join, print),
        lambda: worker.ask(KEYS.join, b"", 1.0),
    ):
        with pytest.raises(ChannelClosed, match="open another"):
            action()
