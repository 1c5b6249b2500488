"""Makes a run: network, workers, engine, checkpoints and the end, in the one place where they meet."""

import dataclasses
import hashlib
import itertools
import os
import secrets
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np

from tramnet_master import networks
from tramnet_master.checkpoints import Checkpoint
from tramnet_master.csv_tables import write_table
from tramnet_master.engines.engine import Engine, HoldsPopulations
from tramnet_master.errors import (
    CannotWrite,
    Interrupted,
    NetworkTaken,
    RunFailed,
    RunStopped,
    TaskTooLarge,
)
from tramnet_master.experiments.experiment import Common, Experiment, Load, Timing
from tramnet_master.experiments.run_options import RunOptions
from tramnet_master.experiments.trust import Trust
from tramnet_master.farm.audit import Answer, Audit
from tramnet_master.farm.dispatcher import Farm, Hands
from tramnet_master.farm.membership import Member
from tramnet_master.farm.reception import House
from tramnet_master.farm.scheduler import Scheduler
from tramnet_master.history import History
from tramnet_master.progress import Outline, Progress
from tramnet_master.results import BestFound, Booked, Messages, Result, versions
from tramnet_master.run_folder import HISTORY, LINKS, OpenRunFolder
from tramnet_master.signals import ending, interrupting
from tramnet_protocol.codec import encode_body
from tramnet_protocol.errors import BadTopology, MalformedFrame, MessageTooLarge
from tramnet_protocol.keys import Keys, check_network
from tramnet_protocol.links import LinkTiming
from tramnet_protocol.messages import ControlReply, ControlRequest, Evolve, Setup, Work
from tramnet_protocol.pacing import Pacer
from tramnet_protocol.packing import unpack
from tramnet_protocol.security import Credentials
from tramnet_protocol.transport import ZenohChannel, open_root
from tramnet_workers.kernels.fingerprint import kernel_fingerprint
from tramnet_workers.node.evaluator import Evaluator
from tramnet_workers.node.supervisor import Ended, Supervisor

ANNOUNCE_PERIOD = 0.1
"""Shortest time between two announcements of a generation [s]."""

PATIENCE = 3600.0
"""How long local workers look for their root [s]; they end with it however it ends, so this need not be short."""

START_UP = 60.0
"""Longest wait for the first local worker before the clock of the run starts [s]."""

OTHERS = 3.0
"""Longest wait for the other local workers after the first [s]."""


def run(
    experiment: Experiment,
    options: RunOptions,
    open_folder: Callable[[dict[str, object]], OpenRunFolder],
    progress: Progress,
    again: Callable[[], Experiment] | None = None,
) -> tuple[Path, Result]:
    """Make a run, or go on with one whose folder has a checkpoint.

    Args:
        experiment: What to run.
        options: How.
        open_folder: Opens the run folder, given what its ``run.toml`` is to say.
        progress: Where to show it.
        again: Prepares the same experiment once more, to go back where a worker has lied.

    Returns:
        The run folder and the result.

    Raises:
        Interrupted: Somebody asked it to stop.
        RunStopped: It cannot go on, and can be resumed once the cause is gone.
    """
    options.check()
    _check_that_it_travels(experiment.setup)
    with interrupting(), ExitStack() as stack:
        network, claim = stack.enter_context(_hold(options.network))
        runtime = networks.runtime_folder()
        own = f"unixsock-stream/{runtime / f'{network}.sock'}"
        observers = [own, options.observers] if options.observers else [own]
        credentials = Credentials.load(options.tls) if options.tls else None
        channel = stack.enter_context(
            open_root(network, [options.endpoint], observers, credentials)
        )
        folder = stack.enter_context(open_folder(_document(experiment, options, network, channel)))
        try:
            claim.announce(
                networks.LiveNetwork(
                    network, channel.endpoint, own, os.getpid(), str(folder.path.absolute())
                )
            )
            root = Root(experiment, options, network, channel, folder, progress, again)
            with root:
                return folder.path, root.run()
        except (KeyboardInterrupt, BrokenPipeError) as error:
            raise Interrupted(folder.path) from error
        except CannotWrite as error:
            raise RunStopped(folder.path, str(error)) from error


class Root:
    """The root TRAM of one run.

    Args:
        experiment: What to run.
        options: How.
        network: Name of the network.
        channel: Its end of the network.
        folder: The run folder.
        progress: Where to show it.
        again: Prepares the same experiment once more.
    """

    def __init__(
        self,
        experiment: Experiment,
        options: RunOptions,
        network: str,
        channel: ZenohChannel,
        folder: OpenRunFolder,
        progress: Progress,
        again: Callable[[], Experiment] | None,
    ) -> None:
        self._experiment = experiment
        self._options = options
        self._network = network
        self._channel = channel
        self._folder = folder
        self._progress = progress
        self._again = again
        self._trust = Trust()
        self._evaluator: Evaluator | None = None
        self._name = f"{socket.gethostname()}-{os.getpid()}"
        self._supervisor: Supervisor | None = None
        self._before = _Past()  # what earlier parts of a resumed run have used up
        self._began = self._over = 0.0
        self._shape = options.shape()
        rules = options.rules()
        house = House(
            secrets.randbits(62),
            int(time.time()),
            experiment.setup,
            kernel_fingerprint(),
            options.allow_mixed,
            options.pace_of_links(),
            Credentials.load(options.tls).seats() if options.tls else None,
        )
        hands = Hands(
            self._replace, self._steer, self._tell, self._give_up, self._restate, folder.log,
            lambda tram: self._trust.note(tram, self._experiment.engine),
        )  # fmt: skip
        audit = Audit(options.audit, secrets.token_bytes(16), self._recompute)
        self._books = options.books()
        self._pacer = Pacer(channel, LinkTiming.of(house.pace)) if house.pace else None
        self._farm = Farm(
            channel,
            Keys(network),
            house,
            self._shape,
            Scheduler(rules),
            hands,
            self._books,
            self._pacer,
            audit if options.audit else None,
        )

    def __enter__(self) -> "Root":
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        try:
            # What did not come to its end can be resumed: workers from elsewhere wait, local ones end in any case.
            if error is None:
                self._farm.dismiss("the run is over")
        finally:
            if self._supervisor is not None:
                self._supervisor.close()
            if self._pacer is not None:
                self._pacer.close()

    def run(self) -> Result:
        """Make the run; return its result.

        Raises:
            Interrupted: Somebody asked it to stop.
        """
        experiment, folder = self._experiment, self._folder
        checkpoint = folder.checkpoints.load_latest()
        if checkpoint is not None:
            self._before = _Past.of(checkpoint)
            saved = checkpoint.state["engine"]
            assert isinstance(saved, dict), "a checkpoint of ours holds the engine's state"
            experiment.engine.restore(saved)
            books = checkpoint.state.get("books")
            if self._books is not None and isinstance(books, dict):
                self._books.restore(books)
        self._start_workers()
        # Compiled once and here; workers are let in when that is done.
        self._evaluator = Evaluator(experiment.setup)
        self._farm.open()
        folder.log(
            "open", {"endpoint": self._channel.endpoint, "generation": experiment.engine.generation}
        )
        outline = Outline(
            experiment.title,
            experiment.generations,
            experiment.engine.generation,
            experiment.engine.evaluations,
        )
        with ending(self._farm.interrupt):
            self._progress.start(outline)
            try:
                with History(folder.path / HISTORY, experiment.engine.generation) as history:
                    self._evolve(history)
            finally:
                self._progress.finish()
            return self._conclude()

    def _start_workers(self) -> None:
        arguments = ["--connect", self._channel.endpoint, "--network", self._network]
        arguments += ["--supervisor", self._name, "--patience", str(PATIENCE)]
        arguments += ["--memory", str(self._options.worker_memory)]
        if self._options.tls:
            arguments += ["--tls", str(self._options.tls)]
        self._supervisor = Supervisor(arguments, self._options.workers, self._ended)

    def _wait_for_local_workers(self) -> None:
        """Start with all of them, but let one that cannot start keep nobody waiting."""
        farm, wanted = self._farm, self._options.workers
        if self._experiment.engine.finished or not wanted:
            return
        farm.wait_for(lambda: bool(farm.membership.live), START_UP)
        farm.wait_for(lambda: len(farm.membership.live) >= wanted and farm.settled, OTHERS)

    def _evolve(self, history: History) -> None:
        engine, farm = self._experiment.engine, self._farm
        self._wait_for_local_workers()
        self._began = time.monotonic()
        due = CheckpointsDue(self._options, self._began)
        next_announcement = self._began
        self._submit_what_can_be_begun()
        while not engine.finished:
            try:
                finished = farm.next_outcome()
            except RunFailed as error:
                self._save(history, engine)
                raise RunStopped(self._folder.path, str(error)) from error
            if farm.liars:
                engine = self._go_back(history)
                continue
            if finished is None:
                self._save(history, engine)
                raise Interrupted(self._folder.path)
            if finished.snapshot is not None:
                assert isinstance(engine, HoldsPopulations), "nobody else asks for snapshots"
                engine.keep(finished.snapshot)
            rows = engine.tell(finished.work, finished.outcome)
            self._submit_what_can_be_begun()  # workers compute while rows are written
            if not rows:
                continue
            now = time.monotonic()
            history.append(rows, self._elapsed(now))
            row = rows[-1]
            self._progress.update(
                row.generation, row.best_so_far, row.evaluations, len(farm.membership.live)
            )
            if now >= next_announcement or engine.finished:
                next_announcement = now + ANNOUNCE_PERIOD
                farm.announce("generation", row._asdict())
            if not engine.finished and due.after(engine.generation, now):
                self._save(history, engine)
        self._over = time.monotonic()

    def _go_back(self, history: History) -> Engine:
        """Go back to before a liar had any part in the run, and on from there without it."""
        farm = self._farm
        self._folder.checkpoints.forget_after(self._trust.go_back(farm.liars).generation)
        while farm.busy and farm.next_outcome() is not None:
            pass  # what is open still has nothing to do with the run any more
        before = self._trust.go_back(farm.liars)  # there may be more of them by now
        if self._again is None:
            raise RunFailed("a worker has lied, and this run cannot be begun again")
        self._tell(
            f"back to generation {before.generation}: nothing that was answered by "
            f"{', '.join(f'TRAM {tram.seat}' for tram in sorted(farm.liars))} is kept"
        )
        self._folder.checkpoints.forget_after(before.generation)
        history.go_back(before.generation)
        farm.liars.clear()
        farm.forget_holders()
        farm.condemned = [one for one in farm.condemned if one[0].step <= before.generation]
        self._experiment = self._again()
        engine = self._experiment.engine
        if before.state is not None:
            engine.restore(before.state)
        self._submit_what_can_be_begun()
        return engine

    def _recompute(self, work: Work) -> Answer:
        assert self._evaluator is not None, "nothing is answered before the root can compute"
        return self._evaluator.compute(work), self._evaluator.snapshot(work)

    def _submit_what_can_be_begun(self) -> None:
        engine = self._experiment.engine
        if isinstance(engine, HoldsPopulations):
            engine.spread(max(1, len(self._farm.membership.live)))
        for work in engine.ask():
            self._farm.submit(work)

    def _save(self, history: History, engine: Engine) -> None:
        if engine.generation == 0:
            return
        history.flush()
        state = {
            "engine": engine.state(),
            "elapsed": self._elapsed(time.monotonic()),
            "lost": self._lost,
            "condemned": self._condemned,
            "mixed": self._mixed,
            "books": None if self._books is None else self._books.state(),
        }
        self._folder.checkpoints.save(state, engine.generation)

    def _conclude(self) -> Result:
        experiment, farm = self._experiment, self._farm
        engine = experiment.engine
        wall = self._elapsed(self._over)
        common = Common(
            experiment=experiment.name,
            method=experiment.method,
            case=experiment.case,
            seed=experiment.seed,
            population_size=experiment.population_size,
            generations=engine.generation,
            evaluations=engine.evaluations,
            best=BestFound(engine.best.objective, engine.best.generation),
            wall_seconds=wall,
            workers=len(farm.membership.live),
            topology=self._shape.name,
            lost_workers=self._lost,
            condemned=self._condemned,
            reproducible=not self._mixed,
            final_population_sha256=population_hash(engine),
            paper=experiment.paper,
            versions=versions(),
            link_books=self._close_books(),
        )
        here = max(self._over - self._began, 1e-9)
        live = max(1, len(farm.membership.live))
        share = farm.compute_seconds / min(live, experiment.parallelism or live)
        timing = Timing(
            evaluations_per_second=engine.evaluations / max(wall, 1e-9),
            network_overhead_fraction=max(0.0, farm.waited_seconds - share) / here,
        )
        farm.announce("finished", {"best": engine.best.objective})
        busy = tuple(farm.busy_seconds[tram] for tram in sorted(farm.busy_seconds))
        load = Load(farm.chunks, busy)
        result = experiment.conclude(self._folder, common, timing, load)
        expelled = [
            {"seat": t.seat, "host": m.request.host, "pid": m.request.pid, "certificate": m.name}
            for t, m in farm.expelled.items()
        ]
        result = msgspec.structs.replace(result, messages=self._messages(), expelled=expelled)
        self._folder.write_result(result)
        return result

    def _messages(self) -> dict[str, Messages]:
        counted = self._farm.messages
        return {
            c.tag: Messages(c.sent, c.sent_bytes, c.received, c.received_bytes)
            for c in counted
            if c.sent or c.received
        }

    def _close_books(self) -> Booked | None:
        if self._books is None:
            return None
        write_table(self._folder.path / LINKS, self._books.totals.columns())
        return self._books.summary(self._options.mbaud)

    def _elapsed(self, now: float) -> float:
        return self._before.elapsed + now - self._began

    @property
    def _lost(self) -> int:
        return self._before.lost + self._farm.lost

    @property
    def _mixed(self) -> bool:
        return self._before.mixed or self._farm.reception.mixed

    @property
    def _condemned(self) -> list[dict[str, object]]:
        here = [
            {"population": w.population, "generation": w.step, "individual": i, "reason": reason}
            for w, reason in self._farm.condemned
            for i in range(w.first, w.last)
        ]
        # A generation that was begun twice, before a resume and after it, condemns the same ones twice.
        every = [*self._before.condemned, *here]
        return list({tuple(one.values())[:3]: one for one in every}.values())

    # What the farm and people ask for.

    def _replace(self, member: Member, _: str) -> None:
        if member.request.supervisor == self._name and self._supervisor is not None:
            self._supervisor.replace(member.request.pid)

    def _give_up(self, what: str) -> None:
        self._tell(f"gave up {what}")
        if self._options.on_failure == "stop":
            raise RunFailed(f"{what} (--on-failure stop)")

    def _restate(self, work: Evolve) -> Evolve:
        engine = self._experiment.engine
        assert isinstance(engine, HoldsPopulations), "nobody else has work on populations"
        return engine.restate(work)

    def _ended(self, ended: Ended) -> None:
        self._farm.inbox.put(ended)
        with suppress(CannotWrite):  # on the supervisor's thread; the main one will meet it too
            self._folder.log("ended", {"pid": ended.pid, "status": ended.status})

    def _steer(self, request: ControlRequest) -> ControlReply:
        """Do what somebody asks.

        Raises:
            ValueError: It cannot be done.
        """
        supervisor = self._supervisor
        match request.action:
            case "scale" if request.workers is not None and supervisor is not None:
                self._check_room(request.workers)
                supervisor.scale(request.workers)
                text = f"{self._network} keeps {request.workers} local workers from now on"
            case "stop":
                self._farm.interrupt()
                text = f"{self._network} stops after writing a checkpoint"
            case "status":  # asked for every second by those who watch: not worth a line of the log
                text = f"{self._network}: generation {self._experiment.engine.generation}"
                return ControlReply(text, self._status())
            case _:
                raise ValueError(
                    f"found the action {request.action!r} with {request.workers} workers, "
                    "expected scale with a number, stop or status"
                )
        self._tell(text)
        return ControlReply(text, self._status())

    def _check_room(self, workers: int) -> None:
        try:
            self._shape.check_room(1 + workers)
        except BadTopology as error:
            raise ValueError(str(error)) from error

    def _status(self) -> dict[str, object]:
        engine = self._experiment.engine
        return {
            "title": self._experiment.title,
            "folder": str(self._folder.path.absolute()),
            "generation": engine.generation,
            "generations": self._experiment.generations,
            "evaluations": engine.evaluations,
            "best": engine.best.objective if engine.generation else None,
            "local_workers": self._supervisor.count if self._supervisor is not None else 0,
            "observers": list(self._channel.endpoints[1:]),
            **self._farm.status(),
        }

    def _tell(self, text: str) -> None:
        self._folder.log("message", {"text": text})
        self._progress.message(text)


class CheckpointsDue:
    """When a checkpoint is due: every so many generations where a number is given, else by time.

    Args:
        options: The number and the time.
        now: Monotonic time [s].
    """

    def __init__(self, options: RunOptions, now: float) -> None:
        self._every = options.checkpoint_generations
        self._period = options.checkpoint_seconds
        self._next = now + self._period

    def after(self, generation: int, now: float) -> bool:
        """Return whether one is due at the end of a generation.

        Args:
            generation: Its number, from 1.
            now: Monotonic time [s].
        """
        if self._every:
            return generation % self._every == 0
        if now < self._next:
            return False
        self._next = now + self._period
        return True


@dataclass(frozen=True)
class _Past:
    """What the parts of a run before a resume have used up."""

    elapsed: float = 0.0
    lost: int = 0
    condemned: list[dict[str, object]] = field(default_factory=list)
    mixed: bool = False

    @classmethod
    def of(cls, checkpoint: Checkpoint) -> "_Past":
        kept = {name: checkpoint.state[name] for name in ("elapsed", "lost", "condemned", "mixed")}
        return msgspec.convert(kept, cls, strict=True)


def population_hash(engine: Engine) -> str:
    """Return the SHA-256 over an engine's final arrays, little-endian and in C order."""
    digest = hashlib.sha256()
    for array in engine.final_arrays():
        little = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
        digest.update(little.tobytes())
    return digest.hexdigest()


def _check_that_it_travels(setup: Setup) -> None:
    """Check that workers can be told of a problem, before any of them is asked to come.

    Raises:
        TaskTooLarge: It is above a limit of the protocol.
    """
    try:
        unpack(encode_body(setup))
    except (MessageTooLarge, MalformedFrame) as error:
        raise TaskTooLarge(setup.problem, str(error)) from error


@contextmanager
def _hold(network: str | None) -> Iterator[tuple[str, networks.Claim]]:
    """Claim the name asked for, or the first free one of ``tramnet``, ``tramnet-2``, ..."""
    if network is not None:
        check_network(network)
        with networks.hold(network) as claim:
            yield network, claim
        return
    with ExitStack() as stack:
        for number in itertools.count(1):
            suffix = "" if number == 1 else f"-{number}"
            name = networks.DEFAULT_NETWORK + suffix
            try:
                claim = stack.enter_context(networks.hold(name))
            except NetworkTaken:
                continue
            yield name, claim
            return


def _document(
    experiment: Experiment, options: RunOptions, network: str, channel: ZenohChannel
) -> dict[str, object]:
    return {
        "experiment": experiment.name,
        "method": experiment.method,
        "seed": experiment.seed,
        "population": experiment.population_size,
        "generations": experiment.generations,
        "farm": {
            **dataclasses.asdict(options),
            "tls": options.tls and options.tls.absolute(),
            "links": options.shape().links,
            "network": network,
            "endpoint": channel.endpoint,
        },
        experiment.name: dict(experiment.document),
    }
