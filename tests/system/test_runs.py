"""The farm in real processes over Zenoh: whatever happens to workers and root, the result is the same."""

import json
import signal
import socket

import pytest
from processes import end, is_alive, wait_until
from undisturbed import SPHERE, assert_undisturbed

pytestmark = pytest.mark.system

GENERATIONS = 25
SLOW = (*SPHERE, "--set", "delay=0.01", "--generations", GENERATIONS)


@pytest.mark.parametrize("workers", [1, 2, 3, 5])
def test_any_number_of_workers_computes_what_a_serial_run_computes(start, workers):
    run = start(*SPHERE, "--generations", GENERATIONS, "--workers", workers)

    assert_undisturbed(run)


def test_a_killed_worker_is_replaced_and_nothing_is_lost(start):
    run = start(*SLOW, "--workers", 2)
    run.wait_for_generation(2)
    victim = run.workers()[0]

    end(victim)
    wait_until(lambda: victim not in run.workers(), "the loss to be seen")
    assert run.wait_for_workers(2)

    assert assert_undisturbed(run)["lost_workers"] >= 1


def test_workers_that_join_a_tree_in_mid_run_share_the_work(start):
    run = start(*SLOW, "--workers", 1, "--topology", "tree")
    run.wait_for_generation(1)

    assert start("scale", 3).finish() == 0
    joined = run.wait_for_workers(3)

    assert len(joined) == 3
    assert_undisturbed(run)


def test_a_root_without_workers_waits_and_says_so_until_some_come_from_elsewhere(start):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    early = start("worker", "--connect", endpoint, "--count", 1)
    root = start(*SLOW, "--workers", 0, "--listen", endpoint)

    assert_undisturbed(root)
    log = [json.loads(line) for line in (root.folder / "log.jsonl").read_text().splitlines()]
    assert any("waiting" in entry.get("text", "") for entry in log)
    assert early.finish() == 0, early.output


def test_a_run_whose_root_is_killed_goes_on_where_it_was_and_leaves_no_worker(start):
    run = start(*SLOW, "--workers", 2, "--checkpoint-seconds", 0)
    run.wait_for_generation(5)
    orphans = run.workers()

    run.process.kill()
    run.finish()
    wait_until(lambda: not any(map(is_alive, orphans)), "the workers to follow their root")
    resumed = start("resume", run.folder, "--no-pictures", "--progress", "quiet")

    assert_undisturbed(resumed)


def test_ctrl_c_writes_a_checkpoint_and_says_how_to_go_on(start):
    run = start(*SLOW, "--workers", 1, "--checkpoint-seconds", 600)
    run.wait_for_generation(3)

    run.process.send_signal(signal.SIGINT)

    assert run.finish() == 130
    assert f"tramnet resume {run.folder}" in run.output.replace("\n", " ")
    assert list(run.folder.glob("checkpoint-*.tramnet"))
    assert_undisturbed(start("resume", run.folder, "--no-pictures", "--progress", "quiet"))


def test_a_second_root_of_the_same_name_is_refused(start):
    first = start(*SLOW, "--workers", 1, "--network", "alpha")
    first.wait_for_generation(1)

    second = start(*SLOW, "--workers", 1, "--network", "alpha", out="other")

    assert second.finish() == 1
    assert "held by process" in second.output
    assert_undisturbed(first)


def test_what_nobody_can_run_is_refused_in_words(start):
    run = start("run", "problem", "spere")

    assert run.finish() == 2
    assert "no problem is named 'spere'; installed are" in run.output.replace("\n", " ")


@pytest.mark.parametrize("method", ["wang-zalzala", "smooth"])
def test_the_main_job_comes_out_the_same_for_one_worker_and_for_three_in_a_line(start, method):
    words = ("run", "puma560", "--method", method, "--population", 60, "--generations", 30)
    one, three = (
        start(*words, "--workers", workers, "--topology", topology, out=topology).result()
        for workers, topology in ((1, "star"), (3, "pipeline"))
    )

    assert one["final_population_sha256"] == three["final_population_sha256"]
    assert one["best"] == three["best"]
    assert one["motion_time_s"] == three["motion_time_s"]
