"""A root among peers that flood, forge and lie about who they are: no result changes and no run ends."""

import pytest
from tests.master.worlds import KEYS, PRINT, ROOT_LIFE, RUN, WORK, Peer, World, answer

from tramnet_master.farm.reception import House
from tramnet_protocol.arrays import Array
from tramnet_protocol.channel import Lane
from tramnet_protocol.messages import (
    PROTOCOL_VERSION,
    ControlRequest,
    Evaluated,
    Failed,
    JoinRequest,
    Refusal,
    Setup,
    Stats,
)


@pytest.fixture
def world() -> World:
    return World()


def test_an_answer_to_work_that_was_given_to_another_is_dropped(world):
    liar = Peer(world, "liar")
    liar.enter(pid=2)
    liar.say(answer(-1e9))
    liar.say(Failed(WORK, "trouble"))
    world.turn()

    assert world.status["dropped"] == {"stranger": 2}
    assert world.finish() == 5.0


def test_an_answer_of_one_who_has_no_seat_is_dropped(world):
    world.stranger.say(answer(-1e9))
    world.turn()

    assert world.status["foreign"] == 1
    assert world.finish() == 5.0


def test_who_says_on_its_own_link_that_it_is_another_is_not_believed(world):
    liar = Peer(world, "liar")
    liar.enter(pid=2)
    for seat in (liar.seat, world.stranger.seat):
        liar.say(
            answer(-1e9),
            key=KEYS.link(seat, 0),
            source=world.honest.seat,
            source_incarnation=world.honest.life,
        )
    world.turn()

    assert world.status["foreign"] == 2
    assert world.finish() == 5.0


@pytest.mark.parametrize(
    "changes",
    [
        {"run": RUN + 1},
        {"destination_incarnation": ROOT_LIFE - 1},
        {"destination": 3},
        {"source_incarnation": 99},
        {"epoch": 10_000, "run": RUN - 1},
    ],
)
def test_a_frame_of_another_run_or_life_changes_nothing(world, changes):
    world.honest.say(answer(-1e9), **changes)
    world.turn()

    status = world.status
    assert status["foreign"] + sum(status["dropped"].values()) == 1
    assert world.finish() == 5.0


def test_an_answer_that_comes_twice_counts_once(world):
    assert world.finish() == 5.0

    world.honest.say(answer(-1e9))
    world.turn()

    assert world.status["dropped"] == {"closed": 1}


@pytest.mark.parametrize(
    "payload",
    [b"", b"\xc1", bytes(5000), b"\x92\x63\xc0", b"\x91" * 100_000, b"\xdd\xff\xff\xff\xff"],
    ids=["nothing", "noise", "zeros", "another version", "deep", "long"],
)
def test_what_is_no_frame_is_counted(world, payload):
    world.honest.channel.publish(KEYS.link(1, 0), payload, Lane.LINK)
    world.honest.channel.publish(KEYS.stats(1), payload, Lane.TELEMETRY)
    world.turn()

    assert world.status["malformed"] == 2
    assert world.finish() == 5.0


def test_a_flood_is_dropped_beyond_its_credit_and_holds_nobody_else_up(world):
    payload = world.stranger.frame(answer(-1e9)) + bytes(1000)
    for number in range(20_000):
        key = KEYS.link(number % 4093 + 2, 0)  # however many links it says it has
        world.stranger.channel.publish(key, payload, Lane.LINK)

    assert world.status["over_credit"] > 15_000
    assert world.finish() == 5.0


def test_tokens_of_those_who_have_no_seat_are_counted(world):
    for key in (KEYS.alive(40), "tramnet/v1/lab/alive/nobody", "tramnet/v1/lab/alive/-1"):
        world.stranger.channel.declare_token(key)
    world.turn()

    assert world.status["foreign"] == 3
    assert [worker["live"] for worker in world.status["workers"]] == [True]
    assert world.finish() == 5.0


def test_a_heartbeat_in_another_s_name_changes_nothing(world):
    stats = Stats(5, 1, "idle", 1.0, 0.0, 0.0, 0, 0, 0, 0, (), 7, "host")
    world.stranger.say(stats, key=KEYS.stats(1))
    world.turn()

    assert world.status["workers"][0]["heard_ago"] is None
    assert world.finish() == 5.0


def test_whoever_asks_for_nonsense_is_refused_in_words(world):
    for key, message, words in (
        (KEYS.join, ControlRequest("stop"), "expected a JoinRequest"),
        (
            KEYS.control,
            JoinRequest(PROTOCOL_VERSION, "0", PRINT, "h", 3, "s"),
            "expected a ControlRequest",
        ),
        (KEYS.join, JoinRequest(99, "9", PRINT, "h", 3, "s"), "found protocol version 99"),
        (KEYS.join, JoinRequest(PROTOCOL_VERSION, "0", "0" * 64, "h", 3, "s"), "fingerprint"),
    ):
        refusal = world.stranger.ask(key, message)
        assert isinstance(refusal, Refusal)
        assert words in refusal.reason
        assert refusal.final

    assert world.status["refused"] == 3
    assert world.finish() == 5.0


def test_a_seat_is_given_to_a_name_of_its_range_only():
    world = World()
    house = House(
        RUN, ROOT_LIFE, Setup("sphere", {}), PRINT, seats={"lab-2": range(9, 11), "lab-3": range(20, 21)}
    )  # fmt: skip
    world.farm.reception.__init__(house, world.farm.membership)
    peer = world.stranger

    seats = [peer.join(pid, KEYS.join_as("lab-2")).seat for pid in (11, 12)]
    full, unknown, nameless = (
        peer.join(13, key) for key in (KEYS.join_as("lab-2"), KEYS.join_as("lab-4"), KEYS.join)
    )

    assert seats == [9, 10]
    assert peer.join(14, KEYS.join_as("lab-3")).seat == 20
    assert "all 2 seats from 9 to 10 taken" in full.reason
    assert not full.final
    assert "no seat is for lab-4" in unknown.reason
    assert "no seat is for the nameless" in nameless.reason


def test_an_array_that_says_it_is_larger_than_any_ends_no_run(world):
    huge = Array("<f8", (0, 2**22, 2**22, 2**22), b"")
    world.stranger.say(Evaluated(WORK, huge, 0.001), key=KEYS.link(1, 0))
    liar = Peer(world, "liar")
    liar.enter(pid=2)
    liar.say(Evaluated(WORK, huge, 0.001))
    world.turn()

    assert world.status["dropped"] == {"stranger": 2}
    assert world.finish() == 5.0
