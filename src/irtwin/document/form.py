"""Frozen dataclasses as JSON: written, read, and described by a JSON Schema.

A field without default is always written, as null where it is None. One with the default None is left out where it, or
the field that it `goes_with`, is None. What a value may be is an annotation: `Annotated[float, Between(0, 1)]`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from functools import cache
from math import isfinite
from sys import float_info
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

from irtwin.errors import InputError

Json = dict[str, Any]
Part = TypeVar("Part")

_GOES_WITH = "goes_with"
_MEND = "write the diagnosis again with `irtwin diagnose`"
_TYPES = {str: "string", float: "number", bool: "boolean"}


class _Wrong(Exception):
    """A value is not what it must be."""


@dataclass(frozen=True)
class Between:
    """A number of a range, ends included."""

    low: float
    high: float

    def schema(self, base: Json) -> Json:
        """Return the schema of such a number; `base`: that of any."""
        return base | {"minimum": self.low, "maximum": self.high}

    def check(self, value: float, where: str) -> None:
        """Raise where the value is outside."""
        _check(self.low <= value <= self.high, where, f"from {self.low} to {self.high}")


@dataclass(frozen=True, init=False)
class OneOf:
    """One of some texts."""

    values: tuple[str, ...]

    def __init__(self, *values: str) -> None:
        object.__setattr__(self, "values", values)

    def schema(self, base: Json) -> Json:
        """Return the schema of such a text, which says more than that of any, `base`."""
        return {"enum": list(self.values)}

    def check(self, value: str, where: str) -> None:
        """Raise where the value is another."""
        _check(value in self.values, where, f"one of {', '.join(self.values)}")


def goes_with(other: str) -> dict[str, str]:
    """Return the metadata of a field that is left out where another one is None."""
    return {_GOES_WITH: other}


def to_json(value: Any) -> Any:
    """Return a part, or what it is made of, as JSON, which has no number that is not finite: null."""
    if is_dataclass(value):
        return {field.name: to_json(getattr(value, field.name)) for field in fields(value) if _written(value, field)}
    if isinstance(value, Mapping):
        return {key: to_json(item) for key, item in value.items()}
    if isinstance(value, float):
        return value if isfinite(value) else None
    return [to_json(item) for item in value] if isinstance(value, tuple | list) else value


def from_json(kind: type[Part], given: object, where: str, mend: str = _MEND) -> Part:
    """Return the part that JSON says; keys beside its own are passed over.

    `where`: what an error calls it, `mend`: what it says to do. Raises InputError where a key is missing, or a value is
    of another type.
    """
    try:
        read: Part = _read(kind, given, where)
    except _Wrong as error:
        raise InputError(f"{error}; {mend}") from error
    return read


def schema(kind: Any) -> Json:
    """Return the JSON Schema of a part, or of what it is made of."""
    if get_origin(kind) is Annotated:
        base, *notes = get_args(kind)
        allowed = schema(base)
        for limit in _limits(notes):
            allowed = limit.schema(allowed)
        return allowed
    if get_origin(kind) in (UnionType, Union):
        return _or_null(schema(_known(kind)))
    if is_dataclass(kind):
        return {
            "type": "object",
            "required": [field.name for field in fields(kind) if _always(field)],
            "properties": {field.name: schema(_where_written(kind, field)) for field in fields(kind)},
        }
    if get_origin(kind) is Mapping:
        return {"type": "object", "additionalProperties": schema(get_args(kind)[1])}
    if get_origin(kind) is tuple:
        inner, *others = get_args(kind)
        length = {} if others == [...] else {"minItems": len(others) + 1, "maxItems": len(others) + 1}
        return {"type": "array", "items": schema(inner)} | length
    return {"type": _TYPES[kind]}


def _limits(notes: Iterable[Any]) -> Iterator[Any]:
    """Yield those of a type's annotations that say what a value may be."""
    return (note for note in notes if isinstance(note, Between | OneOf))


def _written(part: Any, field: Field[Any]) -> bool:
    return _always(field) or getattr(part, field.metadata.get(_GOES_WITH, field.name)) is not None


def _always(field: Field[Any]) -> bool:
    return field.default is MISSING


def _where_written(kind: Any, field: Field[Any]) -> Any:
    """Return the type of a field where it is written: one that is left out where it is None is never null."""
    hint = _hints(kind)[field.name]
    return hint if _always(field) or _GOES_WITH in field.metadata else _known(hint)


def _or_null(of: Json) -> Json:
    if "enum" in of:
        return of | {"enum": [*of["enum"], None]}
    return of | {"type": [of["type"], "null"]}


def _known(kind: Any) -> Any:
    """Return the type that a value has where it is not None."""
    (inner,) = [argument for argument in get_args(kind) if argument is not NoneType]
    return inner


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


def _read(kind: Any, given: Any, where: str) -> Any:
    if get_origin(kind) is Annotated:
        base, *notes = get_args(kind)
        value = _read(base, given, where)
        for limit in _limits(notes):
            limit.check(value, where)
        return value
    if get_origin(kind) in (UnionType, Union):
        return None if given is None else _read(_known(kind), given, where)
    if is_dataclass(kind):
        return _read_part(kind, given, where)
    if get_origin(kind) is Mapping:
        _check(isinstance(given, dict), where, "an object")
        return {key: _read(get_args(kind)[1], item, f"{where}.{key}") for key, item in given.items()}
    if get_origin(kind) is tuple:
        inner, *others = get_args(kind)
        _check(isinstance(given, list), where, "an array")
        _check(others == [...] or len(given) == len(others) + 1, where, f"an array of {len(others) + 1}")
        return tuple(_read(inner, item, f"{where}[{place}]") for place, item in enumerate(given))
    if kind is float:
        _check(type(given) in (int, float) and abs(given) <= float_info.max, where, "a finite number")
        return float(given)
    _check(type(given) is kind, where, f"a {_TYPES[kind]}")
    return given


def _read_part(kind: Any, given: Any, where: str) -> Any:
    _check(isinstance(given, dict), where, "an object")
    hints, values = _hints(kind), {}
    for field in fields(kind):
        if field.name in given:
            values[field.name] = _read(hints[field.name], given[field.name], f"{where}.{field.name}")
        else:
            _check(not _always(field), f"{where}.{field.name}", "given")
    return kind(**values)


def _check(holds: bool, where: str, needed: str) -> None:
    if not holds:
        raise _Wrong(f"{where} must be {needed}")
