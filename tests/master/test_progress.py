import io
import json
import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from tramnet_master.progress import (
    Counts,
    JsonProgress,
    LineProgress,
    Outline,
    ProgressMode,
    QuietProgress,
    duration,
    open_progress,
    plural,
)
from tramnet_master.terminal_progress import TerminalProgress, short


class HandClock:
    """A clock that goes when it is told to."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def pass_by(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture
def clock() -> HandClock:
    return HandClock()


@pytest.fixture
def stream() -> io.StringIO:
    return io.StringIO()


def objects(stream: io.StringIO) -> list[dict[str, object]]:
    return [json.loads(line) for line in stream.getvalue().splitlines()]


def test_json_lines_tell_start_progress_message_and_finish(stream, clock):
    progress = JsonProgress(stream, clock=clock)

    progress.start(Outline("puma560 case 1", 300))
    clock.pass_by(2.0)
    progress.update(100, 0.43, 10_000, 2)
    progress.message("worker 2 was lost")
    progress.finish("done")

    assert objects(stream) == [
        {"event": "start", "title": "puma560 case 1", "generations": 300, "first": 0}
        | {"evaluations": 0},
        {
            "event": "progress",
            "generation": 100,
            "generations": 300,
            "best": 0.43,
            "evaluations": 10_000,
            "evaluations_per_second": 5000.0,
            "workers": 2,
            "seconds_left": 4.0,
        },
        {"event": "message", "text": "worker 2 was lost"},
        {"event": "finish", "text": "done"},
    ]


def test_fifty_thousand_generations_in_a_minute_are_shown_ten_times_a_second(stream, clock):
    progress = JsonProgress(stream, clock=clock)
    progress.start(Outline("case 7", 50_000))

    for generation in range(1, 50_001):
        clock.pass_by(60 / 50_000)
        progress.update(generation, 1.0, generation * 100, 1)
    progress.finish()

    shown = [line["generation"] for line in objects(stream) if line["event"] == "progress"]
    assert 590 <= len(shown) <= 601
    assert shown[-1] == 50_000
    assert all(a < b for a, b in pairwise(shown))


def test_the_last_state_is_always_shown(stream, clock):
    progress = JsonProgress(stream, clock=clock)
    progress.start(Outline("case 1", 3))
    for generation in (1, 2, 3):
        progress.update(generation, 1.0, generation, 1)

    progress.finish()

    shown = [line["generation"] for line in objects(stream) if line["event"] == "progress"]
    assert shown == [3]


def test_a_best_that_is_not_a_number_is_null_in_json(stream, clock):
    progress = JsonProgress(stream, clock=clock)
    progress.start(Outline("case 1", 3))

    progress.update(0, math.nan, 0, 0)
    progress.finish()

    assert objects(stream)[1]["best"] is None


def test_finishing_twice_says_it_once(stream, clock):
    progress = JsonProgress(stream, clock=clock)
    progress.start(Outline("case 1", 3))

    progress.finish("done")
    progress.finish("done")

    assert [line["event"] for line in objects(stream)] == ["start", "finish"]


def test_plain_lines_come_every_five_seconds(stream, clock):
    progress = LineProgress(stream, clock=clock)
    progress.start(Outline("puma560 case 1", 300))

    for generation in range(1, 13):
        clock.pass_by(1.0)
        progress.update(generation, 0.5, generation * 1000, 1)
    progress.finish("case 1: 0.427 s")

    assert stream.getvalue().splitlines() == [
        "puma560 case 1: 300 generations",
        "generation 5/300, best 0.5, 1,000 evaluations/s, 1 worker, 4 min 55 s left",
        "generation 10/300, best 0.5, 1,000 evaluations/s, 1 worker, 4 min 50 s left",
        "generation 12/300, best 0.5, 1,000 evaluations/s, 1 worker, 4 min 48 s left",
        "case 1: 0.427 s",
    ]


def test_the_rates_of_a_resumed_run_leave_out_what_was_done_before(clock):
    counts = Counts(Outline("case 7", 300, first=100, evaluations=10_000), clock)
    counts.generation, counts.evaluations = 200, 20_000
    clock.pass_by(10.0)

    assert counts.rates() == (1000.0, 10.0)


def test_nobody_knows_the_time_left_before_the_first_generation(clock):
    counts = Counts(Outline("case 1", 300), clock)
    clock.pass_by(1.0)

    assert counts.rates() == (0.0, None)


def test_quiet_shows_nothing(capsys):
    progress = open_progress(ProgressMode.QUIET)

    progress.start(Outline("case 1", 3))
    progress.update(1, 1.0, 1, 1)
    progress.message("worker 2 was lost")
    progress.finish("done")

    assert isinstance(progress, QuietProgress)
    assert capsys.readouterr() == ("", "")


def test_a_pipe_gets_plain_lines_on_standard_error(capsys):
    progress = open_progress(ProgressMode.AUTO)

    progress.start(Outline("case 1", 3))
    progress.finish("done")

    assert capsys.readouterr() == ("", "case 1: 3 generations\ndone\n")


def test_json_lines_go_to_standard_output(capsys):
    progress = open_progress(ProgressMode.JSON)

    progress.message("worker 2 was lost")

    assert capsys.readouterr() == ('{"event":"message","text":"worker 2 was lost"}\n', "")


def drawn(progress: TerminalProgress, width: int) -> str:
    console = Console(file=io.StringIO(), width=width, force_terminal=False)
    with console.capture() as capture:
        console.print(progress.render())
    return capture.get()


@pytest.fixture
def terminal(clock) -> TerminalProgress:
    return TerminalProgress(Console(file=io.StringIO(), force_terminal=True, width=100), clock)


def test_the_bar_shows_generation_best_rate_workers_and_time_left(terminal, clock):
    terminal.start(Outline("puma560 case 1", 300))
    terminal.update(100, 0.426931, 104_600, 2)
    clock.pass_by(2.0)

    line = drawn(terminal, 100)
    terminal.finish()

    for fact in ("puma560 case 1", "100/300", "best 0.42693", "52.3k eval/s", "2 workers", "4 s"):
        assert fact in line
    assert line.count("\n") == 1


@pytest.mark.parametrize("width", [40, 60, 80, 100, 200])
def test_the_bar_fits_on_one_line_of_the_terminal(clock, width):
    console = Console(file=io.StringIO(), force_terminal=True, width=width)
    terminal = TerminalProgress(console, clock)
    terminal.start(Outline("redundant8 arm", 50_000))
    clock.pass_by(3.0)
    terminal.update(12_345, 0.426931, 104_600, 12)

    line = drawn(terminal, width)
    terminal.finish()

    assert line.count("\n") == 1
    assert "12345/50000" in line
    assert "best 0.42693" in line


def test_the_bar_says_that_it_waits_for_workers(terminal):
    terminal.start(Outline("puma560 case 1", 300))

    line = drawn(terminal, 100)
    terminal.finish()

    assert "waiting for workers" in line


def test_messages_and_the_end_stay_on_the_terminal(clock):
    shown = io.StringIO()
    terminal = TerminalProgress(Console(file=shown, force_terminal=True, width=100), clock)

    terminal.start(Outline("puma560 case 1", 300))
    terminal.message("worker 2 was lost [seat 2]")
    terminal.finish("case 1: 0.427 s")
    terminal.finish("case 1: 0.427 s")

    assert "worker 2 was lost [seat 2]" in shown.getvalue()
    assert shown.getvalue().count("case 1: 0.427 s") == 1


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0, "0 s"), (59.4, "59 s"), (59.6, "1 min 00 s"), (125, "2 min 05 s"), (3780, "1 h 03 min")],
)
def test_durations_are_written_as_people_write_them(seconds, words):
    assert duration(seconds) == words


@pytest.mark.parametrize(
    ("rate", "words"), [(0, "0"), (950, "950"), (52_345, "52.3k"), (1_234_567, "1.23M")]
)
def test_rates_are_written_in_three_digits(rate, words):
    assert short(rate) == words


@given(st.integers(0, 10**6))
def test_only_one_of_a_thing_is_singular(number):
    assert (plural("worker", number) == "worker") == (number == 1)
