"""A worker is killed at every moment, among 2, 4 and 8, in every job: nothing is lost, and the result is the same.

Each moment meets each number of workers, and each job meets both (pairwise, 18 runs). Pairs that cannot occur: only
``crank`` has workers that hold populations, and frames are forwarded in shapes other than ``star`` only.
"""

import datetime
import functools
import itertools
from collections.abc import Iterator
from pathlib import Path

import killers
import pytest
from _pytest.mark import ParameterSet
from processes import starting

pytestmark = pytest.mark.system

JOBS = {
    "puma560": ("puma560", "--population", 40, "--generations", 400),
    "redundant8": ("redundant8", "--population", 160, "--subpopulations", 8),
    "crank": ("crank", "--settings", "literal", "--population", 10, "--generations", 3),
}
MOMENTS = (
    "before it takes a chunk",
    "in mid-evaluation",
    "before it answers",
    "while it forwards",
    "at a checkpoint",
    "while it holds a population",
)
WORKERS = (2, 4, 8)
SHAPES = {2: "pipeline", 4: "ring", 8: "tree"}
COMPARED = ("final_population_sha256", "best", "evaluations", "generations", "condemned")


def matrix() -> Iterator[ParameterSet]:
    """Moment, number of workers and job of each run: the job moves on by one in each row."""
    for (row, moment), (column, n) in itertools.product(enumerate(MOMENTS), enumerate(WORKERS)):
        holds = moment == "while it holds a population"
        job = "crank" if holds else list(JOBS)[(row + column) % 3]
        quick = (moment, n) == ("while it forwards", 2)
        yield pytest.param(moment, n, job, marks=() if quick else pytest.mark.slow)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The result of each job when nobody is killed."""

    @functools.cache
    def run(job: str) -> dict[str, object]:
        with starting(tmp_path_factory.mktemp(job)) as start:
            return start("run", *JOBS[job], "--workers", 2).result()

    return run


@pytest.mark.parametrize(("moment", "workers", "job"), list(matrix()))
def test_a_worker_killed_at_any_moment_changes_nothing(
    start, undisturbed, tmp_path, monkeypatch, moment, workers, job
):
    expected = undisturbed(job)
    site, victim = tmp_path / "site", tmp_path / "victim"
    site.mkdir()
    (site / "sitecustomize.py").write_text(Path(killers.__file__).read_text())
    monkeypatch.setenv("PYTHONPATH", str(site), prepend=":")
    monkeypatch.setenv("TRAMNET_TEST_MOMENT", moment)
    monkeypatch.setenv("TRAMNET_TEST_VICTIM", str(victim))
    shape = SHAPES[workers] if moment == "while it forwards" else "star"

    run = start(
        "run", *JOBS[job], "--workers", workers, "--topology", shape, "--checkpoint-generations", 20,
    )  # fmt: skip
    result = run.result()

    assert {name: result[name] for name in COMPARED} == {name: expected[name] for name in COMPARED}
    assert result["lost_workers"] >= 1
    pid, killed = victim.read_text().split()
    seen = seen_lost(run.events(), int(pid))
    assert seen - float(killed) < 1.0


def seen_lost(events: list[dict[str, object]], pid: int) -> float:
    """When the root saw that a process was lost, and gave its work to others [s since 1970]."""
    seats = {e["pid"]: e["seat"] for e in events if e["event"] == "joined"}
    (seen,) = (e["time"] for e in events if e["event"] == "lost" and e["seat"] == seats[pid])
    return datetime.datetime.fromisoformat(str(seen)).timestamp()
