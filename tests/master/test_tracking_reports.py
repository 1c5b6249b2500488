"""Figures and summary of followed paths, from the files of a run folder alone."""

import io
from pathlib import Path

import msgspec
import numpy as np
import pytest
from matplotlib.figure import Figure
from rich.console import Console

from tramnet_master.errors import DamagedFile
from tramnet_master.experiments.experiment import Common, Timing
from tramnet_master.reports import figures
from tramnet_master.reports.figures import write_figures
from tramnet_master.reports.following import draw_following
from tramnet_master.reports.joint_angles import draw_joint_angles
from tramnet_master.reports.postures import draw_postures
from tramnet_master.reports.scene_overview import draw_scenes
from tramnet_master.reports.style import one_look
from tramnet_master.reports.summary import print_summary
from tramnet_master.reports.tracking_record import FollowedScene, TrackingRecord
from tramnet_master.results import BestFound
from tramnet_master.run_folder import OpenRunFolder
from tramnet_master.tracked_paths import write_tracking
from tramnet_master.tracking_files import Scene
from tramnet_master.tracking_results import NetworkCost, tracking_result
from tramnet_master.tracking_times import follow
from tramnet_workers.problems.tracking_task import TrackingTask, points_along
from tramnet_workers.robots.dh_rows import arm_from_dh_rows
from tramnet_workers.tracking_evolution import Eamp
from tramnet_workers.tracking_methods import ResolvedRate

N = 250
PAPER = TrackingTask.of_paper(n_steps=N)
BARE = TrackingTask.for_arm(PAPER.arm, PAPER.start, PAPER.path)
LINK_BOX = (-5.0, 20.0, 40.0, 5.0, 30.0, 60.0)
TOUCHED = TrackingTask.for_arm(PAPER.arm, PAPER.start, PAPER.path, boxes=[*PAPER.boxes, LINK_BOX])

ADVICE = "One of 2 workers computes at a time: one worker is the faster choice."
FIGURES = ["joint_angles", "tracking", "postures"]
COMMON = Common(
    experiment="redundant8", method="eamp", case=1, seed=1, population_size=500, generations=N,
    evaluations=5480 * N, best=BestFound(0.0367, 17), wall_seconds=0.4, workers=2,
    topology="star", lost_workers=0, condemned=[], reproducible=True,
    final_population_sha256="ab" * 32, paper=None, versions={},
)  # fmt: skip


def three_joints() -> TrackingTask:
    """A small arm between two boxes, on a path with a corner."""
    rows = [(0, 0, 0, 0), (0, 0.25, 0, 90), (0, 0, 0.30, 0), (0, 0, 0.25, 0)]
    arm = arm_from_dh_rows("three", rows, fixed_rows=[0])
    start = np.radians([20.0, 35.0, -80.0])
    corners = [(39.62, 14.42, 24.53), (39.62, -14.0, 24.5), (30.0, -14.0, 35.0)]
    boxes = [(22, -30, 0, 40, -12, 16), (20, 5, 45, 36, 25, 52)]
    path = points_along(corners, N)
    return TrackingTask.for_arm(arm, start, path, boxes=boxes, step=np.radians(1.0))


def fill(folder: Path, *scenes: Scene, case: int | None = 1) -> Path:
    """A run folder as ``tramnet run redundant8`` leaves it, of paths followed by resolved rates."""
    document = {
        "tasks": [scene.task.parameters() for scene in scenes],
        "names": [scene.name for scene in scenes],
        "method": Eamp(seed=1).parameters(),
    }
    with OpenRunFolder.create(folder, {"experiment": "redundant8", "redundant8": document}) as run:
        paths = [follow(scene.task, ResolvedRate(), 1, N + 1, scene.task.start) for scene in scenes]
        for scene, path in zip(scenes, paths, strict=True):
            write_tracking(folder, scene.name, scene.task, path)
        common = Common(**{**COMMON, "case": case})
        timing = Timing(evaluations_per_second=3.4e6, network_overhead_fraction=0.1)
        network = NetworkCost(0.16, 12, [0.36, 0.0], ADVICE)
        run.write_result(tracking_result(common, timing, scenes, paths, 0.36, network))
    return folder


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fill(tmp_path_factory.mktemp("paper") / "run", Scene("", PAPER))


@pytest.fixture(scope="module")
def several(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scenes = [Scene(f"scene-{i}", PAPER) for i in range(4)]
    folder = tmp_path_factory.mktemp("several") / "run"
    return fill(folder, *scenes, Scene("bare", BARE), Scene("touched", TOUCHED), case=None)


@pytest.fixture(scope="module")
def followed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, FollowedScene]:
    tasks = {"paper": PAPER, "bare": BARE, "touched": TOUCHED, "three": three_joints()}
    folder = tmp_path_factory.mktemp("followed") / "run"
    scenes = TrackingRecord.read(fill(folder, *map(Scene._make, tasks.items()))).scenes
    return {scene.name: scene for scene in scenes}


def drawn(figure: Figure) -> Figure:
    figure.canvas.draw()
    return figure


def printed(folder: Path, width: int = 100) -> str:
    console = Console(file=io.StringIO(), width=width, force_terminal=True, color_system="standard")
    with console.capture() as capture:
        print_summary(folder, console)
    return capture.get()


def test_a_path_has_its_figures_as_png_and_svg_made_alike_each_time(tmp_path):
    folder = fill(tmp_path / "run", Scene("", three_joints()))
    first = {path: path.read_bytes() for path in write_figures(folder)}
    for path in first:
        path.unlink()

    second = {path: path.read_bytes() for path in write_figures(folder)}

    assert [path.name for path in first] == [
        f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")
    ]
    assert first == second


def test_of_many_scenes_those_of_most_error_and_least_clearance_have_figures(several):
    record = TrackingRecord.read(several)

    assert len(record.scenes) == 6
    assert {scene.name for scene in record.drawn} == {"touched", "scene-0"}


def test_all_of_a_few_scenes_have_figures_beside_their_overview(tmp_path, monkeypatch):
    folder = fill(tmp_path / "run", Scene("a", BARE), Scene("b", PAPER))
    monkeypatch.setattr(figures, "save", lambda figure, folder, name: [folder / name])

    written = [path.name for path in write_figures(folder)]

    assert written == ["scenes", *(f"{name}-{scene}" for scene in "ab" for name in FIGURES)]


@pytest.mark.parametrize("draw", [draw_joint_angles, draw_following, draw_postures])
@pytest.mark.parametrize("name", ["paper", "bare", "three"])
def test_nothing_is_cut_off_and_no_legend_covers_data(followed, name, draw, assert_in_order):
    with one_look():
        figure = drawn(draw(followed[name]))

        assert_in_order(figure)


def test_there_is_a_panel_a_joint_and_the_inert_one_is_named(followed):
    with one_look():
        panels = draw_joint_angles(followed["paper"]).axes

    assert [axes.get_title() or axes.get_title("left") for axes in panels] == [
        f"Joint {i}" for i in range(1, 9)
    ]
    assert [axes.get_title("right") for axes in panels] == [""] * 7 + ["moves no link"]
    np.testing.assert_array_equal(panels[2].lines[0].get_ydata(), followed["paper"].path.q[:, 2])


def test_errors_stand_below_their_zone_and_steps_below_their_limit(followed):
    with one_look():
        error, _, step = draw_following(followed["paper"]).axes

    assert [line.get_ydata()[0] for line in error.lines if line.get_linestyle() == "--"] == [0.1]
    (limit,) = (line.get_ydata()[0] for line in step.lines if line.get_linestyle() == "--")
    assert limit == pytest.approx(0.5)
    assert error.get_ylim()[1] > 0.1
    assert step.get_ylim()[1] > 0.5


def test_the_clearance_stays_below_that_of_the_path_itself(followed):
    scene = followed["paper"]

    assert (scene.path.clearance <= scene.most_clearance + scene.path.error + 1e-9).all()
    assert scene.most_clearance[0] == pytest.approx(np.hypot(2.0, 19.5), abs=1e-9)


def test_the_points_below_the_paper_s_obstacle_are_marked(followed):
    below = np.flatnonzero(followed["paper"].beside_boxes)

    # The paper's line is below the printed plane from k = 334 to 809 of 1,000.
    assert (below[0], below[-1]) == (-(-334 * N // 1000), 809 * N // 1000)
    with one_look():
        for axes in draw_following(followed["paper"]).axes:
            (span,) = axes.patches
            assert (span.get_x(), span.get_width()) == (below[0], below[-1] - below[0])


def test_without_boxes_there_is_no_panel_of_clearances(followed):
    with one_look():
        panels = draw_following(followed["bare"]).axes

    assert [axes.get_ylabel() for axes in panels] == ["error [cm]", "largest step [deg]"]


def test_where_the_arm_touches_a_box_is_marked(followed):
    with one_look():
        legend = draw_following(followed["touched"]).legends[0]

    assert "arm touches a box" in [text.get_text() for text in legend.get_texts()]


@pytest.mark.parametrize("name", ["paper", "bare", "three"])
def test_the_picture_in_space_has_true_proportions_and_room_for_everything(followed, name):
    scene = followed[name]
    with one_look():
        figure = drawn(draw_postures(scene))

    space, above, side = figure.axes
    limits = np.array([space.get_xlim(), space.get_ylim(), space.get_zlim()])
    lengths = np.diff(limits)[:, 0]
    aspect = np.asarray(space.get_box_aspect())
    np.testing.assert_allclose(aspect / aspect[0], lengths / lengths[0], rtol=1e-9)
    everything = [np.array(line.get_data_3d()).T for line in space.lines]
    everything.append(scene.task.boxes.reshape(-1, 3))
    for points in everything:
        assert (limits[:, 0] <= points).all()
        assert (points <= limits[:, 1]).all()
    for axes in (above, side):
        assert axes.get_aspect() == 1.0


def test_postures_stand_evenly_along_the_path_and_in_the_legend(followed):
    scene = followed["paper"]
    with one_look():
        figure = drawn(draw_postures(scene))

    space, (legend,) = figure.axes[0], figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert set(words) == {
        "box",
        "path",
        *(f"k = {k}" for k in np.linspace(0, N, 5).round(0).astype(int)),
    }
    postures = {line.get_label(): np.array(line.get_data_3d()).T for line in space.lines}
    np.testing.assert_allclose(postures["k = 0"][-1], scene.path.position[0])
    np.testing.assert_allclose(postures[f"k = {N}"][-1], scene.path.position[-1])
    np.testing.assert_array_equal(postures["k = 0"][0], [0.0, 0.0, 0.0])


def test_the_overview_has_a_line_a_scene(several, assert_in_order):
    record = TrackingRecord.read(several)
    with one_look():
        figure = drawn(draw_scenes(record.found, {scene.name: 0.1 for scene in record.scenes}))

    errors, clearances = figure.axes
    assert [label.get_text() for label in errors.get_yticklabels()] == [
        *(f"scene-{i}" for i in range(4)),
        "bare",
        "touched",
    ]
    assert [text.get_text() for text in clearances.texts] == ["no box"]
    assert_in_order(figure)


def test_an_overview_of_very_many_scenes_shows_those_of_least_clearance(several):
    found = TrackingRecord.read(several).found
    rows = [
        {**found.rows("scenes")[0], "name": f"s{i}", "clearance_min_cm": 2.0 + i} for i in range(99)
    ]
    with one_look():
        figure = drawn(draw_scenes(type(found)({**found.keys, "scenes": rows[::-1]}), {}))

    names = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert names == [f"s{i}" for i in range(39, -1, -1)]
    assert figure.texts[0].get_text() == "Errors and clearances of 40 of 99 scenes"


def test_a_trajectory_of_another_task_is_told_of(tmp_path):
    folder = fill(tmp_path / "run", Scene("", PAPER))
    write_tracking(folder, "", PAPER, np.tile(PAPER.start, (7, 1)))

    with pytest.raises(DamagedFile, match="7 points of 8 joints, expected 251 points of 8"):
        write_figures(folder)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("[redundant8]", "[redundant9]", "the table redundant8"),
        ("[[redundant8.tasks]]", "[[redundant8.task]]", "the table redundant8"),
        ("zone = 0.1", "zone = -0.1", "tasks as tramnet wrote them"),
        ('    "",', "", "a name for each task"),
    ],
)
def test_a_run_file_that_was_altered_is_told_of(tmp_path, old, new, told):
    folder = fill(tmp_path / "run", Scene("", PAPER))
    text = (folder / "run.toml").read_text()
    assert old in text
    (folder / "run.toml").write_text(text.replace(old, new))

    with pytest.raises(DamagedFile, match=told):
        write_figures(folder)


def test_the_summary_says_what_matters(paper):
    text = printed(paper)

    for fact in (
        "redundant8  ·  the paper's task  ·  eamp  ·  seed 1",
        "0 points outside the zone",
        "at least 2.",
        "after the first 50 points",
        "at most 0.",
        "0.0367, at point 17",
        "1.44 ms computing, 1.6 ms in all",
        "0.16 ms a step, 12 exchanges; workers idle 10%, 100% of the time",
        ADVICE,
        "1,370,000 in 0.40 s",
        "paths           SHA-256 abababababababab",
    ):
        assert fact in text


def test_the_paper_s_times_stand_beside_those_of_its_task(paper):
    lines = printed(paper).splitlines()

    (row,) = (line for line in lines if "EAMP 500/10  " in line)
    assert row.split() == ["EAMP", "500/10", "78", "244", "48", "398", "1.6", "49"]
    assert any("The paper's 398 is against the naive search" in line for line in lines)


def test_an_own_task_is_not_compared_with_the_paper(several):
    text = printed(several)

    assert "6 scenes" in text
    assert "table 4" not in text
    assert "none: the arm touches a box" in text
    assert "\x1b[1;31mnone" in text
    assert len([line for line in text.splitlines() if line.startswith(" scene-")]) == 4
    (bare,) = (line for line in text.splitlines() if line.startswith(" bare "))
    assert bare.split()[3:5] == ["none", "none"]


def test_a_result_with_gaps_is_summed_up_all_the_same(tmp_path):
    folder = fill(tmp_path / "run", Scene("", BARE))
    path = folder / "result.json"
    gaps = {"best": {}, "network": None, "ms_per_step": None}
    path.write_bytes(msgspec.json.encode(msgspec.json.decode(path.read_bytes()) | gaps))

    text = printed(folder)

    assert "clearance       no box" in text
