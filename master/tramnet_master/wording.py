"""How messages name things: values as they stand in a file, and words that were probably meant."""

import difflib
import json
from collections.abc import Collection

_LONGEST_TEXT = 60
_LONGEST_LIST = 12


def spell(value: object) -> str:
    """A value as it stands in a TOML file, cut where it is long."""
    match value:
        case bool():
            spelled = str(value).lower()
        case str():
            cut = value if len(value) <= _LONGEST_TEXT else value[: _LONGEST_TEXT - 3] + "..."
            spelled = json.dumps(cut, ensure_ascii=False)
        case list() if len(value) > _LONGEST_LIST:
            spelled = f"a list of {len(value)}"
        case list():
            spelled = f"[{', '.join(map(spell, value))}]"
        case dict():
            spelled = "a table"
        case int() if abs(value) >= 1e15:
            spelled = "a very large number"
        case _:
            spelled = str(value)
    return spelled


def closest(word: str, words: Collection[str]) -> str | None:
    """The one of ``words`` that was probably meant, or None."""
    found = difflib.get_close_matches(word, list(words), n=1, cutoff=0.6)
    return found[0] if found else None


def time_span(seconds: float) -> str:
    """A time in the unit that suits it: ``4.2 us``, ``31.1 ms``, ``86.9 s``, ``15.9 min``, ``2.5 h``."""
    if seconds >= 7200.0:
        return f"{seconds / 3600:.1f} h"
    if seconds >= 120.0:
        return f"{seconds / 60:.1f} min"
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"
