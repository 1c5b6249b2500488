from tramnet_protocol.tokens import TokenView


def told(*events):
    """Return what a watcher is told of some events: a key, and True, False or "found"."""
    seen = []
    view = TokenView(lambda key, alive: seen.append((key, alive)))
    for key, event in events:
        if event == "found":
            view.found(key)
        else:
            view.change(key, event)
    return seen


def test_what_was_there_and_what_changes_is_told_once():
    assert told(("a", "found"), ("a", True), ("b", True), ("a", False)) == [
        ("a", True),
        ("b", True),
        ("a", False),
    ]


def test_a_token_that_is_gone_is_not_found_again():
    assert told(("a", False), ("a", "found")) == [("a", False)]
    assert told(("a", True), ("a", False), ("a", "found")) == [("a", True), ("a", False)]


def test_a_token_that_comes_back_is_told_again():
    assert told(("a", "found"), ("a", False), ("a", True)) == [
        ("a", True),
        ("a", False),
        ("a", True),
    ]


def test_a_lost_connection_takes_every_token_along_once():
    seen = []
    view = TokenView(lambda key, alive: seen.append((key, alive)))
    view.change("a", True)
    view.found("b")
    view.change("b", False)

    view.lose_all()
    view.lose_all()
    view.change("a", True)

    assert seen == [("a", True), ("b", True), ("b", False), ("a", False), ("a", True)]
