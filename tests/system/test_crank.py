"""Connected populations on real workers: whoever holds which, the arm has the same bits."""

import json

import pytest
from processes import end, wait_until

pytestmark = pytest.mark.system

RUN = ("run", "crank", "--seed", 1)
SPATIAL = (*RUN, "--variant", "spatial", "--generations", 200)


def test_one_two_four_and_seven_workers_design_the_same_arm(start):
    runs, results = [], []
    for workers in (1, 2, 4, 7):
        runs.append(start(*RUN, "--generations", 30, "--workers", workers, out=f"w{workers}"))
        results.append(runs[-1].result())
    designs = {(run.folder / "design.json").read_text() for run in runs}

    assert len({result["final_population_sha256"] for result in results}) == 1
    assert len(designs) == 1
    assert all(result["verified"] for result in results)


def test_populations_of_a_killed_worker_move_and_nothing_else_changes(start):
    undisturbed = start(*SPATIAL, "--population", 1500, "--workers", 2, out="undisturbed").result()
    run = start(*SPATIAL, "--population", 1500, "--workers", 2)
    run.wait_for_generation(25)
    victim = run.workers()[0]

    end(victim)
    wait_until(lambda: run.ended or victim not in run.workers(), "the loss to be seen")
    result = run.result()

    assert result["lost_workers"] == 1
    assert result["final_population_sha256"] == undisturbed["final_population_sha256"]
    assert result["best"] == undisturbed["best"]
    log = (run.folder / "log.jsonl").read_text()
    assert "restored from its snapshot" in log


def test_a_worker_sends_one_message_a_generation_and_a_snapshot_every_ten(start):
    result = start(*SPATIAL, "--workers", 2).result()

    messages = result["messages"]
    assert messages["population-means"]["received"] == 2 * 201
    assert messages["population-snapshot"]["received"] == 2 * 20
    each = messages["population-means"]["received_bytes"] / (2 * 201)
    assert each < 1000  # what a generation of two populations of 100 individuals tells


def test_a_killed_root_goes_on_with_the_same_populations(start):
    words = (*SPATIAL, "--population", 1500, "--workers", 2, "--checkpoint-seconds", 0)
    undisturbed = start(*words, out="undisturbed").result()
    run = start(*words)
    run.wait_for_generation(25)

    run.process.kill()
    run.finish()
    resumed = start("resume", run.folder, "--no-pictures", "--progress", "quiet")

    assert resumed.finish() == 0, resumed.output
    result = json.loads((run.folder / "result.json").read_text())
    assert result["final_population_sha256"] == undisturbed["final_population_sha256"]


@pytest.mark.parametrize("method", ["single-ga", "bilevel-cma"])
def test_the_methods_it_is_compared_with_run_too(start, method):
    run = start(*RUN, "--method", method, "--generations", 60, "--workers", 1)

    result = run.result()

    assert result["method"] == method
    assert result["quality"]["designed"] > 0.9


def test_an_unknown_variant_is_refused_with_those_there_are(start):
    run = start(*RUN, "--variant", "walking")

    assert run.finish() == 2
    assert "--variant: found 'walking', expected one of" in run.output.replace("\n", " ")
