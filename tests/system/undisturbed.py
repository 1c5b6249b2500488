"""What a run of the sphere function must come to, computed in this process without any network."""

import csv
import functools

from processes import Run

from tramnet_master.engines.engine import GenerationRow
from tramnet_master.experiments.own_problem import OwnProblemOptions, prepare
from tramnet_master.experiments.runner import population_hash
from tramnet_protocol.messages import Setup
from tramnet_workers.node.evaluator import Evaluator

POPULATION = 40
SPHERE = ("run", "problem", "sphere", "--population", POPULATION)


@functools.cache
def serial_run(generations: int) -> tuple[str, float, tuple[GenerationRow, ...]]:
    """Hash, best objective and history."""
    options = OwnProblemOptions(problem="sphere", population=POPULATION, generations=generations)
    engine = prepare(options).engine
    evaluator = Evaluator(Setup("sphere", {}))
    rows: list[GenerationRow] = []
    while not engine.finished:
        for work in engine.ask():
            rows += engine.tell(work, evaluator.compute(work))
    return population_hash(engine), engine.best.objective, tuple(rows)


def assert_undisturbed(run: Run) -> dict[str, object]:
    """Wait for a run, and assert that its result and history are those of the serial run; return its result."""
    result = run.result()
    digest, objective, rows = serial_run(result["generations"])
    assert result["final_population_sha256"] == digest
    assert result["best"]["objective"] == objective
    assert result["evaluations"] == POPULATION * result["generations"]
    with (run.folder / "history.csv").open() as file:
        found = [list(row.values())[:-1] for row in csv.DictReader(file)]
    assert found == [[repr(value) for value in row] for row in rows]
    return result
