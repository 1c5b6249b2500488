"""Round trip of a raw Zenoh message between two processes: published, and published back.

Both sides receive by a callback into a queue. This is the floor for all that tramnet does over the network:
``python -m benchmarks.round_trip`` prints it, and other benchmarks measure it in the same run to state their own
times as ratios.
"""

import json
import queue
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import zenoh

from tramnet_protocol.settings import client_settings, root_settings

_OUT = "tramnet-bench/out"
_BACK = "tramnet-bench/back"
_PATIENCE_SECONDS = 20.0


class RoundTrip(NamedTuple):
    """What a round trip takes.

    Attributes:
        median_us: Median [us].
        p99_us: 99th percentile [us].
        rounds: Number of round trips measured.
        size: Length of the payload [B].
    """

    median_us: float
    p99_us: float
    rounds: int
    size: int


def measure(rounds: int = 2000, size: int = 1024, warm_up: int = 200) -> RoundTrip:
    """Measure round trips between this process and an echoing one, over loopback TCP.

    Args:
        rounds: Number of round trips measured.
        size: Length of the payload [B].
        warm_up: Number of round trips before them.
    """
    with echoing(size) as round_trip:
        times = [round_trip(bytes(size)) for _ in range(warm_up + rounds)]
    return _summary(times[warm_up:], size)


@contextmanager
def echoing(answer_size: int) -> Iterator[Callable[[bytes], float]]:
    """Keep an echoing process; yield what sends it a payload and returns the time until the answer [us].

    Args:
        answer_size: Length of what the process sends back [B].
    """
    settings = root_settings("bench", ["tcp/127.0.0.1:0"], ())
    with zenoh.open(zenoh.Config.from_json5(json.dumps(settings))) as session:
        arrived = _queue(session, _BACK)
        publisher = _publisher(session, _OUT)
        with subprocess.Popen(
            [sys.executable, str(Path(__file__)), "echo", _own_endpoint(session), f"{answer_size}"],
            stdin=subprocess.PIPE,
        ) as echo:
            try:
                assert arrived.get(timeout=_PATIENCE_SECONDS) == b"ready"
                yield lambda payload: _once(publisher, arrived, payload)
            finally:
                assert echo.stdin is not None
                echo.stdin.close()


def _once(publisher: zenoh.Publisher, arrived: "queue.SimpleQueue[bytes]", payload: bytes) -> float:
    start = time.perf_counter()
    publisher.put(payload)
    arrived.get(timeout=_PATIENCE_SECONDS)
    return (time.perf_counter() - start) * 1e6


def _summary(times: list[float], size: int) -> RoundTrip:
    p99 = statistics.quantiles(times, n=100)[98]
    return RoundTrip(statistics.median(times), p99, len(times), size)


def _echo(endpoint: str, answer_size: int) -> None:
    """Answer whatever arrives, until the standard input ends."""
    settings = client_settings("bench echo", endpoint)
    with zenoh.open(zenoh.Config.from_json5(json.dumps(settings))) as session:
        messages: queue.SimpleQueue[bytes] = _queue(session, _OUT)
        publisher = _publisher(session, _BACK)
        publisher.put(b"ready")
        _until_end_of_input(messages)
        while messages.get():
            publisher.put(bytes(answer_size))


def _until_end_of_input(messages: "queue.SimpleQueue[bytes]") -> None:
    def watch() -> None:
        sys.stdin.buffer.read()
        messages.put(b"")

    threading.Thread(target=watch, daemon=True).start()


def _queue(session: zenoh.Session, key: str) -> "queue.SimpleQueue[bytes]":
    arrived: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    session.declare_subscriber(key, lambda sample: arrived.put(sample.payload.to_bytes()))
    return arrived


def _publisher(session: zenoh.Session, key: str) -> zenoh.Publisher:
    return session.declare_publisher(key, congestion_control=zenoh.CongestionControl.BLOCK)


def _own_endpoint(session: zenoh.Session) -> str:
    for reply in session.get(f"@/{session.zid()}/peer", timeout=_PATIENCE_SECONDS):
        if reply.ok is not None:
            return str(json.loads(reply.ok.payload.to_string())["locators"][0])
    raise RuntimeError("the session does not say where it listens")


def main() -> None:
    for size in (64, 1024, 9 * 1024, 64 * 1024):
        found = measure(size=size)
        print(f"{size:6d} B: median {found.median_us:6.1f} us, p99 {found.p99_us:6.1f} us")


if __name__ == "__main__":
    if sys.argv[1:2] == ["echo"]:
        _echo(sys.argv[2], int(sys.argv[3]))
    else:
        main()
