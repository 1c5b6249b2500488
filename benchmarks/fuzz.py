"""Hostile bytes: whatever arrives is understood or refused in words, in bounded memory, a million times.

    python -m benchmarks.fuzz [--inputs N] [--seed S] [--only I]
    python -m benchmarks.fuzz --atheris [options of libFuzzer]

Input number I of a seed is a pure function of both, so one that fails is named and ``--only`` tries it again. The
inputs are frames on record with some bytes or a field changed, MessagePack of random structure, arrays that lie
about themselves, keys with other parts, altered checkpoints, and noise. One in a hundred is tried with every
allocation traced. With the package ``atheris`` installed, libFuzzer looks for inputs by what code they reach.
"""

import argparse
import importlib
import json
import resource
import sys
import time
import tracemalloc
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random

import msgpack

from tramnet_master.checkpoints import Checkpoint, decode_checkpoint, encode_checkpoint
from tramnet_master.errors import DamagedCheckpoint, UnknownCheckpointVersion
from tramnet_protocol.arrays import Array
from tramnet_protocol.codec import MESSAGES, Header, decode, encode_raw, readdress
from tramnet_protocol.errors import MalformedFrame, UnknownKey
from tramnet_protocol.keys import PREFIX, Topic, parse
from tramnet_protocol.packing import unpack

FRAMES = Path(__file__).parents[1] / "tests" / "golden" / "frames.json"
CHECKPOINT = encode_checkpoint(Checkpoint(7, {"engine": {"genomes": [1, 2.5]}, "elapsed": 1.0}))
SOMEWHERE = Path("checkpoint-00000007.tramnet")

TRACED_EVERY = 100
MOST_ALLOCATED = 50 * 2**20
"""Most that one input may allocate, as protocol/README.md states [B]."""

MOST_GROWTH = 200 * 2**20
"""Most by which the process may grow over all inputs [B]."""

Outcome = str
Target = Callable[[bytes], Outcome]


def take_frame(payload: bytes) -> Outcome:
    """Do what a node does with a payload: read its header, pass it on, read its body, look at its arrays."""
    try:
        frame = decode(payload)
        readdress(payload, 1)
        message = frame.message()
        for name in message.__struct_fields__:
            field = getattr(message, name)
            if isinstance(field, Array):
                field.unpack()
    except MalformedFrame:
        return "refused"
    return "understood"


def take_body(payload: bytes) -> Outcome:
    """Take the payload for the body of a frame whose header is sound."""
    tag = list(MESSAGES)[len(payload) % len(MESSAGES)]
    return take_frame(encode_raw(Header(tag=tag), payload))


def take_key(payload: bytes) -> Outcome:
    """Take the payload for a key."""
    try:
        parse(payload.decode("utf-8", "replace"))
    except UnknownKey:
        return "refused"
    return "understood"


def take_checkpoint(payload: bytes) -> Outcome:
    """Take the payload for the content of a checkpoint."""
    try:
        decode_checkpoint(payload, SOMEWHERE)
    except (DamagedCheckpoint, UnknownCheckpointVersion):
        return "refused"
    return "understood"


class Inputs:
    """The inputs of a seed.

    Args:
        seed: Which inputs.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._frames = [bytes.fromhex(frame) for frame in json.loads(FRAMES.read_text()).values()]
        self._kinds: dict[Callable[[Random], tuple[Target, bytes]], float] = {
            lambda chance: (take_frame, mutated(chance.choice(self._frames), chance)): 0.4,
            lambda chance: (take_frame, self._altered(chance)): 0.15,
            lambda chance: (take_body, msgpack.packb(structure(chance, 4))): 0.05,
            lambda chance: (take_body, msgpack.packb(evaluated(chance))): 0.1,
            lambda chance: (take_key, key(chance).encode("utf-8", "surrogatepass")): 0.1,
            lambda chance: (take_checkpoint, mutated(CHECKPOINT, chance)): 0.1,
            lambda chance: (chance.choice((take_frame, take_body, take_key)), noise(chance)): 0.1,
        }
        self._bodies = [unpack(decode(frame).body) for frame in self._frames]

    def __call__(self, number: int) -> tuple[Target, bytes]:
        """Return what an input is given to, and the input."""
        chance = Random((self._seed << 40) + number)
        (make,) = chance.choices(list(self._kinds), list(self._kinds.values()))
        return make(chance)

    def _altered(self, chance: Random) -> bytes:
        """Return a frame on record with one field of its message replaced, left out or added."""
        which = chance.randrange(len(self._frames))
        body = self._bodies[which]
        assert isinstance(body, dict), "messages are maps"
        body = dict(body)
        name = chance.choice([*body, chance.choice(FIELDS)])
        body[name] = structure(chance, 3)
        if chance.random() < 0.2:
            del body[name]
        return encode_raw(decode(self._frames[which]).header, msgpack.packb(body))


def mutated(content: bytes, chance: Random) -> bytes:
    """Change, cut, repeat or insert a few bytes."""
    changed = bytearray(content)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(changed) + 1)
        match chance.randrange(4):
            case 0 if at < len(changed):
                changed[at] = chance.randrange(256)
            case 1:
                del changed[at : at + chance.randint(1, 8)]
            case 2:
                changed[at:at] = changed[at : at + chance.randint(1, 64)]
            case _:
                changed[at:at] = noise(chance)[:8]
    return bytes(changed)


def noise(chance: Random) -> bytes:
    """Return bytes, among them many that declare long lists, maps and strings."""
    heads = bytes(
        chance.choice(b"\xdc\xdd\xde\xdf\xc4\xc5\xc6\xc7\xd9\xdb\x91\x81\xff") for _ in range(4)
    )
    return heads[: chance.randint(0, 4)] + chance.randbytes(chance.randint(0, 200))


def structure(chance: Random, depth: int) -> object:
    """Return plain values of random structure, field names of real messages among them."""
    kind = chance.randrange(8 if depth else 5)
    match kind:
        case 0:
            return chance.choice((None, True, False, 0, -1, 2**63, 2**32, chance.getrandbits(64)))
        case 1:
            return chance.choice((0.0, -1.0, 1e300, float("nan"), float("inf")))
        case 2:
            return chance.choice(("", "<f8", "work", "x" * 200))
        case 3 | 4:
            return chance.randbytes(chance.randint(0, 40))
        case 5 | 6:
            return [structure(chance, depth - 1) for _ in range(chance.randint(0, 6))]
        case _:
            names = chance.choices(FIELDS, k=chance.randint(0, 6))
            return {name: structure(chance, depth - 1) for name in names}


def evaluated(chance: Random) -> dict[str, object]:
    """Return the body of an answer whose array lies about itself."""
    shape = [
        chance.choice((0, 1, 2, 8, -1, 2**22, 2**31, 2**62)) for _ in range(chance.randint(0, 6))
    ]
    dtype = chance.choice(("<f8", "<i2", "|O", "|V8", "<U4", ">f8", "f8", "<f8,<f8"))
    array = {
        "dtype": dtype,
        "shape": shape,
        "data": chance.randbytes(chance.choice((0, 8, 16, 64))),
    }
    return {"work": [0, 0, 0, 0, 1], "objectives": array, "seconds": 0.0}


def key(chance: Random) -> str:
    """Return a key with some parts of another kind."""
    parts = [*PREFIX.split("/"), "net", chance.choice(list(Topic)).value, "1", "2"]
    for _ in range(chance.randint(0, 2)):
        odd = chance.choice(
            ("", "*", "**", "-1", "01", "4095", "9" * 30, "\u0661", "\ud800", "a" * 100)
        )
        parts[chance.randrange(len(parts))] = odd
    return "/".join(parts[: chance.randint(1, 6)])


FIELDS = sorted({name for kind in MESSAGES.values() for name in kind.__struct_fields__})


def try_all(inputs: Inputs, numbers: Sequence[int]) -> Counter[Outcome]:
    """Try inputs; return how often each ended how.

    Raises:
        AssertionError: One allocated too much, or raised what it should not; its number is told.
    """
    outcomes: Counter[Outcome] = Counter()
    for number in numbers:
        target, payload = inputs(number)
        traced = number % TRACED_EVERY == 0
        if traced:
            tracemalloc.start()
        try:
            outcome = target(payload)
            allocated = tracemalloc.get_traced_memory()[1] if traced else 0
            assert allocated <= MOST_ALLOCATED, f"it allocated {allocated} bytes"
        except BaseException as error:
            words = f"input {number} to {target.__name__}: {payload.hex()}"
            raise AssertionError(words) from error
        finally:
            tracemalloc.stop()
        outcomes[f"{target.__name__}: {outcome}"] += 1
    return outcomes


def run_atheris(arguments: list[str]) -> None:
    """Have libFuzzer look for inputs, for as long as its options say."""
    atheris = importlib.import_module("atheris")
    targets = (take_frame, take_body, take_key, take_checkpoint)
    atheris.instrument_all()
    atheris.Setup(
        [sys.argv[0], *arguments],
        lambda payload: targets[payload[0] % 4](payload[1:]) if payload else None,
    )
    atheris.Fuzz()


def main() -> None:
    """Try the inputs that were asked for, and print how they ended."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz")
    parser.add_argument("--inputs", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="number of the one input to try")
    parser.add_argument("--atheris", action="store_true", help="let libFuzzer find the inputs")
    options, others = parser.parse_known_args()
    if options.atheris:
        run_atheris(others)
        return
    one = options.only
    numbers = range(options.inputs) if one is None else range(one, one + 1)
    inputs = Inputs(options.seed)
    try_all(inputs, numbers[:1000])
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    began = time.monotonic()
    outcomes = try_all(inputs, numbers)
    growth = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - before
    for outcome, count in sorted(outcomes.items()):
        print(f"  {outcome:30} {count:>9,}")
    seconds = time.monotonic() - began
    print(
        f"{len(numbers):,} inputs of seed {options.seed} in {seconds:.0f} s: all understood or refused"
    )
    print(f"the process grew by {growth / 2**20:.0f} MiB")
    assert growth <= MOST_GROWTH, "more than any input may allocate"


if __name__ == "__main__":
    main()
