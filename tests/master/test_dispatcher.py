"""The farm's loop: what it reads before it judges, and whom it asks for what."""

import time

import numpy as np
import pytest
from tests.master.worlds import KEYS, WORK, Peer, World, answer

from tramnet_master.farm.events import Tram
from tramnet_protocol.arrays import Array
from tramnet_protocol.codec import decode
from tramnet_protocol.messages import Evaluated, Event, Stats


@pytest.fixture
def clock(monkeypatch):
    """A clock that jumps when told to, as for a root that was held up."""
    real, ahead = time.monotonic, [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: real() + ahead[0])

    def jump(seconds: float) -> None:
        ahead[0] += seconds

    return jump


def heartbeat(peer: Peer) -> None:
    stats = Stats(peer.seat, peer.life, "busy", 1.0, 0.0, 0.0, 0, 0, 0, 0, (), 1, "host")
    peer.say(stats, key=KEYS.stats(peer.seat))


def test_a_root_that_was_held_up_reads_what_was_said_in_time_before_it_looks_at_deadlines(clock):
    world = World()
    world.turn()
    heartbeat(world.honest)
    world.honest.say(answer(5.0))
    clock(100.0)

    finished = world.farm.next_outcome()

    assert isinstance(finished.outcome, Evaluated)
    assert world.replaced == []


def test_what_reaches_a_root_a_moment_after_it_was_stopped_is_in_time(clock):
    world = World()
    world.turn()
    clock(100.0)
    world.farm.wait_for(lambda: False, 0.1)  # nothing has come through the sockets yet
    heartbeat(world.honest)

    assert world.replaced == []
    assert world.finish() == 5.0


def test_a_root_that_is_held_up_again_and_again_looks_at_deadlines_all_the_same(clock):
    world = World()
    for _ in range(100):
        clock(10.0)
        heartbeat(world.honest)
        world.turn()

    assert world.replaced


def test_a_replacement_is_asked_for_until_the_token_is_gone(clock):
    world = World()
    asked: list[int] = []

    def listen(_: str, payload: bytes) -> None:
        message = decode(payload).message()
        if isinstance(message, Event) and message.name == "replace":
            asked.append(message.detail["pid"])

    world.stranger.channel.subscribe(KEYS.events, listen)
    world.turn()
    clock(100.0)
    world.turn_until(lambda: len(asked) >= 2)
    world.honest.leave()
    world.turn_until(lambda: not world.farm.membership.members)
    told = len(asked)
    clock(2.0)
    world.farm.wait_for(lambda: False, 0.1)

    assert set(asked) == {1}
    assert len(asked) == told


def test_a_liar_that_has_left_is_found_out_by_what_it_said_last():
    honest = Evaluated(WORK, Array.pack(np.array([5.0])), 0.001)
    world = World(recompute=lambda _: (honest, None))
    liar = Tram(world.honest.seat, world.honest.life)
    world.honest.leave()
    world.turn_until(lambda: not world.farm.membership.members)
    world.honest.say(answer(-1e9))

    world.farm.next_outcome()

    assert world.farm.liars == {liar}
    assert list(world.farm.expelled) == [liar]
