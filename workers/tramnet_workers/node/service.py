"""A worker process: it owns the socket, the clock and three threads, and does what ``states.py`` decides.

The *post* thread lives on the network: it finds the root, asks for a seat, sends the heartbeat and notices that the
root is gone. The *router* passes on what is for others (``links.py``, ``router.py``). The main thread computes and
sends its answers itself. So a worker that computes still answers for its presence and serves those behind it, and
one whose interpreter hangs falls silent.

Work is taken in on the transport's thread that delivers it: what follows from it is a task for the main thread or
an item for the post thread, never a call of the channel or a wait.
"""

import logging
import os
import queue
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import TypeAlias

from msgspec import Struct

from tramnet_protocol.channel import Channel, Lane
from tramnet_protocol.codec import Header, decode, encode
from tramnet_protocol.errors import (
    BadTopology,
    CannotConnect,
    ChannelClosed,
    MalformedFrame,
    NoAnswer,
    RemoteProtocolError,
)
from tramnet_protocol.exchange import Identity
from tramnet_protocol.inbox import Inbox
from tramnet_protocol.keys import Keys
from tramnet_protocol.links import LinkTiming
from tramnet_protocol.messages import (
    NOBODY,
    PROTOCOL_VERSION,
    ROOT,
    Failed,
    JoinReply,
    JoinRequest,
    Refusal,
    Stats,
    Stop,
    Wiring,
    Work,
)
from tramnet_workers.kernels.fingerprint import kernel_fingerprint
from tramnet_workers.node import states
from tramnet_workers.node.evaluator import Evaluator
from tramnet_workers.node.links import Links
from tramnet_workers.node.pulse import Pulse
from tramnet_workers.node.states import Membership, WorkerStates
from tramnet_workers.node.supervisor import CRASHED, GAVE_UP, TOLD_TO_END

HEARTBEAT = 1.0
"""Period of the heartbeat [s]."""

RETRY = 0.2
"""Pause between two attempts to reach a root [s]."""

JOIN_TIMEOUT = 5.0
"""Longest wait for the answer to a question for a seat [s]."""

_log = logging.getLogger(__name__)


class OrderArrived(Struct, frozen=True):
    """A payload on this worker's wiring topic."""

    payload: bytes


class RootVanished(Struct, frozen=True):
    """The root's token has disappeared, as seen over this channel."""

    channel: object


class Wanted(Struct, frozen=True):
    """Somebody wants this process to end."""

    reason: str


Item: TypeAlias = OrderArrived | RootVanished | Wanted | states.Answer


@dataclass(frozen=True)
class Home:
    """Where a worker belongs.

    Attributes:
        network: Name of the network.
        supervisor: Name of the supervisor that can replace this process.
        name: Name of its certificate, or None where it has none.
        patience: How long to look for a root before giving up [s].
        connect: Opens a channel to the root; raises CannotConnect where there is none.
        pulse: Where it leaves signs of life.
    """

    network: str
    supervisor: str
    patience: float
    connect: Callable[[], Channel]
    name: str | None = None
    pulse: Pulse = field(default_factory=Pulse)


@dataclass(slots=True)
class _Tally:
    computing: tuple[float, float | None] = (0.0, None)  # time spent so far, and since when again
    blocked: float = 0.0
    evaluations: int = 0
    chunks: int = 0
    malformed: int = 0

    def busy_at(self, now: float) -> float:
        """Time spent computing until now [s], a chunk in work included."""
        spent, since = self.computing  # in one piece: another thread writes it
        return spent if since is None else spent + now - since


@dataclass(frozen=True)
class _Seat:
    """What a worker has for as long as it is a member: all of it is another root's afterwards."""

    membership: Membership
    channel: Channel
    links: Links


class Service:
    """One worker.

    Args:
        home: Where it belongs.
    """

    def __init__(self, home: Home) -> None:
        self._home = home
        self._keys = Keys(home.network)
        self._inbox: Inbox[Item] = Inbox()
        self._tasks: queue.SimpleQueue[states.Task] = queue.SimpleQueue()
        self._deciding = threading.Lock()  # the states, and in which order instructions follow
        self._gone = threading.Event()  # ends a pause
        self._states = WorkerStates()
        self._tally = _Tally()
        self._host = socket.gethostname()
        self._seat: _Seat | None = None  # set by the post, read by all threads

    def run(self) -> int:
        """Work until told to end; return the exit status of the process."""
        post = threading.Thread(target=self._post, name="post", daemon=True)
        post.start()
        status = self._compute()
        self.stop("the worker has ended")
        post.join()
        return status

    def stop(self, reason: str) -> None:
        """Have the worker end; may be called from any thread."""
        self._inbox.put(Wanted(reason))
        self._gone.set()

    # The main thread: computing.

    def _compute(self) -> int:
        evaluator: Evaluator | None = None
        while True:
            task = self._tasks.get()
            match task:
                case states.Start(membership, work):
                    assert evaluator is not None, "work comes after the problem is built"
                    self._apply(self._evaluate(evaluator, membership, work))
                case states.Build(membership, setup):
                    try:
                        evaluator = Evaluator(setup)
                    except Exception as error:  # a user's problem may raise anything
                        _log.exception("cannot build problem %s", setup.problem)
                        self._apply(states.BuildFailed(membership, _words(error)))
                    else:
                        self._apply(states.Built(membership))
                case states.Leave(reason, failed):
                    (_log.error if failed else _log.info)("leaving: %s", reason)
                    return GAVE_UP if failed else TOLD_TO_END

    def _evaluate(
        self, evaluator: Evaluator, membership: Membership, work: Work
    ) -> states.Finished:
        began = time.perf_counter()
        self._tally.computing = (self._tally.busy_at(began), began)
        try:
            answer = evaluator.compute(work)
            finished = states.Finished(membership, answer, evaluator.snapshot(work))
        except Exception as error:  # a user's problem may raise anything
            _log.exception("work %s failed", work.work)
            failed = Failed(work.work, _words(error), time.perf_counter() - began)
            finished = states.Finished(membership, failed)
        self._tally.computing = (self._tally.busy_at(time.perf_counter()), None)
        self._tally.chunks += 1
        self._tally.evaluations += work.work.size
        return finished

    # Any thread.

    def _apply(self, event: states.Event) -> bool:
        """Carry out what follows from an event; return whether a root must be looked for."""
        rejoin = False
        others = []
        with self._deciding:
            for instruction in self._states.handle(event):
                if isinstance(instruction, states.Task):
                    self._tasks.put(instruction)
                else:
                    others.append(instruction)
        for instruction in others:
            match instruction:
                case states.Answer():
                    self._send(instruction)
                case states.AnswerAgain(answer):
                    self._inbox.put(answer)
                case states.Announce(membership):
                    self._announce(membership)
                case states.Reject(work, why):
                    _log.info("dropped %s: %s", work, why.value)
                case states.Rejoin():
                    rejoin = True
        return rejoin

    # The root may be lost between a decision and what follows from it, and another one be found.

    def _seat_of(self, membership: Membership) -> _Seat | None:
        seat = self._seat
        return seat if seat is not None and seat.membership == membership else None

    def _announce(self, membership: Membership) -> None:
        seat = self._seat_of(membership)
        if seat is None:
            return  # the root that waits for it is gone
        try:
            seat.channel.declare_token(self._keys.alive(membership.seat))
        except ChannelClosed:
            self._inbox.put(RootVanished(seat.channel))

    def _send(self, answer: states.Answer) -> None:
        seat = self._seat_of(answer.membership)
        if seat is None:
            return  # the root that asked is gone
        began = time.perf_counter()
        if answer.snapshot is None:
            seat.links.send(answer.answer)
        else:
            seat.links.send(answer.snapshot, answer.answer)
        self._tally.blocked += time.perf_counter() - began

    def _take(self, header: Header, work: Work) -> None:
        """Take in work, on a thread that must not wait."""
        membership = Membership(
            header.source_incarnation, header.destination, header.destination_incarnation
        )
        self._apply(states.WorkReceived(membership, work))

    # The post thread: the network.

    def _post(self) -> None:
        try:
            while self._visit():
                pass
        except Exception:
            # Without its post a worker is of no use, and an evaluation may keep the main thread for long.
            _log.exception("the post has failed")
            os._exit(CRASHED)

    def _visit(self) -> bool:
        """Find a root, serve it until it is gone; return whether to look for another."""
        deadline = time.monotonic() + self._home.patience
        while True:
            if self._is_stopped():
                return False
            try:
                with self._home.connect() as channel:
                    if self._join(channel):
                        return self._serve()
            except (CannotConnect, NoAnswer) as error:
                reason = str(error)
            except MalformedFrame as error:  # it will say the same the next time
                self._tasks.put(states.Leave(f"cannot understand the root: {error}", failed=True))
                return False
            else:
                reason = "the root has no seat for this worker now"
            if self._states.phase is states.Phase.GONE:
                return False
            if time.monotonic() >= deadline:
                reason = f"no root for {self._home.patience:g} s: {reason}"
                self._tasks.put(states.Leave(reason, failed=True))
                return False
            self._gone.wait(RETRY)

    def _is_stopped(self) -> bool:
        """Forget what the last root sent, and return whether this process is to end."""
        while (item := self._inbox.get(0)) is not None:
            if isinstance(item, Wanted):
                self._apply(states.StopReceived(item.reason))
        return self._states.phase is states.Phase.GONE

    def _join(self, channel: Channel) -> bool:
        # Before the question: who is answered has seen the root's token, and will see it go.
        channel.watch_tokens(
            self._keys.alive(ROOT), lambda _, alive: self._watch_root(channel, alive)
        )
        request = JoinRequest(
            PROTOCOL_VERSION,
            version("tramnet"),
            kernel_fingerprint(),
            self._host,
            os.getpid(),
            self._home.supervisor,
        )
        reply = decode(
            channel.ask(self._where_to_join, encode(Header(), request), JOIN_TIMEOUT)
        ).message()
        if isinstance(reply, Refusal):
            if reply.final:
                self._tasks.put(states.Leave(f"the root refuses: {reply.reason}", failed=True))
                self._apply(states.StopReceived(reply.reason))
            return False
        if not isinstance(reply, JoinReply):
            raise MalformedFrame(f"found {type(reply).__name__} for an answer to join")
        membership = Membership(reply.root_incarnation, reply.seat, reply.incarnation)
        identity = Identity(reply.run, reply.seat, reply.incarnation)
        pace = LinkTiming.of(reply.pace) if reply.pace else None
        links = Links(channel, self._keys, identity, reply.wiring, self._take, pace)
        channel.subscribe(self._keys.wiring(reply.seat), self._enqueue_order)
        self._seat = _Seat(membership, channel, links)
        self._apply(states.Joined(membership, reply.setup))
        return True

    def _enqueue_order(self, key: str, payload: bytes) -> None:
        self._inbox.put_from(key, len(payload), OrderArrived(payload))

    @property
    def _where_to_join(self) -> str:
        name = self._home.name
        return self._keys.join if name is None else self._keys.join_as(name)

    def _watch_root(self, channel: Channel, alive: bool) -> None:
        if not alive:
            self._inbox.put(RootVanished(channel))

    def _serve(self) -> bool:
        """Take in what arrives; return whether to look for another root."""
        assert self._seat is not None, "a worker that serves has joined"
        channel, links = self._seat.channel, self._seat.links
        started = time.monotonic()
        next_heartbeat = started
        try:
            while True:
                item = self._inbox.get(next_heartbeat - time.monotonic())
                match item:
                    case OrderArrived(payload):
                        self._take_order(links, payload)
                    case states.Answer():
                        self._send(item)
                    case RootVanished(seen_by) if seen_by is channel:
                        return self._apply(states.RootLost())
                    case Wanted(reason):
                        self._apply(states.StopReceived(reason))
                if self._states.phase is states.Phase.GONE:
                    return False
                now = time.monotonic()
                if now >= next_heartbeat:
                    next_heartbeat = now + HEARTBEAT
                    self._send_heartbeat(channel, links, now - started)
        except (RemoteProtocolError, ChannelClosed):
            _log.exception("lost the root")
            return self._apply(states.RootLost())
        finally:
            self._seat = None
            links.close()

    def _take_order(self, links: Links, payload: bytes) -> None:
        """Take in what the root says past all links."""
        try:
            frame = decode(payload)
            message = frame.message()
        except MalformedFrame as error:
            self._tally.malformed += 1
            _log.warning("dropped an order: %s", error)
            return
        if frame.header.run != links.exchange.identity.run:
            return
        match message:
            case Wiring():
                self._rewire(links, message)
            case Stop(reason) if links.exchange.is_for_this_life(frame.header):
                self._apply(states.StopReceived(reason))

    def _rewire(self, links: Links, wiring: Wiring) -> None:
        try:
            links.rewire(wiring)
        except BadTopology as error:
            self._tally.malformed += 1
            _log.warning("dropped a wiring: %s", error)

    def _send_heartbeat(self, channel: Channel, links: Links, uptime: float) -> None:
        exchange = links.exchange
        identity, tally = exchange.identity, self._tally
        counters, tags = links.counters()
        stats = Stats(
            seat=identity.seat,
            incarnation=identity.incarnation,
            state="busy" if self._states.running is not None else "idle",
            uptime=uptime,
            busy=tally.busy_at(time.perf_counter()),
            blocked=tally.blocked,
            evaluations=tally.evaluations,
            chunks=tally.chunks,
            queued=max(0, len(self._states.held) - 1),
            malformed=exchange.malformed + tally.malformed,
            links=counters,
            pid=os.getpid(),
            host=self._host,
            tags=tags,
        )
        header = Header(
            run=identity.run,
            epoch=exchange.wiring.epoch,
            source=identity.seat,
            source_incarnation=identity.incarnation,
            destination=NOBODY,
        )
        channel.publish(self._keys.stats(identity.seat), encode(header, stats), Lane.TELEMETRY)
        self._home.pulse.beat()


def _words(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"[:4000]
