import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tramnet_workers.errors import InvalidTask
from tramnet_workers.problems.design_task import Base, DesignTask, Genes, Stroke
from tramnet_workers.problems.stock import UNLIMITED, Stock, shipped_stock
from tramnet_workers.problems.task_terms import Arms, find_task_term
from tramnet_workers.problems.trajectory import Circle, Polyline, grid, intervals


def test_the_default_task_is_the_crank_with_four_points():
    points = DesignTask().points

    expected = [[1.05, 0.4], [0.8, 0.65], [0.55, 0.4], [0.8, 0.15]]
    assert points == pytest.approx(np.array(expected), abs=1e-15)


def test_a_task_survives_the_wire():
    task = DesignTask(
        trajectory=Polyline(((0.5, 0.1), (0.9, 0.2), (0.7, 0.6)), closed=True),
        stations=(0.0, 0.5, 2.0),
        weights={"jac": 0.02, "hc": 0.0},
        stock=Stock((0.2, 0.3), (2, UNLIMITED)),
        base=Base(free=True, lower=(-0.2, -0.2), upper=(0.2, 0.3)),
        genes=Genes(bits=12),
        boxes=((0.1, 0.1, 0.3, 0.4),),
        terms=("isotropy",),
        mobility=float("inf"),
        strokes=(Stroke(1, 0.2),),
        most_returns=1,
    )

    plain = task.parameters()

    assert DesignTask.from_parameters(plain) == task
    assert_plain(plain)


def assert_plain(value):
    match value:
        case dict():
            for element in value.values():
                assert_plain(element)
        case list():
            for element in value:
                assert_plain(element)
        case _:
            assert type(value) in (bool, int, float, str)


def test_what_is_left_out_has_its_default():
    assert DesignTask.from_parameters({}) == DesignTask()
    assert DesignTask.from_parameters({"lengths": [0.5, 0.4, 0.3]}).lengths == (0.5, 0.4, 0.3)


@pytest.mark.parametrize(
    ("parameters", "field"),
    [
        ({"points": []}, "points"),
        ({"stations": []}, "stations"),
        ({"stations": [0.5, 0.25]}, r"stations\[1\]"),
        ({"stations": [0.0, 1.0]}, r"stations\[1\]"),
        ({"trajectory": {"kind": "spiral"}}, "trajectory"),
        ({"trajectory": {"kind": "circle", "centre": [0, 0], "radius": -1}}, "circle.radius"),
        ({"trajectory": {"kind": "polyline", "vertices": [], "closed": True}}, "points"),
        ({"lower": [0.0, 0.0]}, "upper"),
        ({"lower": [4.0, 0.0, 0.0]}, r"lower\[0\]"),
        ({"upper": [3.0, float("nan"), 2.0]}, r"upper\[1\]"),
        ({"weights": {"dex": 1.0}}, "weights.dex"),
        ({"weights": {"jac": -1.0}}, "weights.jac"),
        ({"stock": {"lengths": [], "quantities": []}}, "stock"),
        ({"stock": {"lengths": [0.3, 0.2], "quantities": [1, 1]}}, r"stock.lengths\[1\]"),
        ({"base": {"free": "yes"}}, r"base\.free"),
        ({"base": {"free": True, "lower": [0.0, 0.0], "upper": [0.0, 1.0]}}, r"base.lower\[0\]"),
        ({"genes": {"bits": 4}}, "genes.bits"),
        ({"genes": {"lower": 2.0}}, "genes.lower"),
        ({"boxes": [[0, 0, 1]]}, r"boxes\[0\]"),
        ({"boxes": [[1, 0, 0, 1]]}, r"boxes\[0\]"),
        ({"lengths": [0.4, 0.3]}, "lengths"),
        ({"lengths": [0.4, 0.3, 0.0]}, r"lengths\[2\]"),
        ({"mobility": 0.1}, "base.free"),
        ({"strokes": [{"link": 3, "length": 0.1}]}, r"strokes\[0\].link"),
        ({"most_returns": -1}, "most_returns"),
    ],
)
def test_a_wrong_field_is_named_with_what_was_found_and_expected(parameters, field):
    with pytest.raises(InvalidTask, match=rf"^{field}.*: found .*, expected "):
        DesignTask.from_parameters(parameters)


@given(st.floats(0.0, 1.0))
def test_points_of_a_circle_are_its_radius_away_from_its_centre(s):
    circle = Circle((0.8, 0.4), 0.25)

    assert np.hypot(*(circle.point(s) - [0.8, 0.4])) == pytest.approx(0.25)


def test_points_of_a_polyline_lie_on_its_lines():
    line = Polyline(((0.0, 0.0), (1.0, 0.0), (1.0, 2.0)), closed=True)

    assert line.point(0.25).tolist() == [0.25, 0.0]
    assert line.point(1.5).tolist() == [1.0, 1.0]
    assert line.point(2.5).tolist() == [0.5, 1.0]  # on the way home
    assert line.point(3.0).tolist() == [0.0, 0.0]


def test_intervals_of_a_closed_path_come_home():
    assert intervals(Circle((0, 0), 1), np.array([0.0, 0.4])) == [(0.0, 0.4), (0.4, 1.0)]
    assert intervals(Polyline(((0, 0), (1, 0))), np.array([0.0, 1.0])) == [(0.0, 1.0)]


def test_a_grid_is_walked_to_and_fro():
    walk = grid((0.0, 0.0), (1.0, 1.0), columns=3, rows=2)

    assert walk.vertices == ((0, 0), (0.5, 0), (1, 0), (1, 1), (0.5, 1), (0, 1))


def test_the_shipped_stock_has_modules_every_five_centimetres():
    stock = shipped_stock()

    assert stock.lengths == pytest.approx(np.arange(0.10, 0.801, 0.05))


def test_the_nearest_modules_are_chosen():
    chosen = shipped_stock().choose(
        np.array([0.53, 0.41, 0.40]), ordered=True, reaches=np.array([0.644, 1.144])
    )

    assert chosen == pytest.approx([0.55, 0.40, 0.40])


def test_modules_keep_inner_links_longest_and_reach_the_points():
    stock = Stock.of_lengths([0.3, 0.4, 0.5])
    wanted = np.array([0.36, 0.37, 0.34])

    ordered = stock.choose(wanted, ordered=True, reaches=np.array([0.6]))
    far = stock.choose(wanted, ordered=True, reaches=np.array([1.25]))

    assert ordered.tolist() == [0.4, 0.4, 0.3]
    assert far.sum() >= 1.25


def test_a_module_is_used_no_more_often_than_it_is_in_stock():
    stock = Stock((0.3, 0.4, 0.5), (1, 1, 1))

    chosen = stock.choose(np.full(3, 0.4), ordered=True, reaches=np.array([0.6]))

    assert sorted(chosen) == [0.3, 0.4, 0.5]
    with pytest.raises(InvalidTask, match="modules for 4 links"):
        stock.choose(np.full(4, 0.4), ordered=True, reaches=np.array([0.6]))


def test_a_stock_is_read_from_a_table():
    stock = Stock.from_csv("length_m,quantity\n0.4,2\n0.2,\n", "mine.csv")

    assert stock == Stock((0.2, 0.4), (UNLIMITED, 2))


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("metres\n0.4\n", "stock.csv"),
        ("length_m\nlong\n", "stock.csv line 2, length_m"),
        ("length_m,quantity\n0.4,few\n", "stock.csv line 2, quantity"),
        ("length_m\n", "stock"),
    ],
)
def test_a_wrong_table_is_refused(text, field):
    with pytest.raises(InvalidTask) as caught:
        Stock.from_csv(text, "mine.csv")

    assert caught.value.field == field


def test_isotropy_is_best_where_the_velocity_ellipse_is_a_circle():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])  # levers (1, 1) and (0, 1)
    circle = np.array([[0.0, 0.0], [2**0.5, 0.0], [2**0.5 / 2, 2**0.5 / 2]])
    places = np.stack([square, circle, [[0, 0], [1, 0], [2, 0]]], axis=2)

    penalty = find_task_term("isotropy")(Arms(np.zeros(2), places, np.zeros((6, 3))))

    assert penalty[0] == pytest.approx(1.0 - 2.0 / 3.0)
    assert penalty[1] == pytest.approx(0.0, abs=1e-12)
    assert penalty[2] == pytest.approx(1.0)


def test_an_unknown_task_term_is_answered_with_those_there_are():
    with pytest.raises(InvalidTask, match="isotropy"):
        find_task_term("bracing")
