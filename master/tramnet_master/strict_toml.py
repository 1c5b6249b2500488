"""Strict reading of a user's TOML file into a typed struct; the first mistake becomes one ``InvalidFile``.

What a file may say is a frozen ``msgspec.Struct``, tables as structs in it and arrays of tables as their lists.
A field's ``Meta`` description says in words what is expected, and stands in the message. Nothing is guessed: a key
nobody knows, a key twice under two spellings, text for a number or a NaN is an error that names the field.
"""

import math
import re
import tomllib
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple, TypeVar, cast, get_args, get_origin

import msgspec
from msgspec import Meta, Struct

from tramnet_master.errors import InvalidFile
from tramnet_master.wording import closest, spell

T = TypeVar("T", bound=Struct)
Table = dict[str, object]

LARGEST_FILE = 1 << 20  # a task is a few hundred bytes [B]

# msgspec's words for types, in those of people who write TOML.
_WORDS = {
    "array": "a list of numbers",
    "bool": "true or false",
    "float": "a number",
    "int": "a whole number",
    "object": "a table",
    "str": "a text in quotes",
}
_INDEX = re.compile(r"\[\d+\]")
_AT = re.compile(r" - at `\$\.?(?P<field>.*)`$")


class Key(NamedTuple):
    """A key that a file may have.

    Attributes:
        field: Dotted name.
        kind: Its type.
        required: Whether it must be there.
    """

    field: str
    kind: object
    required: bool


def read_strictly(
    path: Path,
    kind: type[T],
    aliases: Mapping[str, str] | None = None,
    unbounded: Collection[str] = (),
) -> T:
    """Read a TOML file.

    Args:
        path: The file.
        kind: What it may say.
        aliases: Second spellings of top-level keys, with the first.
        unbounded: Dotted names of the fields that may hold infinities.

    Raises:
        InvalidFile: With the field that is wrong, what was found and what was expected.
    """
    document = read_document(path)
    document = _under_first_names(document, aliases or {}, path)
    keys = {key.field: key for key in keys_of(kind)}
    _refuse_unknown(document, keys, aliases or {}, path)
    _refuse_missing(document, keys, path)
    _refuse_unbounded(document, unbounded, path)
    try:
        return msgspec.convert(document, kind, strict=True)
    except msgspec.ValidationError as error:
        raise _invalid(error, document, keys, path) from error


def read_document(path: Path) -> Table:
    """What a TOML file says.

    Raises:
        InvalidFile: It is missing, unreadable, too large or no TOML.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        found = (error.strerror or str(error)).lower()
        raise InvalidFile(path, "", found, "a TOML file that can be read") from error
    if len(content) > LARGEST_FILE:
        raise InvalidFile(path, "", f"{len(content)} bytes", f"at most {LARGEST_FILE}")
    try:
        return tomllib.loads(content.decode())
    except UnicodeDecodeError as error:
        raise InvalidFile(path, "", f"bytes that are no text ({error})", "UTF-8") from error
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        hint = 'a line is `key = value`, a text stands in "quotes", a list in [brackets]'
        raise InvalidFile(path, "", f"{error}", "TOML", hint) from error


def keys_of(kind: type[Struct], table: str = "") -> Iterator[Key]:
    """Every key that ``kind`` allows, those of its tables after the table's own."""
    for field in msgspec.structs.fields(kind):
        name = f"{table}{field.encode_name}"
        yield Key(name, field.type, field.required)
        inner = _table_type(field.type)
        if inner is not None:
            yield from keys_of(inner, f"{name}.")


def _table_type(kind: object) -> type[Struct] | None:
    structs = (p for p in _parts(kind) if isinstance(p, type) and issubclass(p, Struct))
    return next(structs, None)


def _parts(kind: object) -> Iterator[object]:
    """A type and what it is made of, descriptions before what they describe."""
    yield kind
    for part in reversed(get_args(kind)):
        yield from _parts(part)


def _under_first_names(document: Table, aliases: Mapping[str, str], path: Path) -> Table:
    for second, first in aliases.items():
        if second in document and first in document:
            raise InvalidFile(
                path, first, f"`{second}` beside it", f"one of `{second}` and `{first}`"
            )
    return {aliases.get(key, key): value for key, value in document.items()}


def _refuse_unknown(
    document: Table, keys: Mapping[str, Key], aliases: Mapping[str, str], path: Path
) -> None:
    for field in _fields_of(document, keys):
        plain = _without_indices(field)
        if plain not in keys:
            table, _, name = plain.rpartition(".")
            known = {key.rpartition(".")[2]: key for key in keys}
            here = [key.rpartition(".")[2] for key in keys if key.rpartition(".")[0] == table]
            meant = closest(name, here) or closest(name, [*known, *aliases])
            hint = f"did you mean `{known.get(meant, meant)}`?" if meant else ""
            raise InvalidFile(path, field, "an unknown key", f"one of {', '.join(here)}", hint)


def _fields_of(document: Table, keys: Mapping[str, Key], table: str = "") -> Iterator[str]:
    for name, value in document.items():
        field = f"{table}{name}"
        yield field
        key = keys.get(_without_indices(field))
        if key is not None and _table_type(key.kind):
            for inner, place in _tables_in(value, field):
                yield from _fields_of(inner, keys, f"{place}.")


def _tables_in(value: object, field: str) -> Iterator[tuple[Table, str]]:
    """The table, or the tables of the list, that stands at a field, with their places."""
    if isinstance(value, dict):
        yield value, field
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            if isinstance(inner, dict):
                yield inner, f"{field}[{i}]"


def _without_indices(field: str) -> str:
    return _INDEX.sub("", field)


def _refuse_missing(document: Table, keys: Mapping[str, Key], path: Path) -> None:
    for key in keys.values():
        table, _, name = key.field.rpartition(".")
        for inside, place in _tables_at(document, table):
            if key.required and name not in inside:
                field = f"{place}.{name}" if place else name
                raise InvalidFile(path, field, "nothing", _described(key.kind) or "a value")


def _tables_at(document: Table, table: str) -> Iterator[tuple[Table, str]]:
    """All tables of a dotted name without indices, with their places; the document for none."""
    if not table:
        yield document, ""
        return
    outer, _, name = table.rpartition(".")
    for inside, place in _tables_at(document, outer):
        yield from _tables_in(inside.get(name), f"{place}.{name}" if place else name)


def _refuse_unbounded(document: Table, unbounded: Collection[str], path: Path) -> None:
    for field, number in _numbers(document, ""):
        if math.isnan(number):
            raise InvalidFile(path, field, "nan", "a number")
        if math.isinf(number) and field.partition("[")[0] not in unbounded:
            raise InvalidFile(path, field, spell(number), "a finite number")


def _numbers(value: object, field: str) -> Iterator[tuple[str, float]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _numbers(inner, f"{field}.{key}" if field else key)
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _numbers(inner, f"{field}[{i}]")
    elif isinstance(value, float):
        yield field, value


def _invalid(
    error: msgspec.ValidationError, document: Table, keys: Mapping[str, Key], path: Path
) -> InvalidFile:
    """Msgspec's complaint in our words: its path gives the field, the file what stands there."""
    message = str(error)
    at = _AT.search(message)
    field = at["field"] if at else ""
    wanted = message[: at.start()] if at else message
    wanted = wanted.removeprefix("Expected ").partition(", got")[0]
    expected = re.sub(r"`([^`]*)`", lambda types: _translated(types[1]), wanted)
    described = _description(keys, field)
    return InvalidFile(path, field, spell(_at(document, field)), described or expected)


def _description(keys: Mapping[str, Key], field: str) -> str:
    """What a field's description says, or that of an element where the field is one; perhaps nothing."""
    key = keys.get(_without_indices(field))
    kind = None if key is None else key.kind
    for _ in _INDEX.findall(field.rpartition(".")[2]):
        kind = next((get_args(p)[0] for p in _parts(kind) if get_origin(p) is list), None)
    return _described(kind)


def _translated(types: str) -> str:
    names = [name for name in types.split(" | ") if name != "null"]
    return " or ".join(_WORDS.get(name, name) for name in names)


def _described(kind: object) -> str:
    descriptions = (part.description for part in _parts(kind) if isinstance(part, Meta))
    return next((text for text in descriptions if text), "")


def _at(document: Table, field: str) -> object:
    """What stands at a dotted name with indices."""
    value: object = document
    for step in re.findall(r"[^.\[\]]+", field):
        if isinstance(value, dict):
            value = value.get(step)
        elif isinstance(value, list):
            value = cast(list[object], value)[int(step)]
    return value
