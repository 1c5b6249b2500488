from hypothesis import given
from hypothesis import strategies as st

from tramnet_protocol.credit import MESSAGE_COST, ReceiveCredit
from tramnet_protocol.limits import CREDIT_BYTES


def test_a_source_beyond_its_credit_is_dropped_and_counted_and_others_are_not():
    credit = ReceiveCredit(limit=1000)
    admitted = [credit.admit("a", 400) for _ in range(4)]

    assert admitted == [True, True, False, False]
    assert credit.admit("b", 400)
    assert credit.dropped == {"a": 2}


def test_what_is_taken_out_gives_credit_back():
    credit = ReceiveCredit(limit=1000)
    credit.admit("a", 800)

    credit.release("a", 800)

    assert credit.admit("a", 800)


def test_one_message_above_the_credit_may_wait_alone():
    credit = ReceiveCredit(limit=1000)

    assert credit.admit("a", 100_000)
    assert not credit.admit("a", 1)


@given(st.lists(st.integers(0, CREDIT_BYTES), max_size=50))
def test_a_sender_within_its_credit_is_never_dropped(sizes):
    credit = ReceiveCredit()
    waiting = []
    for size in sizes:
        while sum(waiting) + size > CREDIT_BYTES or len(waiting) * MESSAGE_COST > CREDIT_BYTES:
            credit.release("a", waiting.pop(0))
        assert credit.admit("a", size)
        waiting.append(size)

    assert credit.dropped == {}


def test_empty_messages_are_bounded_too():
    credit = ReceiveCredit(limit=64 * MESSAGE_COST)

    admitted = sum(credit.admit("a", 0) for _ in range(1000))

    assert admitted == 64
