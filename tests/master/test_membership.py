import itertools

import pytest

from tramnet_master.farm.events import Tram
from tramnet_master.farm.membership import DUMB, EXPECTED_FOR, MOST_EXPECTED, SILENCE, Membership
from tramnet_protocol.errors import BadTopology
from tramnet_protocol.limits import MAX_ITEMS
from tramnet_protocol.messages import JoinRequest, Stats, Wiring
from tramnet_protocol.topology import shape_named

_PIDS = itertools.count(1000)


def request(pid: int | None = None, supervisor: str = "supervisor") -> JoinRequest:
    pid = next(_PIDS) if pid is None else pid
    return JoinRequest(1, "0.1.0", "f" * 64, "host", pid, supervisor)


def stats(tram: Tram) -> Stats:
    return Stats(tram.seat, tram.incarnation, "idle", 1.0, 0.0, 0.0, 0, 0, 0, 0, (), 7, "host")


@pytest.fixture
def membership() -> Membership:
    return Membership(shape_named("star"), root_incarnation=99)


def test_workers_take_the_lowest_free_seats(membership):
    first, second = membership.admit(request(), 0.0), membership.admit(request(), 0.0)

    assert (first.tram, second.tram) == (Tram(1, 1), Tram(2, 2))


def test_a_worker_is_wired_in_by_its_token_not_while_it_still_compiles(membership):
    membership.admit(request(), 0.0)
    membership.admit(request(), 0.0)

    membership.appeared(2, 0.5)

    assert membership.rewire().edges == ((0, 2),)
    assert membership.wiring.incarnations == {0: 99, 2: 2}


def test_a_seat_is_free_again_only_when_its_token_is_gone(membership):
    membership.admit(request(), 0.0)
    membership.appeared(1, 0.5)

    lost = membership.vanished(1)
    successor = membership.admit(request(), 1.0)

    assert lost is not None
    assert successor.tram == Tram(1, 2)


def test_each_wiring_is_a_new_epoch(membership):
    membership.admit(request(), 0.0)
    membership.appeared(1, 0.5)
    first = membership.rewire()
    membership.vanished(1)

    assert first == Wiring(1, "star", {0: 99, 1: 1}, ((0, 1),))
    assert membership.rewire() == Wiring(2, "star", {0: 99}, ())
    assert membership.wiring.epoch == 2


def test_a_worker_without_heartbeat_is_silent(membership):
    first, second = membership.admit(request(), 0.0), membership.admit(request(), 0.0)
    membership.appeared(1, 10.0)
    membership.appeared(2, 10.0)
    membership.heard(stats(second.tram), 12.0)

    assert membership.silent(10.0 + SILENCE) == frozenset()
    assert membership.silent(13.0) == {first.tram}


def test_a_silent_worker_is_wired_out_and_keeps_its_seat_until_its_token_is_gone(membership):
    member = membership.admit(request(), 0.0)
    membership.appeared(1, 0.5)

    assert membership.expel(member.tram) is member
    assert membership.rewire().incarnations == {0: 99}
    assert membership.live == []
    assert membership.expel(member.tram) is None
    assert membership.admit(request(), 1.0).tram.seat == 2
    assert membership.vanished(1) is None
    assert membership.admit(request(), 1.0).tram.seat == 1


def test_a_shape_that_is_full_admits_nobody():
    membership = Membership(shape_named("hypercube"), root_incarnation=99)
    for _ in range(15):
        membership.admit(request(), 0.0)

    with pytest.raises(BadTopology, match="at most 15; use torus"):
        membership.admit(request(), 0.0)


def test_a_worker_is_live_from_its_token_on(membership):
    member = membership.admit(request(), 0.0)

    assert membership.live == []
    assert membership.appeared(1, 0.5) is member
    assert membership.live == [member]
    assert membership.appeared(1, 0.5) is None
    assert membership.joined == 1


def test_a_token_nobody_was_given_a_seat_for_changes_nothing(membership):
    assert membership.appeared(5, 0.5) is None
    assert membership.vanished(5) is None
    assert membership.wiring.epoch == 0


def test_the_seat_of_a_worker_that_never_appeared_is_given_away_in_the_end(membership):
    membership.admit(request(), 0.0)

    late = membership.admit(request(), EXPECTED_FOR + 1.0)

    assert late.tram == Tram(1, 2)


def test_a_worker_that_fell_silent_on_its_way_leaves_its_seat_to_one_that_finds_no_other(
    membership,
):
    seats = range(1, 3)
    first, second = (membership.admit(request(), 0.0, seats) for _ in seats)
    membership.heard(stats(second.tram), 30.0)

    with pytest.raises(BadTopology, match="all 2 seats"):
        membership.admit(request(), DUMB, seats)
    late = membership.admit(request(), DUMB + 1.0, seats)

    assert late.tram == Tram(first.tram.seat, 3)
    assert membership.find(second.tram) is second


def test_no_seat_is_taken_away_that_nobody_needs(membership):
    first = membership.admit(request(), 0.0)

    late = membership.admit(request(), DUMB + 1.0)

    assert late.tram.seat == 2
    assert membership.find(first.tram) is first


def test_a_question_asked_again_is_a_sign_of_life(membership):
    first = membership.admit(request(7), 0.0, range(1, 2))
    membership.admit(request(7), DUMB, range(1, 2))

    with pytest.raises(BadTopology):
        membership.admit(request(), DUMB + 1.0, range(1, 2))
    assert membership.find(first.tram) is first


def test_processes_of_like_containers_are_told_apart_by_their_supervisors(membership):
    first, second = membership.admit(request(7, "a"), 0.0), membership.admit(request(7, "b"), 0.0)
    membership.appeared(1, 0.0)
    membership.appeared(2, 0.0)

    assert (first.tram, second.tram) == (Tram(1, 1), Tram(2, 2))
    assert second.fresh


def test_whoever_has_another_certificate_is_another_worker(membership):
    first = membership.admit(request(7), 0.0, range(1, 5), "lab")
    other = membership.admit(request(7), 0.0, range(5, 9), "office")

    assert (first.tram.seat, first.name) == (1, "lab")
    assert (other.tram.seat, other.name) == (5, "office")


def test_a_local_process_that_ended_before_its_token_gives_its_seat_back_at_once(membership):
    membership.admit(request(pid=41), 0.0)
    membership.admit(request(pid=42), 0.0)

    membership.abandon(41, "host")

    assert [member.tram.seat for member in membership.members] == [2]


def test_a_heartbeat_counts_for_its_own_incarnation_only(membership):
    member = membership.admit(request(), 0.0)

    membership.heard(stats(Tram(1, 77)), 5.0)
    assert member.stats is None
    membership.heard(stats(member.tram), 6.0)

    assert (member.stats, member.heard) == (stats(member.tram), 6.0)


def test_a_process_that_comes_back_is_not_fresh(membership):
    for pid in (7, 8, 7):
        membership.admit(request(pid), 0.0)
        membership.appeared(1, 0.0)
        lost = membership.vanished(1)
        assert lost is not None
        assert lost.fresh is (lost.tram.incarnation < 3)


def test_a_wiring_never_has_more_links_than_a_message_tells_of():
    membership = Membership(shape_named("torus"), root_incarnation=99)
    while len(membership.members) + 1 < MAX_ITEMS // 2:
        membership.appeared(membership.admit(request(), 0.0).tram.seat, 0.0)

    with pytest.raises(BadTopology, match=r"found 4097 links of a torus .* use tree"):
        membership.admit(request(), 0.0)


def test_a_process_that_did_not_hear_the_answer_is_given_the_same_again(membership):
    first, again = membership.admit(request(7), 0.0), membership.admit(request(7), 1.0)
    membership.appeared(1, 2.0)
    another_life = membership.admit(request(7), 3.0)

    assert again is first
    assert another_life.tram == Tram(2, 2)


def test_whoever_only_asks_cannot_take_all_seats(membership):
    for _ in range(MOST_EXPECTED):
        membership.admit(request(), 0.0)

    with pytest.raises(BadTopology, match="ask again later"):
        membership.admit(request(), 0.0)
    membership.appeared(1, 0.0)
    assert membership.admit(request(), 0.0).tram.seat == MOST_EXPECTED + 1
