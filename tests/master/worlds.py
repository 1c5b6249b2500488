"""A root over a network in memory, with one honest worker that was given a piece of work, and a stranger."""

import threading
from collections.abc import Callable

import msgspec
import numpy as np

from tramnet_master.farm.audit import Audit, Recompute
from tramnet_master.farm.dispatcher import Farm, Hands
from tramnet_master.farm.reception import House
from tramnet_master.farm.rules import Rules
from tramnet_master.farm.scheduler import Scheduler
from tramnet_protocol.arrays import Array
from tramnet_protocol.channel import Lane
from tramnet_protocol.codec import Frame, Header, decode, encode
from tramnet_protocol.keys import Keys
from tramnet_protocol.loopback import LoopbackNetwork
from tramnet_protocol.messages import (
    PROTOCOL_VERSION,
    ControlReply,
    Evaluate,
    Evaluated,
    JoinReply,
    JoinRequest,
    Kind,
    Message,
    Setup,
    WorkId,
)
from tramnet_protocol.topology import shape_named

KEYS = Keys("lab")
RUN, ROOT_LIFE = 77, 9
WORK = WorkId(Kind.EVALUATE, 0, 1, 0, 1)
GENOMES = Array.pack(np.arange(3.0).reshape(1, 3))
PRINT = "f" * 64


class Peer:
    """Somebody on the network, who may or may not keep to its rules."""

    def __init__(self, world: "World", name: str) -> None:
        self.channel = world.network.open(name)
        self.world = world
        self.got: list[Frame] = []

    def ask(self, key: str, message: Message) -> Message:
        """Ask the root, which answers in its own time."""
        answers: list[bytes] = []
        question = encode(Header(), message)
        asker = threading.Thread(
            target=lambda: answers.append(self.channel.ask(key, question, 30.0))
        )
        asker.start()
        self.world.turn_until(lambda: answers)
        asker.join()
        return decode(answers[0]).message()

    def join(self, pid: int, key: str = KEYS.join) -> Message:
        return self.ask(key, JoinRequest(PROTOCOL_VERSION, "0.1.0", PRINT, "host", pid, "nobody"))

    def enter(self, pid: int) -> JoinReply:
        """Take a seat, as a worker does."""
        reply = self.join(pid)
        assert isinstance(reply, JoinReply)
        self.seat, self.life = reply.seat, reply.incarnation
        self.channel.subscribe(
            KEYS.links_to(reply.seat), lambda _, payload: self.got.append(decode(payload))
        )
        self.channel.declare_token(KEYS.alive(reply.seat))
        wired_in = lambda: reply.seat in self.world.farm.membership.wiring.incarnations  # noqa: E731
        self.world.turn_until(wired_in)
        return reply

    def leave(self) -> None:
        """Show presence no more."""
        self.channel.withdraw_token(KEYS.alive(self.seat))

    def frame(self, message: Message, **changes: object) -> bytes:
        header = Header(
            run=RUN,
            source=self.seat,
            source_incarnation=self.life,
            destination=0,
            destination_incarnation=ROOT_LIFE,
        )
        return encode(msgspec.structs.replace(header, **changes), message)

    def say(self, message: Message, key: str | None = None, **changes: object) -> None:
        payload = self.frame(message, **changes)
        self.channel.publish(key or KEYS.link(self.seat, 0), payload, Lane.LINK)


class World:
    """A root with one honest worker that has been given a piece of work, and a stranger."""

    def __init__(self, recompute: Recompute | None = None) -> None:
        self.network = LoopbackNetwork()
        house = House(RUN, ROOT_LIFE, Setup("sphere", {}), PRINT)
        self.replaced: list[str] = []
        nothing = lambda *_: None  # noqa: E731
        hands = Hands(
            lambda _, cause: self.replaced.append(cause),
            lambda _: ControlReply("", self.farm.status()), nothing, nothing, nothing, nothing,
        )  # fmt: skip
        self.farm = Farm(
            self.network.open("root"), KEYS, house, shape_named("star"), Scheduler(Rules()), hands,
            audit=Audit(1.0, b"", recompute) if recompute else None,
        )  # fmt: skip
        self.farm.open()
        self.honest, self.stranger = Peer(self, "honest"), Peer(self, "stranger")
        self.honest.enter(pid=1)
        self.stranger.seat, self.stranger.life = 7, 7
        self.farm.submit(Evaluate(WORK, GENOMES))
        self.turn_until(lambda: self.honest.got)

    def turn_until(self, condition: Callable[[], object]) -> None:
        assert self.farm.wait_for(lambda: bool(condition()), 30.0)

    def turn(self) -> None:
        """Let the root take all that has come."""
        self.turn_until(lambda: self.farm.inbox.empty)

    @property
    def status(self) -> dict:
        return self.farm.status()

    def finish(self) -> float:
        """Let the honest worker answer; return what the root takes for the objective."""
        self.honest.say(answer(5.0))
        finished = self.farm.next_outcome()
        assert finished is not None
        assert isinstance(finished.outcome, Evaluated)
        return float(finished.outcome.objectives.unpack()[0])


def answer(objective: float, work: WorkId = WORK) -> Evaluated:
    return Evaluated(work, Array.pack(np.array([objective])), 0.001)
