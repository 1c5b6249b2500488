import json
import math

import msgspec
import numpy as np
import pytest

from tramnet_master.errors import DamagedFile
from tramnet_master.results import (
    BestFound,
    Check,
    Limits,
    MotionResult,
    Result,
    read_result,
    versions,
    write_result,
)

ALWAYS = {
    "experiment": "puma560",
    "method": "wang-zalzala",
    "case": 1,
    "seed": 1,
    "population_size": 100,
    "generations": 300,
    "evaluations": 30_000,
    "best": {"objective": 0.4269, "generation": 57},
    "wall_seconds": 0.41,
    "workers": 2,
    "topology": "star",
    "lost_workers": 0,
    "condemned": [],
    "reproducible": True,
    "final_population_sha256": "ab" * 32,
    "paper": 0.431,
    "versions": {"python": "3.11.7"},
}


def result() -> MotionResult:
    return MotionResult(
        **{**ALWAYS, "best": BestFound(0.4269, 57)},
        robot="akb",
        start_rad=[-0.3, 0.4],
        goal_rad=[0.51, -0.42],
        limits=Limits([97.6, 186.4], [math.inf, 1.51], [-2.8, -3.9], [2.8, 0.8]),
        motion_time_s=0.4269,
        objective=0.4269,
        end_velocity_rad_s=1e-15,
        torque_ratio_max=1.04,
        straight_line_time_s=0.3806,
        limit_time_s=0.3656,
        gap_to_limit=0.1677,
        gap_to_straight_line=0.1216,
        evaluations_per_second=73_000.0,
        network_overhead_fraction=0.3,
        verified=False,
        verification=[Check("torque ratio", 1.04, 1.001, "", False)],
        failures=["joint 1 needs 104.02 % of its torque limit of 97.6 N m"],
    )


def test_a_result_has_all_keys_that_every_run_has(tmp_path):
    write_result(tmp_path / "result.json", result())

    document = json.loads((tmp_path / "result.json").read_text())
    assert {key: document[key] for key in ALWAYS} == ALWAYS


def test_a_result_of_a_motion_has_its_own_keys_too(tmp_path):
    write_result(tmp_path / "result.json", result())

    document = json.loads((tmp_path / "result.json").read_text())
    assert document["motion_time_s"] == 0.4269
    assert document["limits"]["velocity_rad_s"] == [None, 1.51]
    assert document["verification"] == [
        {"name": "torque ratio", "value": 1.04, "limit": 1.001, "unit": "", "passed": False}
        | {"at_least": False}
    ]


def test_a_result_never_holds_nan_or_infinity(tmp_path):
    spoilt = msgspec.structs.replace(
        result(), end_velocity_rad_s=math.nan, best=BestFound(math.inf, 1)
    )

    write_result(tmp_path / "result.json", spoilt)

    text = (tmp_path / "result.json").read_text()
    document = json.loads(text, parse_constant=pytest.fail)
    assert document["end_velocity_rad_s"] is None
    assert document["best"]["objective"] is None


def test_a_result_may_hold_numbers_of_numpy(tmp_path):
    numbers = msgspec.structs.replace(
        result(), seed=np.int64(3), objective=np.float64(0.5), start_rad=np.array([1.0, 2.0])
    )

    write_result(tmp_path / "result.json", numbers)

    read = read_result(tmp_path / "result.json")
    assert (read["seed"], read["objective"], read["start_rad"]) == (3, 0.5, [1.0, 2.0])


def test_a_result_without_a_key_cannot_be_made():
    incomplete = {key: value for key, value in ALWAYS.items() if key != "final_population_sha256"}

    with pytest.raises(TypeError, match="final_population_sha256"):
        Result(**incomplete)


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b"\xff"])
def test_what_is_no_result_is_told_of(tmp_path, content):
    (tmp_path / "result.json").write_bytes(content)

    with pytest.raises(DamagedFile, match=r"result\.json: damaged"):
        read_result(tmp_path / "result.json")


def test_versions_name_python_and_everything_that_computes():
    found = versions()

    assert set(found) >= {"python", "tramnet", "numpy", "numba", "pin", "eclipse-zenoh"}
    assert "unknown" not in found.values()
