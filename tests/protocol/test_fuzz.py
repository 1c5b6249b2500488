import pytest
from benchmarks import fuzz


def test_hostile_bytes_are_understood_or_refused_in_bounded_memory():
    outcomes = fuzz.try_all(fuzz.Inputs(seed=1), range(20_000))

    targets = {outcome.partition(":")[0] for outcome in outcomes}
    assert targets == {"take_frame", "take_body", "take_key", "take_checkpoint"}
    assert outcomes["take_frame: understood"] > 100
    assert outcomes["take_key: understood"] > 100


def test_an_input_that_fails_is_named_and_comes_again(monkeypatch):
    def break_down(_: bytes) -> str:
        raise RuntimeError

    monkeypatch.setattr(fuzz, "take_key", break_down)
    inputs = fuzz.Inputs(seed=1)
    number = next(n for n in range(1000) if inputs(n)[0] is break_down)

    with pytest.raises(
        AssertionError, match=f"input {number} to break_down: {inputs(number)[1].hex()}"
    ):
        fuzz.try_all(inputs, range(number, number + 1))
