"""Paths followed over the network: whoever follows which point, the path has the same bits."""

import json

import pytest
from processes import end, wait_until

pytestmark = pytest.mark.system

RUN = ("run", "redundant8", "--seed", 1)
SPLIT = (*RUN, "--population", 120, "--subpopulations", 4)


@pytest.fixture
def short(tmp_path):
    """A task file: the first 120 steps of the paper's line."""
    path = tmp_path / "short.toml"
    path.write_text(
        "[path]\npoints_cm = [[17.0, 57.6, 30.5], [16.28, 63.888, 31.64]]\nsteps = 120\n"
    )
    return path


def test_sub_populations_find_the_same_path_on_one_two_and_three_workers(start, short):
    results = [
        start(*SPLIT, "--task", short, "--workers", workers, out=f"w{workers}").result()
        for workers in (1, 2, 3)
    ]

    assert len({result["final_population_sha256"] for result in results}) == 1
    assert all(result["network"]["exchanges"] == 4 * 120 for result in results)


@pytest.mark.parametrize("method", ["eamp", "memetic", "perturbation", "resolved-rate"])
def test_each_method_follows_the_line_and_leaves_its_files(start, short, method):
    words = ("--set", "levels=3") if method == "perturbation" else ()
    run = start(*RUN, "--task", short, "--method", method, "--workers", 1, *words)

    result = run.result()

    assert result["points_outside_zone"] == 0
    assert result["max_step_deg"] <= 0.5
    rows = (run.folder / "trajectory.csv").read_text().splitlines()
    assert len(rows) == 1 + 121


def test_a_worker_killed_on_the_way_changes_nothing(start):
    words = (*RUN, "--population", 2000, "--subpopulations", 2, "--workers", 2)
    undisturbed = start(*words, out="undisturbed").result()
    run = start(*words)
    run.wait_for_generation(20)
    victim = run.workers()[0]

    end(victim)
    wait_until(lambda: run.ended or victim not in run.workers(), "the loss to be seen")
    result = run.result()

    assert result["lost_workers"] == 1
    assert result["final_population_sha256"] == undisturbed["final_population_sha256"]


def test_scenes_are_followed_at_once_and_come_out_as_they_do_alone(start, tmp_path):
    scenes = tmp_path / "scenes.toml"
    scenes.write_text(
        "[path]\nsteps = 100\n"
        '[[scene]]\nname = "plane"\n'
        '[[scene]]\nname = "plate"\n[[scene.box]]\nlower_cm = [5, 50, 45]\nupper_cm = [15, 100, 50]\n'
    )
    alone = tmp_path / "plate.toml"
    alone.write_text(
        "[path]\nsteps = 100\n[[box]]\nlower_cm = [5, 50, 45]\nupper_cm = [15, 100, 50]\n"
    )

    both = start(*RUN, "--scenes", scenes, "--workers", 2, out="both")
    names = [scene["name"] for scene in both.result()["scenes"]]
    single = start(*RUN, "--task", alone, "--workers", 1, out="alone")
    single.result()

    assert names == ["plane", "plate"]
    assert (both.folder / "trajectory-plate.csv").read_text() == (
        single.folder / "trajectory.csv"
    ).read_text()


def test_a_resumed_run_finds_the_same_path(start):
    words = (*RUN, "--population", 2000, "--workers", 1, "--checkpoint-seconds", 0)
    undisturbed = start(*words, out="undisturbed").result()
    run = start(*words)
    run.wait_for_generation(20)

    run.process.kill()
    run.finish()
    resumed = start("resume", run.folder, "--no-pictures", "--progress", "quiet")
    code = resumed.finish()

    assert code == 0, resumed.output
    result = json.loads((run.folder / "result.json").read_text())
    assert result["final_population_sha256"] == undisturbed["final_population_sha256"]


def test_a_setting_that_the_method_does_not_have_is_refused_in_words(start):
    run = start(*RUN, "--method", "resolved-rate", "--population", 10)

    assert run.finish() == 2
    assert "--population: found 10, expected none" in run.output.replace("\n", " ")
