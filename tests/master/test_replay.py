from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_master.reports.style import one_look
from tramnet_master.reports.traffic import (
    draw_space_time,
    draw_traffic,
    draw_utilisation,
    middle_of,
)
from tramnet_master.traffic.recording import RecordedWork, Recording, SeenFrame
from tramnet_master.traffic.replay import links_of, tags_of, utilisation_of
from tramnet_master.traffic.rows import LINK_BYTES_PER_SECOND


def recording(frames, seconds):
    about = {"title": "sphere", "topology": "pipeline"}
    return Recording(Path("a.mcap"), about, {}, list(frames), 0, seconds, True)


def frame(time, link, size, tag="evaluate", ends=None, sequence=0):
    source, destination = ends or link
    return SeenFrame(time, link, source, destination, tag, size, sequence)


def pipeline(n_workers, generations):
    """Every worker answers a chunk a generation, along a pipeline."""
    frames = []
    for generation in range(generations):
        at = 0.1 * generation
        for seat in range(1, n_workers + 1):
            work = RecordedWork("evaluate", 0, generation, seat, seat + 1)
            for hop in range(seat):
                frames.append(
                    SeenFrame(at + 0.001 * hop, (hop, hop + 1), 0, seat, "evaluate", 800, 0, work)
                )
                frames.append(
                    SeenFrame(
                        at + 0.06 + 0.001 * (seat - hop), (hop + 1, hop), seat, 0, "evaluated",
                        180, 0, work, 0.05,
                    )
                )  # fmt: skip
    return recording(sorted(frames, key=lambda f: f.time), 0.1 * generations)


def test_a_link_is_told_by_frames_bytes_rates_and_gaps():
    found = [frame(t, (0, 1), 1740, sequence=n) for n, t in ((3, 0.0), (4, 0.5), (9, 3.9))]

    (link,) = links_of(recording(found, 4.0))

    assert (link.link, link.frames, link.bytes, link.mean_bytes) == ("link/0/1", 3, 5220, 1740.0)
    assert (link.frames_per_s, link.bytes_per_s) == (0.75, 1305.0)
    assert link.peak_bytes_per_s == 3480.0
    assert link.peak_utilisation == pytest.approx(3480 / LINK_BYTES_PER_SECOND)
    assert link.missed == 4


def test_a_message_of_three_hops_is_one_message():
    hops = [frame(0.1 * n, (n, n + 1), 100, ends=(0, 3)) for n in range(3)]

    (tag,) = tags_of(recording(hops, 1.0))

    assert (tag.tag, tag.frames, tag.bytes, tag.hops) == ("evaluate", 1, 100, 3.0)


@given(
    st.lists(
        st.tuples(st.floats(0.0, 9.0), st.integers(0, 2), st.integers(1, 100_000)),
        min_size=1, max_size=60,
    )
)  # fmt: skip
def test_utilisation_over_time_adds_up_to_the_bytes_of_each_link(found):
    frames = [frame(time, (0, seat + 1), size) for time, seat, size in sorted(found)]

    over_time = utilisation_of(recording(frames, 9.0))

    totals = over_time.shares.sum(axis=1) * over_time.edges[1] * LINK_BYTES_PER_SECOND
    links = links_of(recording(frames, 9.0))
    assert totals == pytest.approx([link.bytes for link in links])
    assert all(link.peak_bytes_per_s <= link.bytes for link in links)


def test_the_picture_shows_a_few_chunks_in_the_middle():
    found = pipeline(3, 40)

    begin, end = middle_of(found)

    assert 1.0 < begin < end < 3.0
    assert end - begin == pytest.approx(0.8, abs=0.15)


@pytest.mark.parametrize(("n_workers", "generations"), [(1, 1), (3, 40), (20, 5)])
def test_both_figures_are_in_order(n_workers, generations, assert_in_order):
    found = pipeline(n_workers, generations)
    with one_look():
        for figure in (draw_utilisation(found), draw_space_time(found, middle_of(found))):
            figure.canvas.draw()
            assert_in_order(figure)


def test_figures_are_written_as_png_and_svg(tmp_path):
    written = draw_traffic(pipeline(2, 3), tmp_path, "a", (0.0, 0.2))

    assert sorted(path.name for path in written) == [
        "a-space-time.png", "a-space-time.svg", "a-utilisation.png", "a-utilisation.svg",
    ]  # fmt: skip
    assert all(path.stat().st_size > 1000 for path in written)


def test_the_fullest_second_of_a_short_recording_is_its_mean():
    (link,) = links_of(recording([frame(0.1, (0, 1), 500)], 0.5))

    assert link.peak_bytes_per_s == 500.0
    assert np.isclose(link.bytes_per_s, 1000.0)
