import signal
from pathlib import Path

import pytest

from tramnet_master.experiments.runner import CheckpointsDue, RunOptions
from tramnet_master.signals import ending, interrupting


def test_checkpoints_are_due_by_time_unless_generations_are_counted():
    by_time = CheckpointsDue(RunOptions(checkpoint_seconds=1.0), 0.0)
    counted = CheckpointsDue(RunOptions(checkpoint_generations=10), 0.0)

    times = [round(0.3 * g, 1) for g in range(1, 31) if by_time.after(g, 0.3 * g)]

    assert times == [1.2, 2.4, 3.6, 4.8, 6.0, 7.2, 8.4]
    assert [g for g in range(1, 31) if counted.after(g, 0.3 * g)] == [10, 20, 30]


def test_by_default_nothing_listens_beyond_this_machine():
    assert RunOptions().endpoint == "tcp/127.0.0.1:0"
    assert RunOptions(tls=Path("folder")).endpoint == "tls/127.0.0.1:0"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_the_first_signal_asks_to_end_and_the_second_interrupts(number):
    asked: list[str] = []
    with ending(lambda: asked.append("end")):
        signal.raise_signal(number)
        assert asked == ["end"]
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)

    assert asked == ["end"]


def test_a_hangup_that_is_ignored_stays_so():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with interrupting(), ending(lambda: pytest.fail("it was not ignored")):
            signal.raise_signal(signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
