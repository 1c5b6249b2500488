import datetime
import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tramnet_master.errors import (
    BadInput,
    CannotWrite,
    FolderInUse,
    InvalidFile,
    NotARunFolder,
    OccupiedFolder,
)
from tramnet_master.plain_values import plain
from tramnet_master.run_folder import OpenRunFolder, RunFolder, default_folder

TODAY = datetime.date(2026, 3, 14)
RUN = {"experiment": "puma560", "case": 1, "seed": 1}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "runs" / "p1"


def finish(folder: Path) -> None:
    (folder / "result.json").write_text("{}")


def lines_of_log(folder: Path) -> list[dict[str, object]]:
    return [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]


def test_a_new_run_folder_says_how_to_repeat_the_run(folder):
    run = {
        **RUN,
        "endpoint": "tcp/127.0.0.1:40123",
        "task": {"start_rad": np.array([0.1, -0.2]), "weights": {"time": np.float64(1.0)}},
        "urdf": Path("arm.urdf"),
        "case_file": None,
    }

    with OpenRunFolder.create(folder, run):
        pass

    assert RunFolder(folder).run() == {
        **RUN,
        "endpoint": "tcp/127.0.0.1:40123",
        "task": {"start_rad": [0.1, -0.2], "weights": {"time": 1.0}},
        "urdf": "arm.urdf",
    }


def test_floats_in_the_run_file_are_exact(folder):
    numbers = [0.1, 1 / 3, 1e-300, float("inf"), -0.0]

    with OpenRunFolder.create(folder, {"numbers": numbers}):
        pass

    assert repr(RunFolder(folder).run()["numbers"]) == repr(numbers)


def test_the_run_file_is_toml_with_a_head_for_people(folder):
    with OpenRunFolder.create(folder, RUN):
        pass

    text = (folder / "run.toml").read_text()
    assert text.startswith("# A run of tramnet")
    assert tomllib.loads(text) == RUN


@pytest.mark.parametrize("finished", [True, False])
def test_a_folder_with_a_run_is_not_overwritten_unasked(folder, finished):
    OpenRunFolder.create(folder, RUN).close()
    if finished:
        finish(folder)

    with pytest.raises(OccupiedFolder, match="--overwrite") as caught:
        OpenRunFolder.create(folder, {"seed": 2})

    assert caught.value.exit_code == 2
    assert ("tramnet resume" in str(caught.value)) is not finished
    assert RunFolder(folder).run() == RUN


def test_overwriting_removes_what_the_earlier_run_left_and_nothing_else(folder):
    with OpenRunFolder.create(folder, RUN) as run:
        run.log("joined")
        run.checkpoints.save({"a": 1}, 10)
    ours = (
        "trajectory.csv", "trajectory-shelf.csv", "servo-28ms.csv", "position.png", "torque.svg",
        "joint_angles.png", "tracking-shelf.svg", "postures-shelf.2.png", "scenes.svg",
    )  # fmt: skip
    for name in (*ours, "notes.txt"):
        (folder / name).write_text("old")
    finish(folder)

    with OpenRunFolder.create(folder, {"seed": 2}, overwrite=True):
        pass

    assert sorted(path.name for path in folder.iterdir()) == ["log.jsonl", "notes.txt", "run.toml"]
    assert RunFolder(folder).run() == {"seed": 2}
    assert not RunFolder(folder).finished
    assert lines_of_log(folder) == []


def test_a_folder_with_other_files_is_used_and_they_stay(folder):
    folder.mkdir(parents=True)
    (folder / "notes.txt").write_text("mine")

    OpenRunFolder.create(folder, RUN).close()

    assert (folder / "notes.txt").read_text() == "mine"


def test_two_processes_do_not_write_one_folder(folder):
    with OpenRunFolder.create(folder, RUN):
        resume = f"""
from pathlib import Path
from tramnet_master.errors import FolderInUse
from tramnet_master.run_folder import OpenRunFolder
try:
    OpenRunFolder.resume(Path({str(folder)!r}))
except FolderInUse as error:
    print(error)
"""
        ended = subprocess.run(
            [sys.executable, "-c", resume], capture_output=True, text=True, check=True
        )

    assert "another tramnet process is writing to this run folder" in ended.stdout


def test_a_folder_in_use_is_not_overwritten_even_when_asked(folder):
    with OpenRunFolder.create(folder, RUN) as run:
        run.log("joined")

        with pytest.raises(FolderInUse):
            OpenRunFolder.create(folder, RUN, overwrite=True)

    assert [line["event"] for line in lines_of_log(folder)] == ["joined"]


def test_a_folder_is_free_again_once_closed(folder):
    OpenRunFolder.create(folder, RUN).close()

    with OpenRunFolder.resume(folder) as run:
        run.close()
        run.close()


def test_the_log_has_an_object_a_line_and_goes_on_after_a_resume(folder):
    with OpenRunFolder.create(folder, RUN) as run:
        run.log("joined", {"seat": 1, "rate": np.float64(2.5), "best": float("nan")})
    with OpenRunFolder.resume(folder) as run:
        run.log("resumed", {"generation": 10})

    first, second = lines_of_log(folder)
    assert first["event"] == "joined"
    assert (first["seat"], first["rate"], first["best"]) == (1, 2.5, None)
    assert datetime.datetime.fromisoformat(str(first["time"])).tzinfo is not None
    assert (second["event"], second["generation"]) == ("resumed", 10)


def test_a_damaged_checkpoint_is_told_of_in_the_log(folder):
    with OpenRunFolder.create(folder, RUN) as run:
        run.checkpoints.save({"a": 1}, 10).write_bytes(b"torn")

        assert run.checkpoints.load_latest() is None

    (line,) = lines_of_log(folder)
    assert line["event"] == "warning"
    assert "checkpoint-00000010.tramnet: damaged" in str(line["text"])


def test_a_folder_without_a_run_is_no_run_folder(tmp_path):
    with pytest.raises(NotARunFolder, match=r"no run\.toml in it"):
        RunFolder(tmp_path)
    with pytest.raises(NotARunFolder, match="no such folder"):
        OpenRunFolder.resume(tmp_path / "nowhere")


def test_a_run_without_a_result_is_not_finished(folder):
    OpenRunFolder.create(folder, RUN).close()

    assert not RunFolder(folder).finished
    with pytest.raises(NotARunFolder, match=r"no result\.json in it"):
        RunFolder(folder).result()


def test_a_run_file_that_is_no_toml_is_told_of(folder):
    OpenRunFolder.create(folder, RUN).close()
    (folder / "run.toml").write_text("seed = = 1\n")

    with pytest.raises(InvalidFile, match=r"run\.toml: found .*line 1") as caught:
        RunFolder(folder).run()

    assert isinstance(caught.value, BadInput)


def test_a_folder_that_cannot_be_made_is_told_of(tmp_path):
    (tmp_path / "file").write_text("")

    with pytest.raises(CannotWrite, match="file/p1: cannot be written: Not a directory"):
        OpenRunFolder.create(tmp_path / "file" / "p1", RUN)


def test_a_failed_start_lets_go_of_the_folder(folder):
    with pytest.raises(TypeError):
        OpenRunFolder.create(folder, {"value": object()})

    OpenRunFolder.create(folder, RUN).close()


def test_the_run_file_cannot_hold_what_is_not_plain():
    with pytest.raises(TypeError, match="found object"):
        plain({"value": object()})


def test_default_folders_are_numbered_by_day(tmp_path):
    names = [default_folder(tmp_path / "runs", "puma560", TODAY).name for _ in range(3)]

    assert names == ["puma560-2026-03-14-1", "puma560-2026-03-14-2", "puma560-2026-03-14-3"]


def test_a_default_folder_is_ready_for_a_run(tmp_path):
    folder = default_folder(tmp_path / "runs", "puma560", TODAY)

    with OpenRunFolder.create(folder, RUN):
        pass

    assert RunFolder(folder).run() == RUN


def test_a_default_folder_of_a_run_that_was_removed_is_given_again(tmp_path):
    first = default_folder(tmp_path, "puma560", TODAY)
    os.rmdir(first)

    assert default_folder(tmp_path, "puma560", TODAY) == first


def test_a_default_folder_where_nothing_can_be_written_is_told_of(tmp_path):
    (tmp_path / "runs").write_text("")

    with pytest.raises(CannotWrite, match="File exists"):
        default_folder(tmp_path / "runs", "puma560", TODAY)
