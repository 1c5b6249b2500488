import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tramnet_master.csv_tables import read_table, write_table
from tramnet_master.errors import DamagedFile


@pytest.fixture
def path(tmp_path):
    return tmp_path / "table.csv"


@given(values=hnp.arrays(np.float64, st.tuples(st.integers(0, 8), st.integers(1, 5))))
def test_a_table_reads_back_bit_for_bit(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("tables") / "table.csv"
    columns = {f"column{i}": values[:, i] for i in range(values.shape[1])}

    write_table(path, columns)

    found = read_table(path)
    assert list(found) == list(columns)
    for name, column in columns.items():
        np.testing.assert_array_equal(found[name], column)


def test_whole_numbers_are_written_as_such(path):
    write_table(path, {"node": np.arange(2), "t_s": np.array([0.0, 0.5])})

    assert path.read_text() == "node,t_s\n0,0.0\n1,0.5\n"


def test_columns_of_other_lengths_are_refused(path):
    with pytest.raises(ValueError, match="shorter"):
        write_table(path, {"a": np.zeros(2), "b": np.zeros(1)})


def test_a_last_line_without_its_end_is_left_out(path):
    path.write_text("a,b\n1,2\n3,4.")

    assert {name: column.tolist() for name, column in read_table(path).items()} == {
        "a": [1.0],
        "b": [2.0],
    }


@pytest.mark.parametrize(
    "text",
    ["", "a,b", "a,b\n1\n", "a,b\n1,2,3\n", "a,b\n1,2\n3\n", "a,b\n1,x\n", "a,b\n1\n2,3,4\n"],
)
def test_a_torn_table_is_told_of(path, text):
    path.write_text(text)

    with pytest.raises(DamagedFile, match=r"table\.csv: damaged: found"):
        read_table(path)


def test_columns_cannot_be_altered(path):
    write_table(path, {"a": np.zeros(2)})

    with pytest.raises(ValueError, match="read-only"):
        read_table(path)["a"][0] = 1.0


@given(values=hnp.arrays(np.float64, st.integers(0, 8)))
def test_a_column_with_gaps_reads_back_bit_for_bit(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("tables") / "table.csv"

    write_table(path, {"k": np.arange(len(values)), "a": values}, gaps=("a",))

    np.testing.assert_array_equal(read_table(path, gaps=("a",))["a"], values)


def test_a_gap_is_an_empty_cell(path):
    write_table(path, {"a": np.array([1.0, np.nan]), "b": np.array([2.0, 3.0])}, gaps=("a",))

    assert path.read_text() == "a,b\n1.0,2.0\n,3.0\n"


@pytest.mark.parametrize("text", ["a,b\n1,\n", "a,b\n1\n", "a,b\n1,,2\n", "a,b\n,\n"])
def test_an_empty_cell_where_no_gap_is_allowed_is_told_of(path, text):
    path.write_text(text)

    with pytest.raises(DamagedFile):
        read_table(path, gaps=("a",))
