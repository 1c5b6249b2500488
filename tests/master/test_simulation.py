import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tramnet_master.cli import run
from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.own_problem import OwnProblemOptions, prepare
from tramnet_master.simulation.farm import SECOND, VirtualFarm
from tramnet_master.simulation.machines import T805, carried_over, machine
from tramnet_master.simulation.measuring import measure
from tramnet_master.simulation.prediction import (
    lay,
    master_slave_optimum,
    predict,
    usual_counts,
)
from tramnet_master.simulation.routes import round_trips
from tramnet_master.simulation.workload import Grain, Workload
from tramnet_protocol.errors import BadTopology
from tramnet_protocol.links import LinkTiming
from tramnet_protocol.modelled import HEADER_BYTES
from tramnet_protocol.topology import SHAPES, connect

TWENTY = machine(T805, 20)
SLOW = Workload("slow", population=40, generations=5, genome_bytes=180, evaluation=0.03)
CHEAP = Workload("cheap", population=64, generations=5, genome_bytes=100, evaluation=2e-5)

workloads = st.builds(
    Workload,
    st.just("any"),
    population=st.integers(1, 60),
    generations=st.just(3),
    genome_bytes=st.integers(1, 2000),
    evaluation=st.sampled_from([1e-6, 2e-5, 1e-3, 0.03, 2.0]),
    breeding=st.sampled_from([0.0, 0.01]),
    grain=st.sampled_from(Grain),
    work_bytes=st.integers(0, 500),
    run=st.integers(1, 4),
)


@settings(max_examples=40)
@given(workloads, st.sampled_from(sorted(SHAPES)), st.integers(1, 15))
def test_every_individual_is_computed_once_and_travels_its_way(workload, topology, workers):
    ways = lay(SHAPES[topology], workers)

    *_, last = VirtualFarm(workload, TWENTY, ways).run(3)

    points = workload.run if workload.grain is Grain.PATHS else 1
    slots = 3 * workload.population * points
    assert last.computing == slots * round(workload.evaluation * SECOND)
    near = [way for way in last.traffic if 0 in way]
    down = sum(last.traffic[way].bytes for way in near if way[0] == 0)
    up = sum(last.traffic[way].bytes for way in near if way[1] == 0)
    frames = sum(last.traffic[way].frames for way in near if way[0] == 0)
    assert frames == sum(last.traffic[way].frames for way in near if way[1] == 0)
    assert down == frames * (HEADER_BYTES + workload.work_bytes) + slots * workload.genome_bytes
    assert up == frames * HEADER_BYTES + slots * 8


@settings(max_examples=40)
@given(workloads, st.sampled_from(sorted(SHAPES)), st.integers(1, 15))
def test_no_farm_beats_its_workers_or_its_slowest_message(workload, topology, workers):
    ways = lay(SHAPES[topology], workers)

    laps = VirtualFarm(workload, TWENTY, ways).run(3)

    message = TWENTY.timing.hop(HEADER_BYTES + workload.genome_bytes)
    for lap in laps:
        assert lap.time >= lap.computing / workers + message
    assert [lap.time for lap in laps] == sorted(lap.time for lap in laps)


def test_a_cheap_generation_with_one_worker_is_one_message_each_way():
    laps = VirtualFarm(CHEAP, TWENTY, lay(SHAPES["pipeline"], 1)).run(5)

    out = TWENTY.timing.hop(HEADER_BYTES + 64 * 100)
    back = TWENTY.timing.hop(HEADER_BYTES + 64 * 8)
    assert laps[-1].time - laps[-2].time == out + 64 * 20_000 + back


def test_a_worker_farther_away_answers_later_by_store_and_forward():
    work = Workload("one", population=1, generations=1, genome_bytes=100, evaluation=0.001)
    ways = lay(SHAPES["pipeline"], 5)

    (lap,) = VirtualFarm(work, TWENTY, {5: ways[5]}).run(1)

    timing = LinkTiming.of(20)
    out, back = HEADER_BYTES + 100, HEADER_BYTES + 8
    there_and_back = timing.store_and_forward(out, 5) + timing.store_and_forward(back, 5)
    assert lap.time == there_and_back + 1_000_000


def test_dear_individuals_scale_with_the_workers_until_they_are_few():
    prediction = predict(SLOW, TWENTY, SHAPES["tree"], [1, 2, 4, 8])

    assert [point.speed_up for point in prediction.points] == pytest.approx([1, 2, 4, 8], rel=0.03)
    assert prediction.best.workers == 8


def test_cheap_individuals_are_best_left_to_few_workers():
    prediction = predict(CHEAP, TWENTY, SHAPES["pipeline"], [1, 4, 16, 64])

    assert prediction.best.workers < 64
    assert prediction.points[-1].efficiency < 0.01
    assert prediction.points[-1].busiest == (0, 1)


def test_generations_that_are_not_simulated_are_like_those_that_are():
    few, many = (
        predict(Workload("x", 40, n, 180, 0.03), TWENTY, SHAPES["tree"], [4]).points[0].seconds
        for n in (4, 400)
    )

    laps = VirtualFarm(Workload("x", 40, 12, 180, 0.03), TWENTY, lay(SHAPES["tree"], 4)).run(12)
    each = (laps[-1].time - laps[3].time) / 8 / SECOND
    assert many == pytest.approx(few + 396 * each)


def test_the_same_farm_takes_the_same_time_every_time():
    once, again = (predict(SLOW, TWENTY, SHAPES["torus"], [5, 9]) for _ in range(2))

    assert once == again


@pytest.mark.parametrize(("evaluation", "optimum"), [(0.010, 109.54), (0.001, 34.64)])
def test_the_master_slave_optimum_is_that_of_the_literature(evaluation, optimum):
    assert master_slave_optimum(120, evaluation, 0.0001) == pytest.approx(optimum, abs=0.005)


@pytest.mark.parametrize("topology", sorted(SHAPES))
def test_round_trips_are_the_routes_of_frames(topology):
    graph = connect(topology, range(14))

    for seat, ways in round_trips(graph).items():
        assert ways.out == graph.route(0, seat)
        assert ways.back == graph.route(seat, 0)


def test_a_torus_of_4096_trams_can_be_laid_and_a_cube_cannot():
    assert len(lay(SHAPES["torus"], 4095)) == 4095
    with pytest.raises(BadTopology, match="use torus"):
        lay(SHAPES["hypercube"], 4095)
    with pytest.raises(InvalidOption, match="1 to 4096"):
        lay(SHAPES["torus"], 4097)


def test_usual_counts_reach_from_one_worker_to_one_an_individual():
    assert usual_counts(100, 4096)[:6] == [1, 2, 3, 4, 6, 8]
    assert usual_counts(100, 4096)[-1] == 100
    assert usual_counts(10_000, 4096)[-1] == 4096
    assert usual_counts(1, 4096) == [1]


def test_an_experiment_is_measured_in_its_own_numbers():
    parameters = {"dimension": 3, "delay": 0.001}
    experiment = prepare(
        OwnProblemOptions(problem="sphere", parameters=parameters, population=50, generations=7)
    )

    measured = measure(experiment)

    assert (measured.population, measured.generations) == (50, 7)
    assert (measured.genome_bytes, measured.genes) == (24, 3)
    assert 0.001 <= measured.evaluation < 0.01
    assert 0.0 < measured.breeding < 0.1


def test_populations_are_shared_out_and_paths_are_not():
    populations = Workload("p", 7, 10, 0, 0.01, grain=Grain.POPULATIONS)
    paths = Workload("q", 7, 100, 0, 0.01, grain=Grain.PATHS, run=20)

    shares = [work.size for work in populations.works(1, 3)]
    assert sorted(shares) == [2, 2, 3]
    assert len(populations.works(1, 20)) == 7
    assert [work.size for work in paths.works(1, 3)] == [20] * 7
    assert paths.rounds == 5


@pytest.mark.parametrize(
    ("words", "grain", "population", "generations"),
    [
        (["crank"], Grain.POPULATIONS, 4, 100),
        (["redundant8", "--subpopulations", "3", "--population", "60"], Grain.PATHS, 3, 1000),
    ],
)
def test_every_job_can_be_simulated(words, grain, population, generations, tmp_path):
    folder = tmp_path / "prediction"

    assert run(["simulate", *words, "--workers", "1,2", "--out", str(folder)]) == 0

    found = json.loads((folder / "prediction.json").read_text())
    assert found["workload"]["grain"] == grain.value
    assert found["workload"]["population"] == population
    assert found["workload"]["generations"] >= generations
    assert found["points"][1]["speed_up"] > 1.2


def test_a_transputer_takes_thousands_of_times_as_long_as_this_core():
    there = carried_over(CHEAP, T805)

    assert 500 < there.evaluation / CHEAP.evaluation < 50_000
    assert carried_over(CHEAP, "today") == CHEAP


def test_an_unknown_node_is_refused():
    with pytest.raises(InvalidOption, match="t805-25, today"):
        machine("t9000", 20)


def test_the_command_writes_numbers_and_figures(tmp_path):
    words = ["simulate", "numbers", "--evaluation-us", "1000", "--genome-bytes", "80"]

    code = run([*words, "--workers", "1,3", "--topology", "ring", "--out", str(tmp_path)])

    assert code == 0
    prediction = json.loads((tmp_path / "prediction.json").read_text())
    assert [point["workers"] for point in prediction["points"]] == [1, 3]
    assert {path.name for path in tmp_path.glob("scaling.*")} == {"scaling.png", "scaling.svg"}


@pytest.mark.parametrize("words", [["--workers", "4,x"], ["--node", "z80"], ["--mbaud", "15"]])
def test_what_cannot_be_simulated_is_bad_input(words, tmp_path):
    given_numbers = ["simulate", "numbers", "--evaluation-us", "1", "--genome-bytes", "8"]

    assert run([*given_numbers, *words, "--out", str(tmp_path)]) == 2
