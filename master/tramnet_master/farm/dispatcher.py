"""The farm at work: it owns the clock and the channel, and carries out what the scheduler decides.

One thread does everything, the one that drives the engine. The transport's threads, the supervisor and people only
put things into its inbox. Nothing here waits for a worker: a frame is published or it is lost, and what is lost
comes back as a token that disappears or a deadline that passes.
"""

import logging
import os
import socket
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from msgspec import Struct

from tramnet_master.errors import RunFailed
from tramnet_master.farm import events
from tramnet_master.farm.audit import Audit
from tramnet_master.farm.books import Books, NoBooks
from tramnet_master.farm.changes import Changes
from tramnet_master.farm.collection import Collection, WrongOutcome, open_collection
from tramnet_master.farm.events import Instruction, Tram
from tramnet_master.farm.holders import Holders
from tramnet_master.farm.membership import Member, Membership
from tramnet_master.farm.reception import House, Reception
from tramnet_master.farm.scheduler import Scheduler
from tramnet_master.farm.ways import ways
from tramnet_protocol.channel import Channel, Lane, Publisher, Query
from tramnet_protocol.codec import Frame, Header, decode, encode
from tramnet_protocol.errors import MalformedFrame, ProtocolError, UnknownKey
from tramnet_protocol.exchange import Exchange, Identity
from tramnet_protocol.inbox import Inbox
from tramnet_protocol.keys import Keys, parse
from tramnet_protocol.messages import (
    NOBODY,
    ROOT,
    ControlReply,
    ControlRequest,
    Evaluated,
    Event,
    Evolve,
    Failed,
    Kind,
    Message,
    Outcome,
    PopulationMeans,
    PopulationSnapshot,
    Stats,
    Stop,
    TagCounters,
    Tracked,
    Work,
    WorkId,
)
from tramnet_protocol.topology import Shape
from tramnet_workers.node.supervisor import Ended

HEARTBEAT = 1.0
"""Period of the root's own statistics [s]."""

STRANGERS = "strangers"
"""Source of all that comes from those who have no seat."""

TICK = 0.25
"""Longest time between two looks at the deadlines, however much arrives [s]."""

AWAY = 0.5
"""Time between two looks at the deadlines after which what has arrived is read before the next [s]."""

MOST_EXCUSES = 20
"""How often in a row a look at the deadlines is put off because the root was away."""

GOODBYE = 1.0
"""Longest wait for workers that were told to end [s]."""

_log = logging.getLogger(__name__)


class FrameArrived(Struct, frozen=True):
    """A payload on a link topic."""

    key: str
    payload: bytes


class HeartbeatArrived(NamedTuple):
    """A payload on a statistics topic."""

    key: str
    payload: bytes


class TokenChanged(NamedTuple):
    """A token has appeared or disappeared."""

    key: str
    alive: bool


class JoinAsked(NamedTuple):
    """A worker asks for a seat."""

    query: Query


class ControlAsked(NamedTuple):
    """Somebody steers."""

    query: Query


class Woken(NamedTuple):
    """Look up: something outside has changed."""


Item = FrameArrived | HeartbeatArrived | TokenChanged | JoinAsked | ControlAsked | Ended | Woken


@dataclass(frozen=True)
class Hands:
    """What the farm has others do.

    Attributes:
        replace: Has the supervisor of a worker end it and start another.
        steer: Does what somebody at the control topic asks.
        tell: Takes a line for people.
        give_up: Takes what was condemned and why; raises RunFailed where the run shall end by it.
        restate: Adds to work on populations the state that a worker needs who does not hold them.
        note: Writes down that a worker joined, was lost or is replaced.
        first_answer: Is told, where answers are audited, of the first one of each worker, before it counts.
    """

    replace: Callable[[Member, str], None]
    steer: Callable[[ControlRequest], ControlReply]
    tell: Callable[[str], None]
    give_up: Callable[[str], None]
    restate: Callable[[Evolve], Evolve]
    note: Callable[[str, Mapping[str, object]], None]
    first_answer: Callable[[Tram], None] = lambda _: None


class Finished(NamedTuple):
    """A work that is done.

    Attributes:
        work: The work.
        outcome: Its outcome.
        snapshot: What came with it of the populations, where the work asked for that.
    """

    work: Work
    outcome: Outcome
    snapshot: PopulationSnapshot | None


class Farm:
    """One run's workers, seen from the engine: work in, outcomes out.

    Args:
        channel: The root's end of the network.
        keys: Keys of the network.
        house: What joining workers are told and expected to be.
        shape: What the TRAMs are wired in.
        scheduler: Decides.
        hands: What others do for the farm.
        books: Who is told what passes, or None for nobody.
        links: Where frames are published, or None for the channel.
        audit: Who looks at answers again, or None for nobody.

    Attributes:
        inbox: Where everything arrives.
        membership: The seats.
        reception: Who was let in and who was not.
        lost: Number of workers lost while live.
        condemned: Work given up, in the order of giving up, with the reason.
        compute_seconds: Compute time of all accepted answers [s].
        waited_seconds: Time the engine's work took from its submission to its outcome [s].
        chunks: Number of answers accepted.
        busy_seconds: Compute time of the accepted answers of each worker that gave any [s].
        liars: Workers found out since this was emptied last; what they answered is not to be trusted.
        expelled: All workers found out.
    """

    def __init__(
        self,
        channel: Channel,
        keys: Keys,
        house: House,
        shape: Shape,
        scheduler: Scheduler,
        hands: Hands,
        books: Books | None = None,
        links: Publisher | None = None,
        audit: Audit | None = None,
    ) -> None:
        self.inbox: Inbox[Item] = Inbox()
        self.membership = Membership(shape, house.root_incarnation)
        self.reception = Reception(house, self.membership)
        self.lost = 0
        self.condemned: list[tuple[WorkId, str]] = []
        self.compute_seconds = 0.0
        self.waited_seconds = 0.0
        self.busy_seconds: dict[Tram, float] = {}
        self._channel = channel
        self._links: Publisher = links or channel
        self._keys = keys
        self._hands = hands
        self._scheduler = scheduler
        self._books = books or NoBooks()
        self._audit = audit
        self.liars: set[Tram] = set()
        self.expelled: dict[Tram, Member] = {}
        self._known: dict[Tram, Member] = {}  # all that ever were live, where answers are audited
        self._givers: dict[Tram, Member] = {}  # those of them that gave an accepted answer
        identity = Identity(house.run, ROOT, house.root_incarnation)
        self._exchange = Exchange(keys, identity, self.membership.wiring)
        self._open: dict[tuple[Kind, int, int], list[Collection]] = {}
        self._resolved: deque[Finished] = deque()
        self._holders = Holders()
        self._snapshots: dict[Tram, PopulationSnapshot] = {}  # until the answer they belong to
        # The outcome whose instructions are carried out, and the work it belongs to.
        self._arrived: tuple[Collection, Outcome] | None = None
        self._changes = Changes()
        self._stalled: list[Tram] = []  # to be wired out when all instructions are carried out
        self._found_out: list[Tram] = []  # to be expelled then
        self._unreplaced: dict[Tram, Mapping[str, object]] = {}  # while their tokens stand
        self._started = time.monotonic()
        self._next_heartbeat = self._started
        self._next_tick = self._started
        self._looked = self._started  # when the last turn ended
        self._excuses = 0
        self._blocked_seconds = 0.0
        self._evaluations = 0
        self.chunks = 0
        self._interrupted = False
        # What follows is read by the transport's threads, and replaced rather than changed.
        self._members_keys: frozenset[str] = frozenset()
        self._strange_tokens = 0
        self._note_members()

    @property
    def messages(self) -> tuple[TagCounters, ...]:
        """Counters of what the root sent and received on links, by tag."""
        return tuple(self._exchange.tags())

    def open(self) -> None:
        """Begin to listen and show presence."""
        inbox, keys, channel = self.inbox, self._keys, self._channel
        channel.subscribe(
            keys.links_to(ROOT),
            lambda key, payload: self._put(key, len(payload), FrameArrived(key, payload)),
        )
        channel.subscribe(
            keys.all_stats,
            lambda key, payload: self._put(key, len(payload), HeartbeatArrived(key, payload)),
        )
        channel.watch_tokens(keys.all_alive, self._put_token)
        channel.serve(
            keys.control,
            lambda query: inbox.put_from(keys.control, len(query.payload), ControlAsked(query)),
        )
        # Before anybody can join: a worker that has a seat has seen the token, and will see it go.
        channel.declare_token(keys.alive(ROOT))
        for key in (keys.join, keys.join_as_anybody):
            channel.serve(
                key,
                lambda query: inbox.put_from(keys.join, len(query.payload), JoinAsked(query)),
            )

    def interrupt(self) -> None:
        """Have ``next_outcome`` return; may be called from a signal handler or another thread."""
        self._interrupted = True
        self.inbox.put(Woken())

    def submit(self, work: Work) -> None:
        """Have a piece of work done."""
        began = time.perf_counter()
        holder = self._holders.find(work.work) if isinstance(work, Evolve) else None
        if holder is None and isinstance(work, Evolve):
            work = self._hands.restate(work)
        self._open_and_submit(work, holder)
        self.waited_seconds += time.perf_counter() - began

    def next_outcome(self) -> Finished | None:
        """Return the next finished work and its outcome, or None once interrupted.

        Raises:
            RunFailed: A work that cannot be done without was condemned.
        """
        began = time.perf_counter()
        while not self._resolved and not self._interrupted:
            self._turn()
        self.waited_seconds += time.perf_counter() - began
        return self._resolved.popleft() if self._resolved else None

    @property
    def busy(self) -> bool:
        """Whether work is open, or done and not fetched."""
        return bool(self._open or self._resolved)

    @property
    def settled(self) -> bool:
        """Whether all who came or went are wired in or out."""
        return self._changes.due is None

    def forget_holders(self) -> None:
        """Trust nobody to hold populations: from now on all work carries their state."""
        self._holders = Holders()

    def wait_for(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Go on until a condition holds or the time is over; return whether it holds."""
        end = time.monotonic() + seconds
        while not condition() and time.monotonic() < end and not self._interrupted:
            self._turn(end - time.monotonic())
        return condition()

    def announce(self, name: str, detail: Mapping[str, object]) -> None:
        """Publish an event for dashboards; nobody is waited for."""
        event = Event(name, time.monotonic() - self._started, dict(detail))
        self._publish(self._keys.events, event, Lane.TELEMETRY)

    def dismiss(self, reason: str) -> None:
        """Tell every worker to end, and see them go: the end of the root would overtake what it said last."""
        leaving = {member.tram.seat for member in self.membership.live}
        for member in self.membership.live:
            self._order(member, Stop(reason))
        end = time.monotonic() + GOODBYE
        while leaving and time.monotonic() < end:
            item = self.inbox.get(max(0.0, end - time.monotonic()))
            if isinstance(item, TokenChanged) and not item.alive:
                leaving.discard(parse(item.key).seats[0])

    def _order(self, member: Member, order: Stop) -> None:
        identity = self._exchange.identity
        header = Header(
            run=identity.run,
            epoch=self.membership.wiring.epoch,
            source=ROOT,
            source_incarnation=identity.incarnation,
            destination=member.tram.seat,
            destination_incarnation=member.tram.incarnation,
        )
        key = self._keys.wiring(member.tram.seat)
        self._channel.publish(key, encode(header, order), Lane.CONTROL)

    def status(self) -> dict[str, object]:
        """Return what a dashboard needs to know of the workers and links."""
        now = time.monotonic()
        return {
            "network": self._keys.network,
            "run": self._exchange.identity.run,
            "topology": self.membership.wiring.topology,
            "epoch": self.membership.wiring.epoch,
            "uptime": now - self._started,
            "lost": self.lost,
            "refused": self.reception.refused,
            "malformed": self._exchange.malformed,
            "foreign": self._exchange.foreign + self._strange_tokens,
            "dropped": {reason.name.lower(): n for reason, n in self._scheduler.dropped.items()},
            "over_credit": sum(self.inbox.dropped.values()),
            "audited": self._audit.checked if self._audit is not None else 0,
            "expelled": len(self.expelled),
            "workers": [_describe(member, now) for member in self.membership.members],
        }

    # Threads of the transport.

    def _put(self, key: str, size: int, item: Item) -> None:
        """Enqueue what came on a key; those who have no seat share one credit."""
        self.inbox.put_from(key if key in self._members_keys else STRANGERS, size, item)

    def _put_token(self, key: str, alive: bool) -> None:
        """Enqueue that a token has changed; nobody shows one before it has a seat."""
        if key in self._members_keys:
            self.inbox.put(TokenChanged(key, alive))
        else:
            self._strange_tokens += 1

    # One turn of the loop.

    def _turn(self, patience: float = TICK) -> None:
        now = time.monotonic()
        item = self.inbox.get(min(patience, TICK, max(0.0, self._next_due() - now)))
        if item is not None:
            self._take(item)
        now = time.monotonic()
        if self._changes.due is not None and now >= self._changes.due:
            self._settle()
        if now - self._looked > AWAY and self._excuses < MOST_EXCUSES:
            # Held up or stopped: what was said in time lies in the inbox, or in sockets that wake up with us.
            self._excuses += 1
            self._next_tick = now + TICK
        elif now >= self._next_tick or (self.inbox.empty and not self._excuses):
            self._excuses = 0
            due = self._scheduler.next_time()
            if due is not None and due <= now:
                self._handle(events.Tick(self.membership.silent(now)))
            self._next_tick = now + TICK
        self._looked = now
        if now >= self._next_heartbeat:
            self._next_heartbeat = now + HEARTBEAT
            self._publish(self._keys.stats(ROOT), self._stats(now), Lane.TELEMETRY)
            for tram in list(self._unreplaced):
                self._ask_for_replacement(tram)

    def _next_due(self) -> float:
        changes = self._changes.due
        return self._next_heartbeat if changes is None else min(changes, self._next_heartbeat)

    def _take(self, item: Item) -> None:
        match item:
            case FrameArrived(key, payload):
                frame = self._exchange.incoming(key, payload)
                if frame is None:
                    return
                if not self._exchange.is_ours(frame):
                    self._exchange.foreign += (
                        1  # all ways begin or end here: the root passes nothing on
                    )
                elif self._exchange.admits(key, frame):
                    self._take_frame(frame)
            case HeartbeatArrived(key, payload):
                self._take_heartbeat(key, payload)
            case TokenChanged(key, alive):
                self._take_token(key, alive)
            case JoinAsked(query):
                self._take_join(query)
            case ControlAsked(query):
                self._reply(query, self.reception.control(query.payload, self._hands.steer))
            case Ended():
                self._take_end(item)

    def _take_frame(self, frame: Frame) -> None:
        tram = Tram(frame.header.source, frame.header.source_incarnation)
        try:
            message = frame.message()
        except MalformedFrame as error:
            self._exchange.refuse(f"of TRAM {tram.seat}", error)
            return
        if tram in self.expelled:
            self._exchange.foreign += 1
            return
        match message:
            case Evaluated() | PopulationMeans() | Tracked():
                self._take_outcome(tram, message)
            case PopulationSnapshot() if self.membership.find(tram) is not None:
                self._snapshots[tram] = message
            case Failed():
                self._handle(events.Raised(tram, message.work, message.error))
            case _:
                self._exchange.foreign += 1

    def _take_outcome(self, tram: Tram, outcome: Outcome) -> None:
        collection = self._find(outcome.work)
        snapshot = self._snapshots.pop(tram, None)
        if collection is None:  # closed long ago: the scheduler counts it
            self._handle(events.Answered(tram, outcome.work, outcome.seconds))
            return
        try:
            bad = collection.inspect(outcome, snapshot)
        except WrongOutcome as error:
            self._handle(events.Raised(tram, outcome.work, str(error)))
            return
        self._arrived = collection, outcome
        self._books.answered(tram, outcome, snapshot)
        self._handle(events.Answered(tram, outcome.work, outcome.seconds, bad))
        self._arrived = None

    def _take_heartbeat(self, key: str, payload: bytes) -> None:
        try:
            seat = parse(key).seats[0]
            message = decode(payload).message() if seat != ROOT else None
        except (MalformedFrame, UnknownKey):
            self._exchange.malformed += 1
            return
        if isinstance(message, Stats) and message.seat == seat:
            self.membership.heard(message, time.monotonic())

    def _take_token(self, key: str, alive: bool) -> None:
        seat = parse(key).seats[0]
        if seat == ROOT:
            return
        now = time.monotonic()
        if alive:
            member = self.membership.appeared(seat, now)
            if member is not None:
                if self._audit is not None:
                    self._known[member.tram] = member
                self._tell_joined(member)
                self._changes.join(member.tram, now)
            return
        member = self.membership.vanished(seat)
        if member is not None:
            self._lose(member, "is lost")

    def _take_join(self, query: Query) -> None:
        name = self._keys.asker(query.key)
        answer = self.reception.join(query.payload, time.monotonic(), name)
        self._note_members()
        self._reply(query, answer)

    def _reply(self, query: Query, answer: bytes) -> None:
        try:
            query.reply(answer)
        except ProtocolError as error:
            _log.warning("could not answer on %s: %s", query.key, error)

    def _note_members(self) -> None:
        """Let the transport's threads know who has a seat."""
        keys = self._keys
        self._members_keys = frozenset(
            key
            for seat in (ROOT, *(member.tram.seat for member in self.membership.members))
            for key in (keys.link(seat, ROOT), keys.stats(seat), keys.alive(seat))
        )

    def _take_end(self, ended: Ended) -> None:
        """Free at once the seat of a local process that ended before its token appeared."""
        self.membership.abandon(ended.pid, socket.gethostname())

    # What the scheduler decides.

    def _handle(self, event: events.Event) -> None:
        for instruction in self._scheduler.handle(event, time.monotonic()):
            self._carry_out(instruction)
        if self._stalled:
            expelled = [self.membership.expel(tram) for tram in self._stalled]
            self._stalled.clear()
            for member in expelled:
                if member is not None:
                    self._lose(member, "has fallen silent and is wired out")
            self._settle()
        if self._found_out:
            while self._found_out:
                self._expel(self._found_out.pop())
            self._settle()

    def _carry_out(self, instruction: Instruction) -> None:
        match instruction:
            case events.Send(tram, work) | events.Repeat(tram, work):
                chunk = self._collection(work).chunk(work)
                self._send(tram, chunk)
                self._books.sent(tram, chunk)  # when it is under way, for it takes a moment
            case events.Accept(tram, _, part):
                assert self._arrived is not None, "only an arriving outcome is accepted"
                collection, outcome = self._arrived
                collection.accept(outcome, part)
                self._note_giver(tram, collection.work.work, part)
                if isinstance(outcome, PopulationMeans):
                    self._holders.note(outcome.work, tram)
                share = part.size / outcome.work.size
                self.busy_seconds[tram] = self.busy_seconds.get(tram, 0.0) + share * outcome.seconds
                self._evaluations += part.size
                self.chunks += 1
            case events.Resolved(work):
                self._resolve(work)
            case events.Condemn(work, reason):
                self._condemn(work, reason)
            case events.Replace(tram, cause, _):
                self._replace(tram, cause.value)
                if cause is events.Cause.STALLED:
                    self._stalled.append(tram)
            case events.Waiting():
                self._hands.tell("no worker: waiting for one to join")
                self.announce("waiting", {})
            case events.Resumed():
                self.announce("resumed", {})
            case events.Drop(tram, _, reason):
                _log.info("dropped an answer of TRAM %d: %s", tram.seat, reason.value)
            case events.Orphaned(work, tram):
                self._restate(work, tram)

    def _resolve(self, work: WorkId) -> None:
        collection = self._collection(work)
        collections = self._open[_place(work)]
        collections.remove(collection)
        if not collections:
            del self._open[_place(work)]
        if not self._open:
            self._books.idle()
        self.compute_seconds += collection.seconds
        finished = Finished(collection.work, collection.outcome(), collection.snapshot)
        self._look_again(finished)
        self._resolved.append(finished)

    def _note_giver(self, tram: Tram, whole: WorkId, part: WorkId) -> None:
        if self._audit is None:
            return
        self._audit.note(whole, part, tram)
        if tram not in self._givers:
            self._givers[tram] = self._known[
                tram
            ]  # it may have left since, and answers still count
            self._hands.first_answer(tram)

    def _look_again(self, finished: Finished) -> None:
        """Compare what was answered with what the root computes itself; who differs has lied."""
        if self._audit is None:
            return
        work = finished.work
        if isinstance(work, Evolve) and self._audit.wants(work.work):
            work = self._hands.restate(work)
        liars = self._audit.liars(work, (finished.outcome, finished.snapshot))
        self._found_out += liars - self.liars
        self.liars |= liars

    def _expel(self, tram: Tram) -> None:
        """Let a worker go for good, and everybody who has its certificate; nobody is asked to replace it."""
        known = self._givers[tram]
        self.reception.ban(known)
        for liar, member in self._givers.items():
            if liar == tram or (member.name is not None and member.name == known.name):
                self.liars.add(liar)
                self.expelled[liar] = member
                self._order(member, Stop("it answered what is not so"))
                if self.membership.expel(liar) is not None:
                    self._lose(member, "answered what is not so, and is expelled")

    def _open_and_submit(self, work: Work, holder: Tram | None) -> None:
        collection = open_collection(work)
        self._open.setdefault(_place(work.work), []).append(collection)
        generations = max(1, work.means.shape[0]) if isinstance(work, Evolve) else 1
        self._handle(
            events.WorkSubmitted(
                work.work, collection.bytes_each, collection.divisible, holder, generations
            )
        )

    def _restate(self, work: WorkId, holder: Tram) -> None:
        """Submit work again whose state is lost, with the state, so that any worker can do it."""
        collection = self._collection(work)
        assert isinstance(collection.work, Evolve), "only populations are held by a worker"
        self._hands.tell(
            f"{_describe_work(work)} moves away from TRAM {holder.seat}, restored from its snapshot"
        )
        self._open[_place(work)].remove(collection)
        self._open_and_submit(self._hands.restate(collection.work), None)

    def _condemn(self, work: WorkId, reason: str) -> None:
        self.condemned.append((work, reason))
        self._hands.give_up(f"{_describe_work(work)}: {reason}")
        collection = self._collection(work)
        if not collection.divisible:
            raise RunFailed(f"{_describe_work(work)} cannot be computed: {reason}")
        collection.condemn(work)

    def _replace(self, tram: Tram, cause: str) -> None:
        member = self.membership.find(tram)
        if member is None:
            return
        self._hands.tell(f"TRAM {tram.seat} is replaced: {cause}")
        detail = {
            "seat": tram.seat,
            "pid": member.request.pid,
            "supervisor": member.request.supervisor,
            "cause": cause,
        }
        self._hands.note("replace", detail)
        self._unreplaced[tram] = detail
        self._ask_for_replacement(tram)
        self._hands.replace(member, cause)

    def _ask_for_replacement(self, tram: Tram) -> None:
        """Have those who watch replace a worker; asked again with each heartbeat, for this lane may drop it."""
        if self.membership.find(tram) is None:
            del self._unreplaced[tram]
        else:
            self.announce("replace", self._unreplaced[tram])

    # Workers and wires.

    def _lose(self, member: Member, what: str) -> None:
        self.lost += 1
        self._snapshots.pop(member.tram, None)
        self._hands.tell(f"TRAM {member.tram.seat} {what}")
        self._tell_all("lost", {"seat": member.tram.seat, "live": len(self.membership.live)})
        self._changes.lose(member.tram, time.monotonic())

    def _tell_joined(self, member: Member) -> None:
        detail = {
            "seat": member.tram.seat,
            "incarnation": member.tram.incarnation,
            "host": member.request.host,
            "pid": member.request.pid,
            "live": len(self.membership.live),
        }
        self._tell_all("joined", detail)

    def _tell_all(self, name: str, detail: Mapping[str, object]) -> None:
        self._hands.note(name, detail)
        self.announce(name, detail)

    def _settle(self) -> None:
        """Have everybody send by a new wiring, and tell the scheduler of that and of who joined and was lost."""
        changes, self._changes = self._changes, Changes()
        wiring, live = self.membership.rewire(), self.membership.live
        self._note_members()
        self._exchange.rewire(wiring)
        self._books.rewired(wiring)
        self.inbox.widen(len(live))
        order = self._frame(wiring)
        for member in live:
            self._channel.publish(self._keys.wiring(member.tram.seat), order, Lane.CONTROL)
        self._handle(events.Rewired(ways(wiring)))
        self.announce("rewired", {"epoch": wiring.epoch, "live": len(live)})
        if changes.lost:
            self._handle(events.WorkerLost(changes.lost[0], tuple(changes.lost[1:])))
        for tram in changes.joined:
            joined = self.membership.find(tram)
            if joined is not None:
                self._handle(events.WorkerReady(tram, joined.fresh))

    def _send(self, tram: Tram, message: Message) -> None:
        key, payload = self._exchange.outgoing(tram, message)
        began = time.perf_counter()
        self._links.publish(key, payload, Lane.LINK)
        self._blocked_seconds += time.perf_counter() - began

    def _publish(self, key: str, message: Message, lane: Lane) -> None:
        self._channel.publish(key, self._frame(message), lane)

    def _frame(self, message: Message) -> bytes:
        """Return the frame of a message for nobody in particular."""
        identity = self._exchange.identity
        header = Header(
            run=identity.run,
            epoch=self.membership.wiring.epoch,
            source=identity.seat,
            source_incarnation=identity.incarnation,
            destination=NOBODY,
        )
        return encode(header, message)

    def _stats(self, now: float) -> Stats:
        identity = self._exchange.identity
        return Stats(
            seat=ROOT,
            incarnation=identity.incarnation,
            state="waiting" if not self.membership.live else "running",
            uptime=now - self._started,
            busy=max(0.0, now - self._started - self.waited_seconds),
            blocked=self._blocked_seconds,
            evaluations=self._evaluations,
            chunks=self.chunks,
            queued=0,
            malformed=self._exchange.malformed,
            links=tuple(self._exchange.counters(self.inbox.waiting)),
            pid=os.getpid(),
            host=socket.gethostname(),
            tags=self.messages,
        )

    def _find(self, work: WorkId) -> Collection | None:
        for collection in self._open.get(_place(work), ()):
            whole = collection.work.work
            if whole.first <= work.first and work.last <= whole.last:
                return collection
        return None

    def _collection(self, work: WorkId) -> Collection:
        found = self._find(work)
        assert found is not None, f"{work} is not open"
        return found


def _place(work: WorkId) -> tuple[Kind, int, int]:
    return work.kind, work.population, work.step


def _describe_work(work: WorkId) -> str:
    what = {Kind.EVALUATE: "individual", Kind.EVOLVE: "population", Kind.TRACK: "point"}[work.kind]
    which = f"{work.first}" if work.size == 1 else f"{work.first} to {work.last - 1}"
    return f"{what} {which} of generation {work.step}"


def _describe(member: Member, now: float) -> dict[str, object]:
    return {
        "seat": member.tram.seat,
        "incarnation": member.tram.incarnation,
        "live": member.live,
        "host": member.request.host,
        "pid": member.request.pid,
        "heard_ago": now - member.heard if member.stats is not None else None,
    }
