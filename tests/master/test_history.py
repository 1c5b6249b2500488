import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.csv_tables import read_table
from tramnet_master.engines.engine import GenerationRow
from tramnet_master.errors import CannotWrite, DamagedFile
from tramnet_master.history import COLUMNS, History


def row(generation: int) -> GenerationRow:
    return GenerationRow(generation, 100 * generation, 1 / generation, 0.7, 0.9, 1 / generation)


def write_history(path: Path, generations: range, done: int = 0, elapsed: float = 0.1) -> None:
    with History(path, done) as history:
        for generation in generations:
            history.append([row(generation)], elapsed * generation)


def without_time(path: Path) -> list[str]:
    return [line.rpartition(",")[0] for line in path.read_text().splitlines()]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "history.csv"


def test_a_history_has_a_row_a_generation_with_the_time_last(path):
    write_history(path, range(1, 4))

    assert path.read_text().splitlines() == [
        "generation,evaluations,best,mean,worst,best_so_far,elapsed_s",
        "1,100,1.0,0.7,0.9,1.0,0.100000",
        "2,200,0.5,0.7,0.9,0.5,0.200000",
        "3,300,0.3333333333333333,0.7,0.9,0.3333333333333333,0.300000",
    ]


def test_a_history_reads_back_as_columns(path):
    write_history(path, range(1, 4))

    table = read_table(path)

    assert tuple(table) == COLUMNS
    assert table["best"].tolist() == [1.0, 0.5, 1 / 3]


def test_infinite_objectives_are_ordinary(path):
    with History(path) as history:
        history.append([GenerationRow(1, 100, 0.5, float("inf"), float("inf"), 0.5)], 0.1)

    assert read_table(path)["worst"].tolist() == [float("inf")]


@given(checkpoint=st.integers(1, 20), reached=st.integers(0, 20), torn=st.integers(0, 30))
def test_a_resumed_history_is_that_of_an_undisturbed_run_but_for_its_time(
    tmp_path_factory, checkpoint, reached, torn
):
    folder = tmp_path_factory.mktemp("runs")
    undisturbed, resumed = folder / "undisturbed.csv", folder / "resumed.csv"
    write_history(undisturbed, range(1, 31))
    write_history(resumed, range(1, checkpoint + reached + 1))
    with resumed.open("a") as file:
        file.write("41,4100,0.123456789,0.7,0.9,0.1"[:torn])

    write_history(resumed, range(checkpoint + 1, 31), checkpoint, elapsed=0.2)

    assert without_time(resumed) == without_time(undisturbed)


def test_rows_reach_the_disk_when_flushed(path):
    history = History(path)
    history.append([row(1)], 0.1)

    before = read_table(path)["generation"].tolist()
    history.flush()
    after = read_table(path)["generation"].tolist()
    history.close()

    assert (before, after) == ([], [1.0])


def test_a_history_that_does_not_reach_the_checkpoint_is_not_resumed(path):
    write_history(path, range(1, 4))

    with pytest.raises(DamagedFile, match="found 3 rows, expected the rows of generations 1 to 5"):
        History(path, 5)


def test_a_history_with_a_hole_is_not_resumed(path):
    write_history(path, range(1, 6))
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:2] + lines[3:]))

    with pytest.raises(DamagedFile, match="generations 1 to 4"):
        History(path, 4)


@pytest.mark.parametrize("content", [b"", b"x,y\n1,2\n", b"\xff\xfe\n"])
def test_what_is_no_history_is_not_resumed(path, content):
    path.write_bytes(content)

    with pytest.raises(DamagedFile, match="found the columns"):
        History(path, 1)


def test_a_missing_history_is_not_resumed(path):
    with pytest.raises(DamagedFile, match="no such file"):
        History(path, 1)


def test_beginning_again_forgets_the_rows_of_before(path):
    write_history(path, range(1, 4))

    write_history(path, range(1, 2))

    assert read_table(path)["generation"].tolist() == [1.0]


@contextmanager
def files_no_longer_than(size: int) -> Iterator[None]:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_disk_that_takes_no_more_is_told_of(path):
    history = History(path)
    for generation in range(1, 50):
        history.append([row(generation)], 0.1)

    with files_no_longer_than(200):
        with pytest.raises(CannotWrite, match=r"history\.csv: cannot be written: File too large"):
            history.flush()
        with pytest.raises(CannotWrite):
            history.close()

    history.close()
