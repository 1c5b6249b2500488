from pathlib import Path

import numpy as np
import pytest

from tramnet_master import populations
from tramnet_master.csv_tables import read_table
from tramnet_master.errors import DamagedFile
from tramnet_master.populations import SearchHistory, read_populations, write_populations
from tramnet_workers.problems.steps import Step


def history(step: Step, returns: int, generations: int, t: int) -> SearchHistory:
    rng = np.random.default_rng(generations)
    best, mean = rng.normal(size=(2, generations, t))
    return SearchHistory(step, returns, best, mean, rng.uniform(size=(generations, t, 3)))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "populations.csv"


def test_every_search_comes_back_from_its_file(path):
    rounds = [
        history(Step.DESIGN, 0, 5, 4),
        history(Step.PROTOTYPE, 0, 3, 4),
        history(Step.PLANNING, 0, 3, 16),
        history(Step.DESIGN, 1, 5, 6),
    ]

    write_populations(path, rounds)
    found = read_populations(path)

    assert [(search.stage, search.returns) for search in found] == [(1, 0), (2, 0), (3, 0), (1, 1)]
    for search, told in zip(found, rounds, strict=True):
        np.testing.assert_array_equal(search.best, told.best)
        np.testing.assert_array_equal(search.mean, told.mean)
        np.testing.assert_array_equal(search.total_length, told.lengths.sum(axis=2))
        np.testing.assert_array_equal(search.generations, np.arange(1, len(told.best) + 1))


def test_lengths_stand_link_by_link_in_the_file(path):
    told = history(Step.DESIGN, 0, 2, 3)

    write_populations(path, [told])

    table = read_table(path)
    assert table["population"].tolist() == [1, 2, 3, 1, 2, 3]
    np.testing.assert_array_equal(table["length2_m"], told.lengths[:, :, 1].ravel())


def test_a_long_history_is_thinned_out_and_keeps_its_end(path, monkeypatch):
    monkeypatch.setattr(populations, "MOST_ROWS", 20)
    told = history(Step.DESIGN, 0, 31, 4)

    write_populations(path, [told])

    (search,) = read_populations(path)
    assert len(search.generations) * 4 <= 20
    assert search.generations[-1] == 31
    np.testing.assert_array_equal(search.best[-1], told.best[-1])


def test_a_file_without_its_columns_is_damaged(path):
    path.write_text("generation,best\n1,0.5\n")

    with pytest.raises(DamagedFile, match="population"):
        read_populations(path)
