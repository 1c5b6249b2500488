"""How populations evolved: ``populations.csv``, a row for a population and a generation.

The content of Figs 9 and 10 of Kim & Khosla (1992), and the same of the later steps. A search of very
many populations is thinned out to every second, third ... generation; its last one is always there.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tramnet_master.csv_tables import Column, read_table, write_table
from tramnet_master.errors import DamagedFile
from tramnet_workers.problems.steps import Step

Floats = NDArray[np.float64]

MOST_ROWS = 20_000  # of one search
_NAMES = ("stage", "returns", "generation", "population", "best", "mean", "total_length_m")
_NUMBERS = {Step.DESIGN: 1, Step.PLACEMENT: 1, Step.PROTOTYPE: 2, Step.PLANNING: 3}


class SearchHistory(NamedTuple):
    """How the t populations of one search evolved over G generations.

    Attributes:
        step: Step of Progressive Design that searched; ``Step.DESIGN`` for other methods.
        returns: How often step 1 had been gone back to before.
        best: Largest fitness of each generation and population, of shape (G, t); Fig. 9.
        mean: Mean fitness, of shape (G, t).
        lengths: Link lengths of the best individuals, of shape (G, t, n) [m]; Fig. 10 is their sum.
    """

    step: Step
    returns: int
    best: Floats
    mean: Floats
    lengths: Floats


@dataclass(frozen=True, eq=False)
class Populations:
    """One search as it stands in the file.

    Attributes:
        stage: Step of Progressive Design, from 1.
        returns: How often step 1 had been gone back to before.
        generations: Generations, from 1, of shape (k,).
        best: Largest fitness, of shape (k, t).
        mean: Mean fitness, of shape (k, t).
        total_length: Total link length of the best individuals, of shape (k, t) [m].
    """

    stage: int
    returns: int
    generations: Floats
    best: Floats
    mean: Floats
    total_length: Floats


def write_populations(path: Path, histories: Iterable[SearchHistory]) -> None:
    """Write the histories of all searches of a run, in their order.

    Raises:
        CannotWrite: The disk refuses.
    """
    blocks = [_columns(history) for history in histories]
    names = list(blocks[0]) if blocks else []
    write_table(path, {name: np.concatenate([block[name] for block in blocks]) for name in names})


def read_populations(path: Path) -> list[Populations]:
    """The searches that a file holds, in their order.

    Raises:
        DamagedFile: It is torn.
    """
    table = read_table(path)
    missing = [name for name in _NAMES if name not in table]
    if missing:
        raise DamagedFile(path, f"the columns {', '.join(table)}", f"a column {missing[0]} too")
    return list(_searches(table))


def _columns(history: SearchHistory) -> dict[str, Column]:
    generations, t = history.best.shape
    stride = max(1, -(-generations * t // MOST_ROWS))
    kept = np.arange(generations - 1, -1, -stride)[::-1]
    size = len(kept) * t
    total = history.lengths[kept].sum(axis=2)
    lengths = history.lengths[kept].reshape(size, -1)
    columns: dict[str, Column] = {
        "stage": np.full(size, _NUMBERS[history.step], np.int64),
        "returns": np.full(size, history.returns, np.int64),
        "generation": np.repeat(kept + 1, t),
        "population": np.tile(np.arange(1, t + 1), len(kept)),
        "best": history.best[kept].ravel(),
        "mean": history.mean[kept].ravel(),
        "total_length_m": total.ravel(),
    }
    return columns | {f"length{k + 1}_m": lengths[:, k] for k in range(lengths.shape[1])}


def _searches(table: dict[str, Floats]) -> Iterator[Populations]:
    keys = np.stack([table["returns"], table["stage"]], axis=1)
    starts = np.flatnonzero(np.any(np.diff(keys, axis=0, prepend=np.nan), axis=1))
    for first, last in zip(starts, [*starts[1:], len(keys)], strict=True):
        rows = {name: column[first:last] for name, column in table.items()}
        t = int(rows["population"].max())
        yield Populations(
            stage=int(rows["stage"][0]),
            returns=int(rows["returns"][0]),
            generations=rows["generation"].reshape(-1, t)[:, 0],
            best=rows["best"].reshape(-1, t),
            mean=rows["mean"].reshape(-1, t),
            total_length=rows["total_length_m"].reshape(-1, t),
        )
