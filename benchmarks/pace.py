"""The rate of a paced link: frames over Zenoh, delivered no sooner than a transputer's link would have done it.

    python -m benchmarks.pace

Frames of one size go over one directed link for a while, at most as many bytes at a time as a link has credit for.
The rate is bytes over the time from the first arrival to the last one. The bar is the databook's rate one way
(INMOS Transputer Databook, 3rd ed., table 8.1) for large frames; for small ones set-up and wake-up count.
"""

import queue
import time

from tramnet_protocol.channel import Lane
from tramnet_protocol.keys import Keys
from tramnet_protocol.limits import CREDIT_BYTES
from tramnet_protocol.links import LinkTiming
from tramnet_protocol.pacing import Pacer
from tramnet_protocol.transport import open_root, open_worker

NETWORK = "bench-pace"
SECONDS = 1.5
DATABOOK = {20: 1740, 10: 910, 5: 450}  # [kB/s]
LARGE = 64 * 1024
SIZES = (64, 1024, LARGE)
TOLERANCE = 0.05
PATIENCE = 10.0


def rate(mbaud: int, size: int) -> float:
    """Bytes a second that a paced link delivers [B/s]."""
    timing = LinkTiming.of(mbaud)
    frames = max(4, round(SECONDS * 1e9 / timing.occupied(size)))
    ahead = max(1, CREDIT_BYTES // size)
    key = Keys(NETWORK).link(0, 1)
    arrived: queue.SimpleQueue[float] = queue.SimpleQueue()
    with (
        open_root(NETWORK, ["tcp/127.0.0.1:0"]) as root,
        open_worker(root.endpoint) as worker,
        Pacer(root, timing) as pacer,
    ):
        worker.subscribe(key, lambda _key, _payload: arrived.put(time.perf_counter()))
        times: list[float] = []
        time.sleep(0.2)  # until the subscription is known
        for i in range(frames):
            pacer.publish(key, bytes(size), Lane.LINK)
            if i >= ahead:
                times.append(arrived.get(timeout=PATIENCE))
        while len(times) < frames:
            times.append(arrived.get(timeout=PATIENCE))
    return size * (frames - 1) / (times[-1] - times[0])


def main() -> None:
    for mbaud, databook in DATABOOK.items():
        for size in SIZES:
            found = rate(mbaud, size) / 1e3
            modelled = 1e6 * size / LinkTiming.of(mbaud).occupied(size)
            line = f"{mbaud:2d} Mbaud, {size:6d} B: {found:7.1f} kB/s, model {modelled:7.1f} kB/s"
            if size == LARGE:
                off = found / databook - 1.0
                verdict = "reached" if abs(off) <= TOLERANCE else "MISSED"
                line += f", databook {databook} kB/s: {off:+.1%} (bar: ±{TOLERANCE:.0%}, {verdict})"
            print(line, flush=True)


if __name__ == "__main__":
    main()
