"""Individuals that raise, loop, crash or lie about numbers: each is found, listed and penalised, nobody else is."""

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import mischief
import numpy as np
import pytest
from packages import install
from processes import Run

from tramnet_master.experiments.own_problem import OwnProblemOptions, prepare
from tramnet_master.experiments.runner import population_hash
from tramnet_protocol.arrays import Array
from tramnet_protocol.messages import Evaluate, Evaluated

pytestmark = pytest.mark.system

POPULATION, GENERATIONS = 12, 4
ERRORS = {
    "exception": "ValueError: an individual nobody can evaluate",
    "shape": "expected float64 of shape (1,)",
}
VALUES = {"nan": "unusable values", "inf": "unusable values", "minus-inf": "unusable values"}


@pytest.fixture(autouse=True)
def installed(tmp_path, monkeypatch):
    install(tmp_path, monkeypatch, "mischief", Path(mischief.__file__).read_text(), "build")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))


def engine():
    options = OwnProblemOptions(
        problem="mischief",
        parameters={"poison": []},
        population=POPULATION,
        generations=GENERATIONS,
    )
    return prepare(options).engine


def first_genomes() -> np.ndarray:
    (work,) = engine().ask()
    assert isinstance(work, Evaluate)
    return work.genomes.unpack()


def penalised_run(poison: list[tuple[str, list[float]]]) -> tuple[str, list[tuple[int, int]]]:
    """Hash of the run in which the poisonous get the worst of the others, and where they stood."""
    evolution, condemned = engine(), []
    while not evolution.finished:
        for work in evolution.ask():
            genomes = work.genomes.unpack()
            objectives = np.square(genomes).sum(axis=1)
            bad = np.array([any((genes == g).all() for _, g in poison) for genes in genomes])
            objectives[bad] = objectives[~bad].max()
            condemned += [(work.work.step, slot) for slot in np.flatnonzero(bad).tolist()]
            evolution.tell(work, Evaluated(work.work, Array.pack(objectives), 0.0))
    return population_hash(evolution), condemned


def poison_with(deeds: Iterable[str]) -> list[tuple[str, list[float]]]:
    """One individual for each deed, from slot 0 on."""
    genomes = first_genomes()
    return [(deed, genomes[slot].tolist()) for slot, deed in enumerate(deeds)]


def begin(
    start: Callable[..., Run], poison: list[tuple[str, list[float]]], *options: object
) -> Run:
    return start(
        "run", "problem", "mischief", "--set", f"poison={json.dumps(poison)}", "--workers", 2,
        "--population", POPULATION, "--generations", GENERATIONS,
        "--first-deadline", 1, "--deadline", 0.3, *options,
    )  # fmt: skip


def assert_penalised(start: Callable[..., Run], deeds: Mapping[str, str], *options: object) -> None:
    """Run with an individual for each deed, and assert that all of them and nobody else are condemned, and why."""
    poison = poison_with(deeds)
    result = begin(start, poison, *options).result()
    digest, condemned = penalised_run(poison)
    found = {(one["generation"], one["individual"]): one["reason"] for one in result["condemned"]}
    assert sorted(found) == condemned
    first = min(generation for generation, _ in found)
    for slot, why in enumerate(deeds.values()):
        assert why in found[first, slot]
    assert result["final_population_sha256"] == digest


def test_an_individual_that_ends_its_process_is_found_and_penalised(start):
    assert_penalised(start, {"exit": "its worker died"})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("deeds", "options"),
    [
        (ERRORS, ()),
        (VALUES, ()),
        ({"segfault": "its worker died"}, ()),
        ({"loop": "its deadline passed"}, ()),
        ({"hang": "its worker fell silent"}, ()),
        ({"memory": "MemoryError"}, ("--worker-memory", 2000)),
        ({"nan": "unusable values", "exit": "its worker died", "loop": "its deadline passed"}, ()),
    ],
    ids=["errors", "values", "segfault", "loop", "hang", "memory", "several"],
)
def test_every_bad_evaluation_is_found_and_penalised(start, deeds, options):
    assert_penalised(start, deeds, *options)


def test_a_run_told_to_stop_at_a_bad_evaluation_goes_on_once_it_is_mended(start, tmp_path):
    run = begin(start, poison_with(["exception"]), "--on-failure", "stop")

    assert run.finish() == 1
    words = run.output.replace("\n", " ")
    assert "ValueError: an individual nobody can evaluate (--on-failure stop)" in words
    assert f"tramnet resume {run.folder}" in words

    module = tmp_path / "site" / "mischief.py"
    module.write_text(module.read_text().replace("raise ValueError", "return ValueError"))
    result = start("resume", run.folder, "--no-pictures", "--progress", "quiet").result()
    assert (result["final_population_sha256"], []) == penalised_run([])
    assert result["condemned"] == []
