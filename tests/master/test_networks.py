import fcntl
import os
import subprocess
import sys

import pytest

from tramnet_master import networks
from tramnet_master.errors import AmbiguousNetwork, NetworkTaken, NoNetwork, UnsafeFolder


@pytest.fixture(autouse=True)
def private_runtime_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


def live(network: str) -> networks.LiveNetwork:
    return networks.LiveNetwork(
        network, "tcp/127.0.0.1:1", "unixsock-stream//o", os.getpid(), "runs/x"
    )


def test_a_held_and_announced_network_is_found_by_name_and_as_the_only_one():
    with networks.hold("alpha") as claim:
        claim.announce(live("alpha"))

        assert networks.find("alpha") == live("alpha")
        assert networks.find() == live("alpha")


def test_a_name_is_free_again_when_its_root_ends():
    with networks.hold("alpha") as claim:
        claim.announce(live("alpha"))

    with pytest.raises(NoNetwork, match="none is live here"):
        networks.find("alpha")
    with networks.hold("alpha"):
        pass


def test_a_second_root_of_the_same_name_is_refused_and_told_who_holds_it():
    with networks.hold("alpha") as claim:
        claim.announce(live("alpha"))

        with (
            pytest.raises(NetworkTaken, match=f"process {os.getpid()}.*--network"),
            networks.hold("alpha"),
        ):
            pass


def test_whoever_only_looks_whether_a_name_is_held_keeps_no_root_from_taking_it(
    tmp_path, monkeypatch
):
    networks.runtime_folder()
    with (tmp_path / "tramnet" / "alpha.json").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_SH)
        monkeypatch.setattr(networks.time, "sleep", lambda _: fcntl.flock(file, fcntl.LOCK_UN))

        with networks.hold("alpha"):
            pass


def test_a_killed_root_holds_its_name_no_longer():
    script = (
        "import os, sys; from tramnet_master import networks\n"
        "claim = networks.hold('alpha'); held = claim.__enter__()\n"
        "held.announce(networks.LiveNetwork('alpha', 'e', 'o', os.getpid(), 'f'))\n"
        "print('held', flush=True); sys.stdin.read()"
    )
    root = subprocess.Popen(
        [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    with root:
        assert root.stdout.readline() == b"held\n"
        assert networks.find("alpha").pid == root.pid
        root.kill()

    with pytest.raises(NoNetwork):
        networks.find("alpha")


def test_several_live_networks_must_be_told_apart_by_name():
    with networks.hold("alpha") as alpha, networks.hold("beta") as beta:
        alpha.announce(live("alpha"))
        beta.announce(live("beta"))

        with pytest.raises(AmbiguousNetwork, match="alpha, beta"):
            networks.find()
        assert networks.find("beta") == live("beta")


def test_a_runtime_folder_open_to_others_is_refused(tmp_path):
    (tmp_path / "tramnet").mkdir(mode=0o700)
    (tmp_path / "tramnet").chmod(0o755)

    with pytest.raises(UnsafeFolder, match="0755"):
        networks.find()
