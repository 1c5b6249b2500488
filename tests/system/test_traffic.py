"""Watching a running network from other processes, through the observers' endpoint."""

import json
import signal

import pytest

from tramnet_master import networks
from tramnet_protocol.keys import PREFIX

pytestmark = pytest.mark.system

# Five seconds an hundred generations with one worker: long enough to be looked at.
BUSY = ("run", "problem", "sphere", "--population", 20, "--set", "delay=0.005")


@pytest.fixture
def running(start):
    run = start(*BUSY, "--workers", 2, "--generations", 5000)
    run.wait_for_workers(2)
    run.wait_for_generation(2)
    return run


def read_objects(text: str) -> list[dict]:
    return [json.loads(line) for line in text.splitlines() if line.startswith("{")]


def test_inspect_tells_of_every_tram_and_link(start, running):
    inspect = start("inspect", "--json")

    assert inspect.finish() == 0, inspect.output
    (found,) = read_objects(inspect.output)

    assert [tram["seat"] for tram in found["trams"]] == [0, 1, 2]
    assert {(link["source"], link["destination"]) for link in found["links"]} == {
        (0, 1), (0, 2), (1, 0), (2, 0),
    }  # fmt: skip
    assert all(tram["evaluations"] > 0 for tram in found["trams"])
    assert all(link["frames"] > 0 and link["bytes"] > link["frames"] for link in found["links"])
    assert found["generation"] >= 2
    assert {worker["pid"] for worker in found["workers"]} == set(running.workers())


def test_inspect_shows_the_same_to_people(start, running):
    inspect = start("inspect", "--once")

    assert inspect.finish() == 0, inspect.output
    assert "0 → 1" in inspect.output
    assert "of 20 Mbaud" in inspect.output


def test_echo_prints_decoded_frames_with_their_arrays_cut_short(start, running):
    echo = start("echo", "link/0/*", "--count", 3, "--timeout", 60)

    assert echo.finish() == 0, echo.output
    frames = read_objects(echo.output)

    assert len(frames) == 3
    assert {frame["tag"] for frame in frames} == {"evaluate"}
    assert all(frame["key"].startswith(f"{PREFIX}/tramnet/link/0/") for frame in frames)
    genomes = frames[0]["message"]["genomes"]
    assert genomes["dtype"] == "<f8"
    assert len(genomes["first"]) <= 6


def test_echo_hears_heartbeats_and_events_too(start, running):
    beats = start("echo", "stats/*", "--count", 3, "--timeout", 60)
    events = start("echo", "events", "--count", 1, "--timeout", 60)

    assert beats.finish() == 0
    assert events.finish() == 0
    assert {frame["tag"] for frame in read_objects(beats.output)} == {"stats"}
    assert read_objects(events.output)[0]["message"]["name"] == "generation"


def test_a_frozen_observer_holds_nothing_up(start, running):
    echo = start("echo", "**")
    echo.process.stdout.readline()  # it is listening
    echo.process.send_signal(signal.SIGSTOP)
    before = running.status()["generation"]

    running.wait_for_generation(before + 40)

    assert not running.ended


def test_a_network_can_be_stopped_from_elsewhere(start, running):
    assert networks.find().pid == running.pid
    assert start("stop").finish() == 0

    assert running.finish() == 130
    assert list(running.folder.glob("checkpoint-*.tramnet"))
