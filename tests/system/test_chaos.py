import pytest
from benchmarks import chaos

pytestmark = [pytest.mark.system, pytest.mark.slow]


def test_a_minute_of_kills_freezes_and_joins_changes_nothing(monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", "")  # put back after the test

    assert chaos.run(seconds=60.0, kills=8, seed=2, workers=4)
