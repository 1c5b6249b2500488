import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_workers.kernels.control import follow_path, snap_poses
from tramnet_workers.kernels.design import DM, HC, JLC, RC, TC
from tramnet_workers.kernels.planar import PlanarModel, evaluate_planar
from tramnet_workers.kernels.poses import best_poses

NO_STROKES = np.zeros(0, np.int64)
NO_BOXES = np.zeros((0, 4))
SEEDS = st.integers(0, 2**32)


def model(n=3, by_place=True, strokes=(), boxes=NO_BOXES, printed_hc=False, limit=np.pi):
    rows = np.array([(link, 0.3) for link in strokes]).reshape(-1, 2)
    limits = np.tile([[-limit], [limit]], (1, n))
    return PlanarModel(by_place, limits, rows, np.asarray(boxes, float), printed_hc)


def evaluated(arm, points, genes):
    """Return places, traits and terms of one population or several."""
    k, _, m = genes.shape
    n, n_strokes = arm.limits.shape[1], len(arm.strokes)
    places = np.empty((k, n + 1, 2, m))
    traits, terms = np.empty((k, 2 * n + 2 + n_strokes, m)), np.empty((k, 8, m))
    evaluate_planar(arm, points, genes, places, traits, terms)
    return places, traits, terms


def genes_by_angle(rng, n=3, n_strokes=0, m=20, k=1):
    angles = rng.uniform(-np.pi, np.pi, (k, n, m))
    strokes = rng.uniform(0.0, 0.3, (k, n_strokes, m))
    base, lengths = rng.uniform(-0.3, 0.3, (k, 2, m)), rng.uniform(0.2, 0.6, (k, n, m))
    return np.concatenate([angles, strokes, base, lengths], axis=1)


def jacobian(lengths, angles, strokes=(), links=(), scale=0.3):
    """Differentiate the tip numerically: columns of angles, then of strokes."""

    def tip(x):
        reach = np.array(lengths, float)
        for value, link in zip(x[len(angles) :], links, strict=True):
            reach[link] += value
        return np.exp(1j * np.cumsum(x[: len(angles)])) @ reach

    x, h = np.concatenate([angles, strokes]), 1e-6
    columns = [(tip(x + h * e) - tip(x - h * e)) / (2 * h) for e in np.eye(len(x))]
    scales = [1.0] * len(angles) + [scale] * len(strokes)
    return np.array([[c.real * s, c.imag * s] for c, s in zip(columns, scales, strict=True)]).T


@given(SEEDS, st.integers(1, 5))
def test_places_and_angles_describe_the_same_arm(seed, n):
    genes = genes_by_angle(np.random.default_rng(seed), n)
    point = np.array([[0.4, 0.2]])
    places, traits, by_angle = evaluated(model(n, by_place=False), point, genes)

    for j in range(genes.shape[2]):
        origin, tip = places[0, 0, :, j], places[0, n, :, j]
        joints = (places[0, 1:n, :, j] - origin).reshape(-1)
        copy = np.concatenate([joints, origin, np.zeros(n)])[None, :, None]
        again = evaluated(model(n), tip[None], copy)

        assert again[1][0, :, 0] == pytest.approx(traits[0, :, j], abs=1e-9)
        assert again[2][0, DM, 0] == pytest.approx(by_angle[0, DM, j], abs=1e-12)
        assert again[2][0, RC, 0] == 0.0


@given(SEEDS, st.integers(2, 5))
def test_dexterity_is_the_root_of_the_determinant_over_the_squared_length(seed, n):
    genes = genes_by_angle(np.random.default_rng(seed), n, m=5)
    _, _, terms = evaluated(model(n, by_place=False), np.zeros((1, 2)), genes)

    for j in range(5):
        lengths, J = genes[0, n + 2 :, j], jacobian(genes[0, n + 2 :, j], genes[0, :n, j])
        expected = np.sqrt(np.linalg.det(J @ J.T)) / lengths.sum() ** 2
        assert terms[0, DM, j] == pytest.approx(expected, rel=1e-6)


@given(SEEDS)
def test_strokes_are_columns_of_the_jacobian_and_lengthen_their_links(seed):
    links = (0, 2)
    genes = genes_by_angle(np.random.default_rng(seed), 3, 2, m=5)
    arm = model(3, by_place=False, strokes=links)
    places, traits, terms = evaluated(arm, np.zeros((1, 2)), genes)

    for j in range(5):
        lengths, strokes = genes[0, 7:, j], genes[0, 3:5, j]
        J = jacobian(lengths, genes[0, :3, j], strokes, links)
        total = lengths.sum() + strokes.sum()
        expected = np.sqrt(np.linalg.det(J @ J.T)) / total**2
        assert terms[0, DM, j] == pytest.approx(expected, rel=1e-6)
        steps = np.diff(places[0, :, :, j], axis=0)
        extended = lengths + np.array([strokes[0], 0.0, strokes[1]])
        assert np.hypot(*steps.T) == pytest.approx(extended, abs=1e-12)
        assert traits[0, :3, j] == pytest.approx(lengths)


def test_a_two_link_arm_is_most_dexterous_with_equal_links_at_a_right_angle():
    elbow, share = np.meshgrid(np.linspace(0.0, np.pi, 181), np.linspace(0.05, 0.95, 91))
    rows = [np.zeros(elbow.size), elbow.ravel(), *np.zeros((2, elbow.size)), share.ravel(),
            1.0 - share.ravel()]  # fmt: skip
    _, _, terms = evaluated(model(2, by_place=False), np.zeros((1, 2)), np.array([rows]))

    best = terms[0, DM].argmax()

    assert terms[0, DM, best] == pytest.approx(0.25)  # Yoshikawa (1985)
    assert elbow.ravel()[best] == pytest.approx(np.pi / 2)
    assert share.ravel()[best] == pytest.approx(0.5)


def test_a_three_link_arm_of_equal_links_is_most_dexterous_at_0_715_of_its_reach():
    distances = np.linspace(0.5, 0.95, 451)
    points = np.stack([distances, np.zeros_like(distances)], axis=1)
    poses, dexterity = np.empty((451, 3)), np.empty(451)

    best_poses(np.full(3, 1 / 3), points, np.full(3, -np.pi), np.full(3, np.pi), 360, 40, poses,
               dexterity)  # fmt: skip

    assert dexterity.max() == pytest.approx(0.29274, abs=1e-5)
    assert distances[dexterity.argmax()] == pytest.approx(0.715, abs=2e-3)


def test_an_arm_without_a_middle_link_has_the_degenerate_dexterity():
    genes = np.array([0.3, np.pi / 2, 0.0, 0.0, 0.0, 0.5, 0.0, 0.5])[None, :, None]

    _, _, terms = evaluated(model(by_place=False), np.zeros((1, 2)), genes)

    assert terms[0, DM, 0] == pytest.approx(2**0.5 / 4)  # what HC is there to prevent


@given(SEEDS)
def test_the_best_pose_reaches_its_point_and_no_random_pose_is_better(seed):
    rng = np.random.default_rng(seed)
    lengths, limit = rng.uniform(0.2, 0.6, 3), np.deg2rad(150.0)
    angle = rng.uniform(-np.pi, np.pi)
    points = lengths.sum() * rng.uniform(0.3, 0.95) * np.array([[np.cos(angle), np.sin(angle)]])
    poses, dexterity = np.empty((1, 3)), np.empty(1)
    best_poses(lengths, points, np.full(3, -limit), np.full(3, limit), 360, 40, poses, dexterity)
    sample = np.tile(np.concatenate([poses[0], np.zeros(2), lengths])[:, None], (1, 300))
    sample[:3, 1:] = rng.uniform(-limit, limit, (3, 299))
    joints = sample[:3].T.copy()
    snap_from_afar(lengths, points[0], joints)
    sample[:3] = joints.T

    _, _, terms = evaluated(model(by_place=False, limit=limit), points, sample[None])

    if dexterity[0] > 0.0:
        assert terms[0, RC, 0] < 1e-9
        assert terms[0, DM, 0] == pytest.approx(dexterity[0], rel=1e-9)
        assert terms[0, JLC, 0] == 0.0
    reached = (terms[0, RC] < 1e-9) & (terms[0, JLC] == 0.0)
    assert terms[0, DM][reached].max(initial=0.0) <= max(dexterity[0], 0.0) + 1e-3


def snap_from_afar(lengths, point, joints):
    """Close the last two links of random poses onto a point, where they can."""
    for pose in joints:
        elbow = lengths[0] * np.exp(1j * pose[0])
        rest = complex(*point) - elbow
        a, b = lengths[1], lengths[2]
        cosine = (abs(rest) ** 2 - a**2 - b**2) / (2 * a * b)
        if abs(cosine) < 1.0:
            pose[2] = np.arccos(cosine) * np.sign(pose[2])
            absolute = np.angle(rest) - np.angle(a + b * np.exp(1j * pose[2]))
            pose[1] = np.angle(np.exp(1j * (absolute - pose[0])))


def test_an_arm_that_is_too_short_has_no_pose():
    poses, dexterity = np.empty((1, 3)), np.empty(1)

    best_poses(np.full(3, 0.2), np.array([[1.0, 0.0]]), np.full(3, -3.0), np.full(3, 3.0), 90, 20,
               poses, dexterity)  # fmt: skip

    assert dexterity[0] == -1.0


@given(SEEDS, st.booleans())
def test_an_individual_has_the_same_bits_wherever_it_stands(seed, by_place):
    rng = np.random.default_rng(seed)
    genes = rng.uniform(-1.0, 1.0, (2, 9 if by_place else 8, 13))
    arm, points = model(by_place=by_place), rng.uniform(-1.0, 1.0, (2, 2))
    _, traits, terms = evaluated(arm, points, genes)
    order = rng.permutation(13)

    _, moved_traits, moved_terms = evaluated(arm, points, np.ascontiguousarray(genes[..., order]))
    _, _, alone = evaluated(arm, points[1:], np.ascontiguousarray(genes[1:, :, 5:6]))

    assert np.array_equal(moved_traits, traits[..., order])
    assert np.array_equal(moved_terms[:, :5], terms[..., order][:, :5])
    assert np.array_equal(alone[0, :5, 0], terms[1, :5, 5])


@pytest.mark.parametrize(
    ("box", "length"),
    [
        ((-1.0, -1.0, 2.0, 1.0), 1.0),  # all of the link
        ((0.2, -1.0, 0.5, 1.0), 0.3),  # a slice of it
        ((0.2, 0.1, 0.5, 1.0), 0.0),  # beside it
        ((1.5, -1.0, 2.0, 1.0), 0.0),  # beyond its end
        ((0.5, 0.0, 0.7, 1.0), 0.2),  # its edge along the link
    ],
)
def test_an_obstacle_costs_the_length_of_link_inside_it(box, length):
    genes = np.array([0.0, 0.0, 0.0, 1.0])[None, :, None]

    _, _, terms = evaluated(model(1, by_place=False, boxes=[box]), np.zeros((1, 2)), genes)

    assert terms[0, TC, 0] == pytest.approx(length)


@given(SEEDS)
def test_length_inside_boxes_agrees_with_dense_sampling(seed):
    rng = np.random.default_rng(seed)
    genes = genes_by_angle(rng, 3, m=4)
    corner = rng.uniform(-0.6, 0.3, 2)
    box = np.concatenate([corner, corner + rng.uniform(0.1, 0.5, 2)])
    arm = model(by_place=False, boxes=[box])
    places, _, terms = evaluated(arm, np.zeros((1, 2)), genes)

    share = (np.arange(20000) + 0.5) / 20000
    for j in range(4):
        inside = 0.0
        for k in range(3):
            a, b = places[0, k, :, j], places[0, k + 1, :, j]
            samples = a + share[:, None] * (b - a)
            hit = ((samples > box[:2]) & (samples < box[2:])).all(axis=1)
            inside += hit.mean() * np.hypot(*(b - a))
        assert terms[0, TC, j] == pytest.approx(inside, abs=2e-4)


@given(SEEDS)
def test_snapped_poses_lie_on_their_points(seed):
    rng = np.random.default_rng(seed)
    lengths, joints = rng.uniform(0.3, 0.6, 3), rng.uniform(-2.0, 2.0, (5, 3))
    joints[:, 1:] = np.sign(joints[:, 1:]) * np.maximum(abs(joints[:, 1:]), 0.4)
    bases = rng.uniform(-0.2, 0.2, (5, 2))
    tips = np.exp(1j * np.cumsum(joints, axis=1)) @ lengths
    points = bases + np.stack([tips.real, tips.imag], axis=1) + rng.uniform(-0.005, 0.005, (5, 2))

    snap_poses(lengths, NO_STROKES, bases, points, joints)

    tips = np.exp(1j * np.cumsum(joints, axis=1)) @ lengths
    assert bases + np.stack([tips.real, tips.imag], axis=1) == pytest.approx(points, abs=1e-12)


def test_poses_far_from_their_points_are_left_to_be_seen():
    joints = np.array([[0.1, 0.2, 0.3]])

    snap_poses(np.full(3, 0.4), NO_STROKES, np.zeros((1, 2)), np.array([[0.0, 0.5]]), joints)

    assert joints.tolist() == [[0.1, 0.2, 0.3]]


def null_motion_along_a_line(exact_gain):
    lengths, n1 = np.full(3, 0.45), 20
    start = np.array([0.3, 0.9, 0.7])
    tip = complex(np.exp(1j * np.cumsum(start)) @ lengths)
    path = np.array([[tip.real + 0.04 * s, tip.imag - 0.05 * s] for s in np.arange(n1 + 1) / n1])
    goal = start[None] + [[0.25, -0.2, 0.1]]
    snap_from_afar(lengths, path[-1], goal)
    joints, steps = np.empty((n1 + 1, 3)), np.empty(n1)
    joints[0] = start
    follow_path(lengths, NO_STROKES, path, goal[0], exact_gain, joints, steps)
    tips = np.exp(1j * np.cumsum(joints, axis=1)) @ lengths
    return joints, goal[0], steps, abs(tips - path @ [1, 1j]).max()


def test_the_exact_gain_keeps_the_null_motion_constant_and_ends_in_the_pose():
    joints, goal, steps, error = null_motion_along_a_line(exact_gain=True)

    assert steps.max() / steps.mean() < 1.1
    assert joints[-1] == pytest.approx(goal, abs=1e-3)
    assert error < 1e-3


def test_the_printed_gain_peaks_at_nearly_three_times_the_mean():
    joints, goal, steps, _ = null_motion_along_a_line(exact_gain=False)

    # The text says "almost constant"; the distance decays as prod(1 - j / n1) instead.
    assert 2.5 < steps.max() / steps.mean() < 3.2
    assert joints[-1] == pytest.approx(goal, abs=1e-3)


@pytest.mark.parametrize("term", [HC, JLC])
def test_a_task_of_one_link_has_no_heuristic_and_no_limit_violated(term):
    genes = np.array([0.5, 0.0, 0.0, 1.0])[None, :, None]

    _, _, terms = evaluated(model(1, by_place=False), np.zeros((1, 2)), genes)

    assert terms[0, term, 0] == 0.0
