"""Watching a running network from other processes, through the observers' endpoint."""

import csv
import io
import itertools
import json
import os
import pty
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from processes import Run, starting, wait_until

from tramnet_master import networks
from tramnet_master.cli import run as run_command
from tramnet_master.errors import NoNetwork
from tramnet_master.traffic.recording import read_recording
from tramnet_protocol.channel import Lane
from tramnet_protocol.codec import Header, encode
from tramnet_protocol.keys import PREFIX, Keys
from tramnet_protocol.messages import Stop
from tramnet_protocol.transport import open_worker

pytestmark = pytest.mark.system

# Ten seconds a hundred generations with one worker: long enough to be looked at.
BUSY = ("run", "problem", "sphere", "--population", 20, "--set", "delay=0.005")


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    """A network that all may watch and nobody ends: what starts commands in it, and its run."""
    with starting(tmp_path_factory.mktemp("network")) as start:
        yield start, begin_run(start)


def begin_run(start) -> Run:
    run = start(*BUSY, "--workers", 2, "--generations", 50_000)
    run.wait_for_workers(2)
    run.wait_for_generation(2)
    return run


def read_objects(text: str) -> list[dict]:
    return [json.loads(line) for line in text.splitlines() if line.startswith("{")]


def test_inspect_tells_of_every_tram_and_link(network):
    start, running = network
    told = start("inspect", "--json", "--sniff")
    shown = start("inspect", "--once")
    rows = start(
        "inspect", "--csv", "--show", "links", "--sort", "bytes_per_s", "--filter", "tram=1"
    )

    assert [told.finish(), shown.finish(), rows.finish()] == [0, 0, 0], told.output + shown.output
    (found,) = read_objects(told.output)
    table = list(csv.DictReader(io.StringIO(rows.output)))

    links = {(0, 1), (0, 2), (1, 0), (2, 0)}
    assert [tram["seat"] for tram in found["trams"]] == [0, 1, 2]
    assert {(link["source"], link["destination"]) for link in found["links"]} == links
    assert all(tram["evaluations"] > 0 for tram in found["trams"])
    assert all(link["frames"] > 0 and link["bytes"] > link["frames"] for link in found["links"])
    assert found["generation"] >= 2
    assert {worker["pid"] for worker in found["workers"]} == set(running.workers())
    assert {(topic["source"], topic["destination"]) for topic in found["topics"]} == links
    assert {tag["tag"] for tag in found["tags"]} == {"evaluate", "evaluated"}
    assert found["sniffing"]["frames"] > 0
    assert "link/0/1" in shown.output
    assert "of 20 Mbd" in shown.output
    assert [row["link"] for row in table] == ["link/0/1", "link/1/0"]


def test_the_live_view_ends_by_q_and_by_ctrl_c(network):
    with Terminal("inspect") as first, Terminal("inspect") as second:
        for view in (first, second):
            view.wait_for("link/0/1")
        first.type("q")
        second.process.send_signal(signal.SIGINT)

        assert [first.finish(), second.finish()] == [0, 0]


class Terminal:
    """A ``tramnet`` command in a terminal of 100 columns and 30 lines."""

    def __init__(self, *words: str) -> None:
        self.output = ""
        self._own, other = pty.openpty()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tramnet_master", *words],
            stdin=other, stdout=other, stderr=other, start_new_session=True,
            env={**os.environ, "TERM": "xterm", "COLUMNS": "100", "LINES": "30"},
        )  # fmt: skip
        os.close(other)

    def wait_for(self, text: str) -> None:
        while text not in self.output:
            self._read()

    def type(self, keys: str) -> None:
        os.write(self._own, keys.encode())

    def finish(self) -> int:
        while self._read():
            pass
        return self.process.wait()

    def _read(self) -> bool:
        try:
            found = os.read(self._own, 65536)
        except OSError:  # the other end is closed
            return False
        self.output += found.decode(errors="replace")
        return bool(found)

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
        os.close(self._own)


def test_echo_prints_decoded_frames_with_their_arrays_cut_short(network):
    start, _ = network
    frames = start("echo", "link/**", "--tag", "evaluate", "--count", 3, "--timeout", 60)
    beats = start("echo", "stats/*", "--tram", 2, "--count", 1, "--timeout", 60)
    events = start("echo", "events", "--count", 1, "--timeout", 60)
    silence = start("echo", "link/7/7", "--timeout", 0.5)

    assert [echo.finish() for echo in (frames, beats, events, silence)] == [0, 0, 0, 1]
    found = read_objects(frames.output)

    assert {frame["tag"] for frame in found} == {"evaluate"}
    assert all(frame["key"].startswith(f"{PREFIX}/tramnet/link/0/") for frame in found)
    genomes = found[0]["message"]["genomes"]
    assert genomes["dtype"] == "<f8"
    assert len(genomes["first"]) == 6
    assert [frame["from"] for frame in read_objects(beats.output)] == [2]
    assert read_objects(events.output)[0]["message"]["name"] == "generation"
    assert "found 0 frames" in silence.output


def test_hostile_and_foreign_bytes_are_shown_and_recorded_as_such(network, tmp_path):
    start, running = network
    echo = start("echo", "link/1/9", "--count", 2, "--timeout", 60)
    record = start("record", tmp_path / "a.mcap", "--key", "link/1/9", "--count", 2)
    wait_until((tmp_path / "a.mcap").exists, "the recorder")
    with open_worker(networks.find().endpoint) as channel:

        def speak() -> bool:
            for payload in (b"\xc1 rubbish", encode(Header(run=1), Stop("go"))):
                channel.publish(Keys("tramnet").link(1, 9), payload, Lane.LINK)
            return echo.ended and record.ended

        wait_until(speak, "two frames to be seen")

    assert [echo.finish(), record.finish()] == [0, 0], echo.output + record.output
    first, second = sorted(read_objects(echo.output), key=lambda frame: "tag" in frame)
    assert first["malformed"]
    assert second["foreign"]
    assert read_recording(tmp_path / "a.mcap").complete
    assert not running.ended


def test_recordings_are_whole_however_the_recorder_or_the_network_ends(start, tmp_path):
    running = begin_run(start)
    names = ("interrupted", "terminated", "killed", "outlived")
    files = {name: tmp_path / f"{name}.mcap" for name in names}
    recorders = {name: start("record", file) for name, file in files.items()}
    wait_until(lambda: all(map(has_a_chunk, files.values())), "a second of traffic in each file")
    for name, number in zip(names, (signal.SIGINT, signal.SIGTERM, signal.SIGKILL), strict=False):
        recorders[name].process.send_signal(number)
    codes = [recorders[name].finish() for name in names[:3]]
    with Terminal("inspect") as view:
        view.wait_for("link/0/1")
        assert start("stop").finish() == 0
        assert view.finish() == 0

    assert "network tramnet has ended" in view.output
    assert codes == [0, 0, -signal.SIGKILL]
    assert recorders["outlived"].finish() == 0
    assert running.finish() == 130
    for name in ("interrupted", "terminated", "outlived"):
        with files[name].open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            summary = reader.get_summary()
            assert summary.chunk_indexes
            assert summary.statistics.message_count == len(list(reader.iter_messages()))
    killed = read_recording(files["killed"])
    assert killed.frames
    assert not killed.complete
    assert run_command(["traffic", str(files["outlived"])]) == 0
    assert (tmp_path / "outlived-space-time.svg").exists()


def has_a_chunk(path: Path) -> bool:
    return path.exists() and bool(read_recording(path).frames)


def longest(rows: list[dict[str, str]]) -> float:
    """Longest time from one row of a history to the next [s]."""
    times = [float(row["elapsed_s"]) for row in rows]
    return max(after - before for before, after in itertools.pairwise(times))


def is_announced() -> bool:
    try:
        return bool(networks.find().pid)
    except NoNetwork:
        return False


def test_observers_that_are_stopped_change_neither_the_time_nor_the_result(start, tmp_path):
    """What an observer holds up it holds up in every round; what the machine does besides, not in all three."""
    busy = (*BUSY[:3], "--population", 100, "--set", "dimension=40", "--generations", 300)
    undisturbed = start(*busy, "--workers", 2, out="undisturbed").result()
    run = start(*busy, "--set", "delay=0.0004", "--workers", 0, out="disturbed")
    wait_until(is_announced, "the network")
    observers = [
        start("inspect", "--follow", "--json"),
        start("inspect", "--follow", "--json", "--sniff"),
        start("echo"),
        start("record", tmp_path / "a.mcap"),
    ]
    for observer in observers[:3]:
        assert observer.process.stdout.readline()  # it is listening
    wait_until((tmp_path / "a.mcap").exists, "the recorder")
    start("scale", 2).finish()
    run.wait_for_generation(60)
    rounds = []
    for _ in range(3):
        rounds.append(run.status()["generation"])
        for observer in observers:
            observer.process.send_signal(signal.SIGSTOP)
        run.wait_for_generation(rounds[-1] + 40)
        for observer in observers:
            observer.process.send_signal(signal.SIGCONT)
        run.wait_for_generation(rounds[-1] + 60)

    result = run.result()

    assert result["final_population_sha256"] == undisturbed["final_population_sha256"]
    with (run.folder / "history.csv").open() as file:
        history = list(csv.DictReader(file))
    usual = longest(history[5 : rounds[0]])
    while_stopped = [longest(history[begin : begin + 40]) for begin in rounds]
    assert min(while_stopped) < usual + 0.05
