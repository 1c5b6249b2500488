import numpy as np
import pytest

from tramnet_master.csv_tables import read_table
from tramnet_protocol.links import LinkTiming

pytestmark = pytest.mark.system

GENERATIONS = 30
POPULATION = 60
GENES_BYTES = GENERATIONS * POPULATION * 10 * 8
JOB = ("run", "problem", "sphere", "--generations", GENERATIONS, "--population", POPULATION)


def test_books_say_what_passed_and_neither_they_nor_a_pace_change_the_result(start):
    booked_run = start(*JOB, "--workers", 2, "--topology", "pipeline", out="booked")
    booked = booked_run.result()
    paced = start(
        *JOB, "--workers", 1, "--node", "none", "--pace", "--mbaud", 5, out="paced"
    ).result()

    assert paced["final_population_sha256"] == booked["final_population_sha256"]
    assert paced["link_books"] is None
    assert paced["wall_seconds"] > GENES_BYTES * LinkTiming.of(5).byte_alone / 1e9

    books = booked["link_books"]
    assert books["rounds"] == books["booked"] == GENERATIONS
    assert books["busiest"] == [0, 1]
    assert books["seconds"] >= books["computing_seconds"] / 2 > 0

    links = read_table(booked_run.folder / "links.csv")
    ways = list(zip(links["source"], links["destination"], strict=True))
    assert ways == [(0, 1), (1, 0), (1, 2), (2, 1)]
    assert links["bytes"].sum() == books["bytes"]
    assert links["frames"].sum() == books["frames"]
    assert links["frames"][0] == links["frames"][1]  # every chunk is answered
    assert links["bytes"][0] >= GENES_BYTES
    assert np.all(links["utilisation"] <= 1.0)
