from tramnet_master.farm.changes import MOMENT, Changes
from tramnet_master.farm.events import Tram


def test_the_first_change_waits_a_moment_for_others():
    changes = Changes()
    assert changes.due is None

    changes.lose(Tram(1, 1), 10.0)
    changes.lose(Tram(2, 2), 10.0 + MOMENT / 2)

    assert changes.lost == [Tram(1, 1), Tram(2, 2)]
    assert changes.due == 10.0 + MOMENT


def test_who_comes_and_goes_within_a_moment_was_never_there():
    changes = Changes()
    changes.join(Tram(1, 1), 0.0)

    changes.lose(Tram(1, 1), 0.001)

    assert changes.joined == changes.lost == []
    assert changes.due == MOMENT
