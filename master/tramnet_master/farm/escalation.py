"""What becomes of a piece of work that killed, hung or failed.

Deaths and overruns are *accidents*: the machine may be to blame, so the same piece is tried again, and only
after three of them is it bisected. An *error* (an exception, NaN) is the evaluation's own word: trying the same
chunk again would say the same, so its slots are separated at once. What cannot be separated further and has
failed becomes *suspect*: from then on it is tried alone, and only in processes that never had other work, so
that nothing but itself can be to blame. Three failures there condemn it.

A random kill hits an innocent piece now and then. To condemn one it would have to hit the same slot at every
step of this ladder, which for a chunk of 64 slots is 24 times in a row.
"""

from tramnet_master.farm.batch import Piece
from tramnet_master.farm.rules import Rules


def after_accident(piece: Piece, atomic: bool, error: str, rules: Rules) -> list[Piece]:
    """Pieces to try after a worker died or overran with this one in work; none condemns it.

    Args:
        piece: The piece.
        atomic: Whether it cannot be cut.
        error: What happened.
        rules: The number of trials.
    """
    failures = piece.failures + 1
    first, last = piece.first, piece.last
    if failures < rules.trials:
        return [Piece(first, last, failures, piece.resends + 1, piece.suspect, error)]
    if not atomic:
        middle = (first + last) // 2
        return [Piece(first, middle, error=error), Piece(middle, last, error=error)]
    if not piece.suspect:
        return [Piece(first, last, 0, piece.resends + 1, suspect=True, error=error)]
    return _give_up(piece, error, rules)


def after_error(piece: Piece, alone: bool, error: str, rules: Rules) -> list[Piece]:
    """Pieces to try after the evaluation of this one failed; none condemns it.

    Args:
        piece: The piece.
        alone: Whether it was evaluated alone; if not, its slots are, one by one.
        error: What happened.
        rules: The number of trials.
    """
    first, last = piece.first, piece.last
    if not alone:
        return [Piece(slot, slot + 1, error=error) for slot in range(first, last)]
    failures = piece.failures + 1 if piece.suspect else 0
    if failures < rules.trials:
        return [Piece(first, last, failures, piece.resends, suspect=True, error=error)]
    return _give_up(piece, error, rules)


def _give_up(piece: Piece, error: str, rules: Rules) -> list[Piece]:
    if rules.condemn:
        return []
    again = Piece(
        piece.first, piece.last, rules.trials - 1, piece.resends + 1, suspect=True, error=error
    )
    return [again]
