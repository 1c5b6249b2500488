"""The exact distance of segment and box against coal, against sampling, and its laws."""

import coal
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from tramnet_workers.kernels.distances import segment_box_distances

Array = NDArray[np.float64]

PAIRS = 4000
places = hnp.arrays(np.float64, (3,), elements=st.floats(-100.0, 100.0))
# Whole numbers lie on sides, edges and corners far more often than others.
round_places = hnp.arrays(np.float64, (3,), elements=st.integers(-4, 4).map(float))
any_places = places | round_places


@st.composite
def boxes(draw: st.DrawFn) -> Array:
    corners = np.sort(np.stack([draw(any_places), draw(any_places)]), axis=0)
    return corners.reshape(6)


def distance(start: Array, end: Array, box: Array) -> float:
    return float(segment_box_distances(start[None], end[None], box[None])[0])


def random_pairs(seed: int) -> tuple[Array, Array, Array]:
    """Return starts, ends and boxes; some segments are points, lie along an axis or in a side."""
    rng = np.random.default_rng(seed)
    lower = rng.uniform(-20.0, 20.0, (PAIRS, 3))
    upper = lower + rng.uniform(0.1, 30.0, (PAIRS, 3))
    starts, ends = rng.uniform(-60.0, 60.0, (2, PAIRS, 3))
    same = rng.random((PAIRS, 3)) < 0.2
    ends[same] = starts[same]
    flush = rng.random((PAIRS, 3)) < 0.1
    starts[flush] = ends[flush] = upper[flush]
    return starts, ends, np.hstack([lower, upper])


def coal_distance(start: Array, end: Array, box: Array) -> float:
    """Return coal's distance, with a capsule of radius 1 mm for the segment; 0 where they meet."""
    along = end - start
    length = float(np.linalg.norm(along))
    radius = 0.1
    shape = coal.Sphere(radius) if length == 0.0 else coal.Capsule(radius, length)
    turn = coal.Transform3s()
    if length > 0.0:
        turn.setRotation(rotation_to(along / length))
    turn.setTranslation((start + end) / 2)
    place = coal.Transform3s()
    place.setTranslation((box[:3] + box[3:]) / 2)
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = 1e-9
    found = coal.distance(shape, turn, coal.Box(*(box[3:] - box[:3])), place, request, result)
    return max(float(found) + radius, 0.0)


def rotation_to(direction: Array) -> Array:
    """Return a rotation that turns z into a direction."""
    other = np.eye(3)[int(np.argmin(np.abs(direction)))]
    x = np.cross(other, direction)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(direction, x), direction], axis=1)


def test_distances_agree_with_coal() -> None:
    starts, ends, corners = random_pairs(8)

    found = segment_box_distances(starts, ends, corners)

    expected = np.array([coal_distance(*pair) for pair in zip(starts, ends, corners, strict=True)])
    apart = found > 0.11  # nearer than the capsule's radius, coal measures depths
    assert apart.sum() > 0.5 * PAIRS
    np.testing.assert_allclose(found[apart], expected[apart], atol=1e-5)


def test_coal_finds_a_collision_where_the_distance_is_zero() -> None:
    starts, ends, corners = random_pairs(9)

    meeting = segment_box_distances(starts, ends, corners) == 0.0

    assert meeting.any()
    for start, end, box in zip(starts[meeting], ends[meeting], corners[meeting], strict=True):
        assert coal_distance(start, end, box) < 0.1 + 1e-6


@given(any_places, any_places, boxes())
def test_no_sampled_point_of_the_segment_is_nearer(start: Array, end: Array, box: Array) -> None:
    t = np.linspace(0.0, 1.0, 2001)[:, None]
    samples = start + t * (end - start)
    nearest = np.linalg.norm(samples - np.clip(samples, box[:3], box[3:]), axis=1).min()

    found = distance(start, end, box)

    spacing = float(np.linalg.norm(end - start)) / 2000
    assert nearest - spacing <= found + 1e-9
    assert found <= nearest + 1e-9


@given(any_places, any_places, boxes())
def test_the_distance_does_not_depend_on_the_segment_s_direction(
    start: Array, end: Array, box: Array
) -> None:
    np.testing.assert_allclose(
        distance(start, end, box), distance(end, start, box), rtol=1e-9, atol=1e-7
    )


@given(any_places, boxes())
def test_a_point_is_a_segment(point: Array, box: Array) -> None:
    expected = np.linalg.norm(point - np.clip(point, box[:3], box[3:]))

    np.testing.assert_allclose(distance(point, point, box), expected, rtol=1e-12)


@given(any_places, any_places, boxes(), st.floats(0.0, 1.0))
def test_a_segment_through_a_box_has_no_distance(
    start: Array, through: Array, box: Array, t: float
) -> None:
    inside = np.clip(through, box[:3], box[3:])
    end = inside + t * (inside - start)

    assert distance(start, end, box) <= 1e-9
