import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.channel import Channel, Lane
from tramnet_protocol.errors import ChannelClosed, MessageTooLarge, NoAnswer
from tramnet_protocol.faults import Fault
from tramnet_protocol.keys import Keys
from tramnet_protocol.limits import MAX_MESSAGE_BYTES
from tramnet_protocol.loopback import LoopbackNetwork

KEYS = Keys("test")
LINK = KEYS.link(0, 1)


def joined(network):
    """Return the channels of a root and a worker, and what the worker receives on its link."""
    root, worker = network.open("root"), network.open("worker")
    got = []
    worker.subscribe(KEYS.links_to(1), lambda key, payload: got.append((key, payload)))
    return root, worker, got


def send(channel, count, key=LINK):
    for number in range(count):
        channel.publish(key, number.to_bytes(2, "big"), Lane.LINK)


def numbers(got):
    return [int.from_bytes(payload, "big") for _, payload in got]


def accepts(channel: Channel) -> Channel:
    return channel


def test_a_loopback_channel_is_a_channel():
    assert accepts(LoopbackNetwork().open("a")).closed is False


def test_a_message_reaches_whoever_subscribes_to_its_key():
    network = LoopbackNetwork()
    root, _, got = joined(network)

    root.publish(LINK, b"for 1", Lane.LINK)
    root.publish(KEYS.link(0, 2), b"for 2", Lane.LINK)

    assert got == [(LINK, b"for 1")]


def test_a_channel_hears_what_it_says_itself():
    network = LoopbackNetwork()
    _, worker, got = joined(network)

    worker.publish(LINK, b"own", Lane.LINK)

    assert got == [(LINK, b"own")]


def test_on_a_stepwise_network_nothing_arrives_before_its_step():
    network = LoopbackNetwork(stepwise=True)
    root, worker, got = joined(network)
    worker.subscribe(LINK, lambda key, payload: worker.publish(KEYS.link(1, 0), payload, Lane.LINK))
    answers = []
    root.subscribe(KEYS.links_to(0), lambda key, payload: answers.append(payload))

    root.publish(LINK, b"x", Lane.LINK)
    assert (got, answers) == ([], [])
    network.deliver()
    assert (len(got), answers) == (1, [])
    network.deliver()
    assert (len(got), answers) == (1, [b"x"])
    assert network.deliver() == 0


@given(
    st.integers(0, 2**32), st.floats(0, 1), st.floats(0, 1), st.integers(0, 5), st.integers(0, 5)
)
def test_the_same_seed_brings_the_same_fate(seed, drop, duplicate, delay, reorder):
    def story():
        fault = Fault(KEYS.all_links, drop, duplicate, delay, reorder)
        network = LoopbackNetwork([fault], seed, stepwise=True)
        root, _, got = joined(network)
        send(root, 30)
        network.settle()
        return numbers(got)

    assert story() == story()


def test_the_fate_of_a_link_does_not_depend_on_what_others_carry():
    fault = Fault(KEYS.all_links, drop=0.5)
    quiet, busy = LoopbackNetwork([fault], 7), LoopbackNetwork([fault], 7)
    root, _, got = joined(quiet)
    busy_root, _, busy_got = joined(busy)

    send(root, 50)
    for number in range(50):
        busy_root.publish(KEYS.link(0, 2), b"", Lane.LINK)
        busy_root.publish(LINK, number.to_bytes(2, "big"), Lane.LINK)

    assert numbers(got) == numbers(busy_got)
    assert 0 < len(got) < 50


@given(st.integers(0, 2**32), st.floats(0, 1))
def test_dropped_messages_leave_gaps_and_nothing_else(seed, drop):
    network = LoopbackNetwork([Fault(KEYS.all_links, drop=drop)], seed)
    root, _, got = joined(network)

    send(root, 40)

    assert numbers(got) == sorted(set(numbers(got)))
    assert len(got) == (40 if drop == 0 else 0 if drop == 1 else len(got))


def test_duplicated_messages_arrive_twice():
    network = LoopbackNetwork([Fault(KEYS.all_links, duplicate=1.0)])
    root, _, got = joined(network)

    send(root, 3)

    assert numbers(got) == [0, 0, 1, 1, 2, 2]


def test_delayed_messages_wait_their_steps_in_order():
    network = LoopbackNetwork([Fault(LINK, delay=2)])
    root, _, got = joined(network)

    send(root, 3)
    seen = []
    for _ in range(3):
        network.deliver()
        seen.append(len(got))

    assert seen == [0, 0, 3]
    assert numbers(got) == [0, 1, 2]


@given(st.integers(0, 2**32))
def test_reordered_messages_all_arrive(seed):
    network = LoopbackNetwork([Fault(LINK, reorder=6)], seed, stepwise=True)
    root, _, got = joined(network)

    send(root, 60)
    network.settle()

    assert sorted(numbers(got)) == list(range(60))
    assert numbers(got) != list(range(60))


def test_the_first_fault_that_matches_is_the_only_one():
    network = LoopbackNetwork([Fault(LINK), Fault(KEYS.all_links, drop=1.0)])
    root, _, got = joined(network)

    send(root, 5)

    assert len(got) == 5


def test_nothing_reaches_or_leaves_a_node_that_is_cut_and_its_tokens_stand():
    network = LoopbackNetwork(stepwise=True)
    root, worker, got = joined(network)
    seen, answers = [], []
    root.watch_tokens(KEYS.all_alive, lambda key, alive: seen.append((key, alive)))
    root.subscribe(KEYS.links_to(0), lambda key, payload: answers.append(payload))
    worker.declare_token(KEYS.alive(1))
    network.settle()

    send(root, 2)  # on its way when the cable breaks
    network.cut("worker")
    send(worker, 2, KEYS.link(1, 0))
    network.settle()
    assert (got, answers, seen) == ([], [], [(KEYS.alive(1), True)])

    network.heal("worker")
    send(root, 1)
    network.settle()
    assert numbers(got) == [0]


def test_tokens_are_seen_by_those_who_came_before_and_after():
    network = LoopbackNetwork()
    root, worker, late = network.open("root"), network.open("worker"), network.open("late")
    early_view, late_view = [], []

    root.watch_tokens(KEYS.all_alive, lambda *change: early_view.append(change))
    worker.declare_token(KEYS.alive(1))
    late.watch_tokens(KEYS.all_alive, lambda *change: late_view.append(change))
    worker.withdraw_token(KEYS.alive(1))
    worker.withdraw_token(KEYS.alive(1))

    story = [(KEYS.alive(1), True), (KEYS.alive(1), False)]
    assert early_view == story
    assert late_view == story


@pytest.mark.parametrize("ending", ["close", "kill", "lose"])
def test_tokens_disappear_however_a_node_ends(ending):
    network = LoopbackNetwork()
    root, worker = network.open("root"), network.open("worker")
    view = []
    root.watch_tokens(KEYS.all_alive, lambda *change: view.append(change))
    worker.declare_token(KEYS.alive(1))

    match ending:
        case "close":
            worker.close()
        case "kill":
            network.kill("worker")
        case "lose":
            network.lose_tokens("worker")

    assert view == [(KEYS.alive(1), True), (KEYS.alive(1), False)]


def test_lost_tokens_come_back():
    network = LoopbackNetwork()
    root, worker = network.open("root"), network.open("worker")
    view = []
    root.watch_tokens(KEYS.all_alive, lambda key, alive: view.append(alive))
    worker.declare_token(KEYS.alive(1))

    network.lose_tokens("worker")
    late = []
    network.open("late").watch_tokens(KEYS.all_alive, lambda key, alive: late.append(alive))
    network.restore_tokens("worker")

    assert view == [True, False, True]
    assert late == [True]


def test_a_killed_node_says_nothing_more_and_may_come_back():
    network = LoopbackNetwork(stepwise=True)
    root, worker, _ = joined(network)
    got = []
    root.subscribe(KEYS.links_to(0), lambda key, payload: got.append(payload))

    worker.publish(KEYS.link(1, 0), b"last words", Lane.LINK)
    network.kill("worker")
    network.settle()
    assert got == []
    with pytest.raises(ChannelClosed):
        worker.publish(KEYS.link(1, 0), b"ghost", Lane.LINK)

    network.open("worker").publish(KEYS.link(1, 0), b"again", Lane.LINK)
    network.settle()
    assert got == [b"again"]


def test_a_question_is_answered_from_another_thread():
    network = LoopbackNetwork()
    root, worker = network.open("root"), network.open("worker")

    def answer(query):
        threading.Thread(target=query.reply, args=(query.payload.upper(),)).start()

    root.serve(KEYS.join, answer)

    assert worker.ask(KEYS.join, b"seat?", 10.0) == b"SEAT?"


def test_a_question_to_nobody_has_no_answer():
    network = LoopbackNetwork()
    root, worker = network.open("root"), network.open("worker")

    with pytest.raises(NoAnswer, match="nobody"):
        worker.ask(KEYS.join, b"", 10.0)
    root.serve(KEYS.join, lambda query: None)
    with pytest.raises(NoAnswer, match="within 0 s"):
        worker.ask(KEYS.join, b"", 0.0)
    network.cut("root")
    with pytest.raises(NoAnswer, match="nobody"):
        worker.ask(KEYS.join, b"", 10.0)


def test_a_closed_channel_says_so():
    network = LoopbackNetwork()
    with network.open("worker") as worker:
        pass
    worker.close()

    for action in (
        lambda: worker.publish(LINK, b"", Lane.LINK),
        lambda: worker.subscribe(LINK, print),
        lambda: worker.declare_token(KEYS.alive(1)),
        lambda: worker.watch_tokens(KEYS.all_alive, print),
        lambda: worker.serve(KEYS.join, print),
        lambda: worker.ask(KEYS.join, b"", 1.0),
    ):
        with pytest.raises(ChannelClosed, match="open another"):
            action()


def test_a_message_above_the_limit_does_not_leave():
    network = LoopbackNetwork()
    root, worker, got = joined(network)
    root.serve(KEYS.join, lambda query: query.reply(bytes(MAX_MESSAGE_BYTES + 1)))

    with pytest.raises(MessageTooLarge):
        root.publish(LINK, bytes(MAX_MESSAGE_BYTES + 1), Lane.LINK)
    with pytest.raises(MessageTooLarge):
        worker.ask(KEYS.join, bytes(MAX_MESSAGE_BYTES + 1), 1.0)
    with pytest.raises(MessageTooLarge):
        worker.ask(KEYS.join, b"", 1.0)
    assert got == []


def test_two_nodes_that_talk_for_ever_are_found_out():
    network = LoopbackNetwork(stepwise=True)
    node = network.open("node")
    node.subscribe(LINK, lambda key, payload: node.publish(LINK, payload, Lane.LINK))
    node.publish(LINK, b"", Lane.LINK)

    with pytest.raises(AssertionError, match="not silent after 50 steps"):
        network.settle(limit=50)
