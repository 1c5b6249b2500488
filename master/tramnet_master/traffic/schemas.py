"""JSON Schemas of recorded messages, in the part of the language that viewers of MCAP files read.

Foxglove takes objects with named properties, numbers, strings, booleans and arrays of these, all written out in
place; no references, no pairs, nothing that may be one of two types. So identities and links are objects, what is
None is left out, and maps with keys of their own are objects about whose properties nothing is said.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

from msgspec import Struct, inspect

from tramnet_protocol.arrays import Array
from tramnet_protocol.codec import MESSAGES

Schema: TypeAlias = dict[str, Any]

_INTEGER: Schema = {"type": "integer"}
_STRING: Schema = {"type": "string"}
_OPEN: Schema = {"type": "object", "properties": {}}
_HEADER: Mapping[str, Schema] = {
    "key": _STRING, "bytes": _INTEGER, "tag": _STRING, "from": _INTEGER, "to": _INTEGER,
    "from_incarnation": _INTEGER, "to_incarnation": _INTEGER, "run": _INTEGER, "epoch": _INTEGER,
    "sequence": _INTEGER,
}  # fmt: skip
_ARRAY: Schema = {
    "type": "object",
    "properties": {
        "dtype": _STRING,
        "shape": {"type": "array", "items": _INTEGER},
        "minimum": {"type": "number", "description": "of the finite elements"},
        "maximum": {"type": "number", "description": "of the finite elements"},
        "data": {
            "type": "string",
            "contentEncoding": "base64",
            "description": "elements, little-endian, in C order",
        },
    },
    "required": ["dtype", "shape"],
}
_LINK = {"type": "object", "properties": {"from": _INTEGER, "to": _INTEGER}}

MALFORMED: Schema = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    "title": "tramnet.malformed",
    "description": "Bytes that are no frame.",
    "type": "object",
    "properties": {"key": _STRING, "bytes": _INTEGER, "malformed": _STRING, "head": _STRING},
    "required": ["key", "bytes", "malformed", "head"],
}


def schema_of(tag: str) -> Schema:
    """Return the schema of recorded frames with messages of one kind."""
    kind = MESSAGES[tag]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"tramnet.{tag}",
        "description": (kind.__doc__ or "").partition("\n")[0],
        "type": "object",
        "properties": {**_HEADER, "message": _struct(kind)},
        "required": [*_HEADER, "message"],
    }


def _struct(kind: type[Struct]) -> Schema:
    if kind is Array:
        return _ARRAY
    found = inspect.type_info(kind)
    assert isinstance(found, inspect.StructType), "messages are structs"
    return {
        "type": "object",
        "properties": {field.name: _type(field.type) for field in found.fields},
        "required": [field.name for field in found.fields if field.required],
    }


def _type(kind: inspect.Type) -> Schema:
    match kind:
        case inspect.StructType(cls):
            return _struct(cls)
        case inspect.VarTupleType(item) | inspect.ListType(item):
            return {"type": "array", "items": _type(item)}
        case inspect.TupleType():
            return _LINK  # the only pairs in a message are the edges of a wiring
        case inspect.UnionType(types):
            (only,) = (option for option in types if not isinstance(option, inspect.NoneType))
            return _type(only)
        case inspect.LiteralType(values):
            return _INTEGER if all(isinstance(value, int) for value in values) else _STRING
    return _OTHERS[type(kind)]


_OTHERS: Mapping[type[inspect.Type], Schema] = {
    inspect.DictType: _OPEN,
    inspect.CustomType: _OPEN,
    inspect.IntType: _INTEGER,
    inspect.FloatType: {"type": "number"},
    inspect.StrType: _STRING,
    inspect.EnumType: _STRING,
    inspect.BoolType: {"type": "boolean"},
}
