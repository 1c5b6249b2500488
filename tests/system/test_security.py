"""Who may join: docs/security.md, carried out. Certificates by openssl and by ``tramnet certificates``."""

import re
import shutil
import socket
import subprocess
import time
from pathlib import Path

import pytest
from processes import descendants, wait_until
from undisturbed import SPHERE, assert_undisturbed

from tramnet_protocol.channel import Lane
from tramnet_protocol.errors import BadCredentials, CannotConnect, NoAnswer
from tramnet_protocol.keys import Keys
from tramnet_protocol.security import KEY, SEATS, Credentials
from tramnet_protocol.transport import open_observer, open_root, open_worker

pytestmark = pytest.mark.system

DOCUMENT = Path(__file__).parents[2] / "docs" / "security.md"
KEYS = Keys("tramnet")


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", DOCUMENT.read_text(), re.DOTALL)
    assert found is not None
    return found[1]


def by_openssl(folder: Path, *others: str) -> Path:
    """Make certificates as the document says."""
    if shutil.which("openssl") is None:
        pytest.skip("there is no openssl")
    folder.mkdir()
    script = block("bash").replace(
        "root lab-2 lab-3", " ".join(["root", "lab-2", "lab-3", *others])
    )
    subprocess.run(
        ["bash", "-euo", "pipefail", "-c", script], cwd=folder, check=True, capture_output=True
    )
    (folder / "root" / SEATS).write_text(block("toml"))
    return folder


@pytest.fixture(scope="module")
def secure(tmp_path_factory):
    return by_openssl(tmp_path_factory.mktemp("pki") / "secure", "unlisted")


@pytest.fixture
def root(secure, tmp_path):
    """A root that notes all it is told."""
    told = []

    def note(key, what):
        told.append((key.removeprefix("tramnet/v1/tramnet/"), what))

    credentials = Credentials.load(secure / "root")
    observers = f"unixsock-stream/{tmp_path}/o"
    with open_root("tramnet", ["tls/127.0.0.1:0"], [observers], credentials) as channel:
        channel.told = told
        # As a root does, which those who may come are told of; and all the rest, to hear what should not pass.
        for pattern in (KEYS.links_to(0), KEYS.all_stats, KEYS.everything):
            channel.subscribe(pattern, note)
        channel.watch_tokens(KEYS.all_alive, note)
        for key in (KEYS.join, KEYS.join_as_anybody, KEYS.control):
            channel.serve(key, lambda query: query.reply(query.key.encode()))
        channel.declare_token(KEYS.alive(0))
        yield channel


def heard(channel, pattern):
    got = []
    channel.subscribe(pattern, lambda key, payload: got.append(payload))
    return got


def test_a_name_writes_and_hears_what_is_its_own_and_nothing_else(secure, root):
    with open_worker(root.endpoint, Credentials.load(secure / "lab-2")) as worker:
        assert worker.ask(KEYS.join_as("lab-2"), b"", 5.0) == KEYS.join_as("lab-2").encode()
        for key in (KEYS.join_as("lab-3"), KEYS.join, KEYS.control):
            with pytest.raises(NoAnswer, match="nobody answers"):
                worker.ask(key, b"", 5.0)
        own, others = heard(worker, KEYS.links_to(9)), heard(worker, KEYS.links_to(17))
        for seat in (
            17,
            9,
        ):  # what is not allowed comes first: it had its chance when the last passes
            worker.publish(KEYS.link(seat, 0), b"frame", Lane.LINK)
            worker.publish(KEYS.stats(seat), b"stats", Lane.TELEMETRY)
            worker.publish(KEYS.wiring(seat), b"wiring", Lane.CONTROL)
            worker.declare_token(KEYS.alive(seat))
        worker.publish(KEYS.events, b"event", Lane.TELEMETRY)
        worker.publish(KEYS.link(9, 0), b"last", Lane.LINK)
        wait_until(lambda: ("link/9/0", b"last") in root.told, "the last frame")
        wait_until(lambda: ("alive/9", True) in root.told, "the token")
        told = set(root.told)
        root.publish(KEYS.link(0, 17), b"to another", Lane.LINK)
        root.publish(KEYS.link(0, 9), b"to it", Lane.LINK)
        wait_until(lambda: own, "a frame to it")

    assert told == {
        ("alive/0", True),
        ("link/9/0", b"frame"),
        ("stats/9", b"stats"),
        ("alive/9", True),
        ("link/9/0", b"last"),
    }
    assert own == [b"to it"]
    assert others == []


def test_a_certificate_whose_name_is_not_listed_gets_nothing(secure, root):
    with open_worker(root.endpoint, Credentials.load(secure / "unlisted")) as stranger:
        got = heard(stranger, KEYS.everything)
        with pytest.raises(NoAnswer):
            stranger.ask(KEYS.join_as("unlisted"), b"", 5.0)
        root.publish(KEYS.events, b"event", Lane.TELEMETRY)
        with open_worker(root.endpoint, Credentials.load(secure / "lab-2")) as known:
            events = heard(known, KEYS.events)
            known.publish(KEYS.link(9, 0), b"ready", Lane.LINK)
            wait_until(lambda: ("link/9/0", b"ready") in root.told, "the other worker")
            root.publish(KEYS.events, b"event", Lane.TELEMETRY)
            wait_until(lambda: events, "an event")

        assert got == []


def test_a_stranger_is_told_that_nobody_answers(secure, root, tmp_path):
    foreign = by_openssl(tmp_path / "foreign")
    attempts = [
        (root.endpoint, None, "it asks for a certificate"),
        (root.endpoint.replace("tls/", "tcp/"), None, "nobody answers at"),
        (root.endpoint, Credentials.load(foreign / "lab-2"), "it refuses the certificate of lab-2"),
    ]
    for endpoint, credentials, words in attempts:
        began = time.monotonic()
        with pytest.raises(CannotConnect, match=words):
            open_worker(endpoint, credentials)
        assert time.monotonic() - began < 5.0

    assert root.told == [("alive/0", True)]


def test_observers_and_the_root_s_own_certificate_hear_everything_and_steer(secure, root):
    for channel in (
        open_observer(root.endpoints[-1]),
        open_observer(root.endpoint, Credentials.load(secure / "root")),
    ):
        with channel:
            got = heard(channel, KEYS.everything)
            assert channel.ask(KEYS.control, b"", 5.0) == KEYS.control.encode()
            root.publish(KEYS.link(0, 17), b"frame", Lane.LINK)
            wait_until(lambda got=got: got, "a frame")


def test_a_key_that_others_may_read_is_refused(secure, tmp_path):
    shutil.copytree(secure / "lab-2", tmp_path / "lab-2")
    (tmp_path / "lab-2" / KEY).chmod(0o640)

    with pytest.raises(BadCredentials, match="found mode 0640, expected 0600"):
        Credentials.load(tmp_path / "lab-2")


def free_endpoint() -> str:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"tls/127.0.0.1:{free.getsockname()[1]}"


def secrets_in(folder: Path) -> list[str]:
    """The lines of all private keys."""
    keys = [path.read_text() for path in folder.rglob("*key.pem")]
    return [line for key in keys for line in key.splitlines() if "-----" not in line]


def test_a_run_with_certificates_of_tramnet_s_own_is_undisturbed_and_keeps_its_secrets(
    start, tmp_path
):
    secure, endpoint = tmp_path / "secure", free_endpoint()
    assert start("certificates", secure, "lab-2", "--seats", 2).finish() == 0
    words = (
        "--generations",
        25,
        "--set",
        "delay=0.004",
        "--tls",
        secure / "root",
        "--listen",
        endpoint,
    )
    run = start(*SPHERE, *words, "--workers", 1)
    lab = start("worker", "--connect", endpoint, "--tls", secure / "lab-2")
    run.wait_for_workers(2)
    seats = {member["seat"] for member in run.status()["workers"]}

    with pytest.raises(CannotConnect):
        open_worker(endpoint)
    with open_worker(endpoint, Credentials.load(secure / "lab-2")) as liar:
        for _ in range(100):
            liar.publish(KEYS.link(1, 0), b"forged", Lane.LINK)
    commands = [
        Path(f"/proc/{pid}/{what}").read_bytes().decode(errors="replace")
        for pid in (run.pid, *descendants(run.pid), lab.pid, *descendants(lab.pid))
        for what in ("cmdline", "environ")
    ]
    malformed = run.status()["malformed"]

    assert_undisturbed(run)
    assert lab.finish() == 0
    assert seats == {1, 3}
    assert malformed == 0
    files = [path.read_text(errors="replace") for path in run.folder.iterdir()]
    for secret in secrets_in(secure):
        assert not any(secret in text for text in (*commands, *files, run.output, lab.output))
