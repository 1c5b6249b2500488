import msgspec
import pytest

from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.puma560 import (
    Choice,
    Puma560Options,
    options_of,
    prepare,
    restore,
)
from tramnet_master.experiments.runner import population_hash
from tramnet_workers.node.evaluator import Evaluator

TASK = """
robot = "p560"
start_rad = [0.0, 0.1, -0.2, 0.0, 0.0, 0.0]
goal_rad = [0.4, 0.3, -0.2, 0.5, 0.2, 0.1]

[limits]
velocity_rad_s = [2.0, 2.0, 2.0, 4.0, 4.0, 4.0]
"""


def choice(**changes: object) -> Choice:
    plain = Choice(None, None, "akb", "wang-zalzala", 1, 20, 4, {})
    return plain._replace(**changes)


def run_serially(options: Puma560Options) -> str:
    experiment = prepare(options)
    evaluator, engine = Evaluator(experiment.setup), experiment.engine
    while not engine.finished:
        for work in engine.ask():
            engine.tell(work, evaluator.compute(work))
    return population_hash(engine)


def test_case_1_is_what_runs_when_nothing_is_said():
    options = options_of(choice())

    assert options.case == 1
    assert options.paper == 0.431
    assert options.task["segments"] == 16


def test_a_case_brings_its_own_grid_and_generations():
    options = options_of(choice(case=7, generations=None, population=None))

    assert options.task["segments"] == 25
    assert (options.population, options.generations) == (100, 50_000)


@pytest.mark.parametrize("method", ["wang-zalzala", "smooth"])
def test_a_task_of_one_s_own_runs_by_either_method(tmp_path, method):
    path = tmp_path / "task.toml"
    path.write_text(TASK)

    options = options_of(choice(task=path, method=method))

    assert options.case is None
    assert len(run_serially(options)) == 64


@pytest.mark.parametrize("method", ["wang-zalzala", "smooth"])
def test_the_run_file_s_table_prepares_the_same_run_again(method):
    options = options_of(choice(method=method, seed=9))
    document = {"puma560": msgspec.to_builtins(prepare(options).document)}

    again = restore(document)

    assert again.seed == 9
    assert run_serially(options) == run_serially(
        msgspec.convert(again.document, Puma560Options, strict=True)
    )


def test_a_seed_is_another_run():
    one, other = (run_serially(options_of(choice(seed=seed))) for seed in (1, 2))

    assert one != other


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"method": "magic"}, "wang-zalzala, smooth"),
        ({"robot": "r2d2"}, "akb, p560"),
        ({"settings": {"switch": "never"}}, "never"),
        ({"settings": {"gaol_bias": 0.9}}, "goal_bias"),
        ({"settings": {"goal_bias": 1.5}}, "goal_bias"),
        ({"servo_ms": 3.0}, "28, 7, 1.75, 0.875"),
    ],
)
def test_what_cannot_be_run_is_refused_in_words(changes, said):
    with pytest.raises(InvalidOption, match=said):
        prepare(options_of(choice(**changes)))


def test_a_case_and_a_task_exclude_each_other(tmp_path):
    with pytest.raises(InvalidOption, match="either a case or a task"):
        options_of(choice(case=1, task=tmp_path / "task.toml"))


def test_an_altered_run_file_is_refused():
    with pytest.raises(InvalidOption, match="that tramnet wrote"):
        restore({"puma560": {"task": {}, "speed": 9}})
