"""The natural mapping of SQL values to literals (W3C R2RML, section 10).

SQLite gives a value's storage class only, so there the column's declared type decides; other databases'
drivers give values whose Python type tells.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from datetime import date, datetime, time
from decimal import Decimal
from typing import Any

import numpy as np
from pyoxigraph import NamedNode

from irtwin.knowledge.vocabulary import XSD

STRING, INTEGER, DECIMAL, DOUBLE = (NamedNode(XSD + name) for name in ("string", "integer", "decimal", "double"))
BOOLEAN, HEX_BINARY = NamedNode(XSD + "boolean"), NamedNode(XSD + "hexBinary")
DATE, TIME, DATE_TIME = (NamedNode(XSD + name) for name in ("date", "time", "dateTime"))

Lexical = tuple[str, NamedNode]
Natural = Callable[[Any], Lexical]

_DATE = r"-?\d{4,}-\d\d-\d\d"
_TIME = r"\d\d:\d\d:\d\d(?:\.\d+)?"
_ZONE = r"(?:Z|[+-]\d\d:\d\d)?"
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)"
_LEXICAL_SPACE = {
    INTEGER: re.compile(r"[+-]?\d+"),
    DECIMAL: re.compile(_NUMBER),
    DOUBLE: re.compile(rf"{_NUMBER}(?:[eE][+-]?\d+)?|[+-]?INF|NaN"),
    BOOLEAN: re.compile(r"true|false|0|1"),
    DATE: re.compile(_DATE + _ZONE),
    TIME: re.compile(_TIME + _ZONE),
    DATE_TIME: re.compile(f"{_DATE}T{_TIME}{_ZONE}"),
    HEX_BINARY: re.compile(r"(?:[0-9a-fA-F]{2})*"),
}
_FRACTION = re.compile(r"\.(\d*?)0*(?!\d)")


def is_lexical(lexical: str, datatype: NamedNode) -> bool:
    """Whether a string is in a datatype's lexical space; datatypes unknown here take any."""
    space = _LEXICAL_SPACE.get(datatype)
    return space is None or space.fullmatch(lexical) is not None


def by_value(value: Any) -> Lexical:
    """Return the lexical form and datatype of a value by its Python type."""
    convert = _BY_TYPE.get(type(value))
    return convert(value) if convert else (str(value), STRING)


def by_declared_type(declared: str) -> Natural:
    """Return the conversion for a column declared so; values of another kind are taken as they are."""
    match = re.fullmatch(r"\s*([a-z0-9 ]*?)\s*(?:\(\s*(\d+)[^)]*\))?\s*", declared.lower())
    if match is None:
        return by_value
    name, width = match[1], match[2]
    if name in ("char", "character", "nchar") and width:
        return _padded(int(width))
    return _BY_DECLARATION.get(name, by_value)


def _integer(value: Any) -> Lexical:
    return (str(value), INTEGER) if type(value) is int else by_value(value)


def _double(value: Any) -> Lexical:
    """Canonical: one digit, the point, at least one digit, the exponent."""
    if type(value) not in (float, int):
        return by_value(value)
    number = float(value)
    if not math.isfinite(number):
        return ("NaN" if math.isnan(number) else "INF" if number > 0 else "-INF"), DOUBLE
    return np.format_float_scientific(number, trim="0", exp_digits=1).replace("e+", "E").replace("e", "E"), DOUBLE


def _decimal(value: Any) -> Lexical:
    if type(value) not in (Decimal, int, float):
        return by_value(value)
    number = Decimal(repr(value)) if type(value) is float else Decimal(value)
    if not number.is_finite():
        return by_value(float(number))
    text = f"{number:f}"
    return (text.rstrip("0").rstrip(".") if "." in text else text), DECIMAL


def _boolean(value: Any) -> Lexical:
    return ("true" if value else "false", BOOLEAN) if value in (0, 1) else by_value(value)


def _temporal(datatype: NamedNode) -> Natural:
    def convert(value: Any) -> Lexical:
        text = value.isoformat() if isinstance(value, (date, time)) else str(value)
        if datatype is DATE_TIME:
            text = text.replace(" ", "T", 1)
        if "." in text:
            text = _FRACTION.sub(lambda match: f".{match[1]}" if match[1] else "", text)
        if text.endswith("+00:00"):
            text = text.removesuffix("+00:00") + "Z"
        return (text, datatype) if is_lexical(text, datatype) else (str(value), STRING)

    return convert


def _binary(value: Any) -> Lexical:
    return (bytes(value).hex().upper(), HEX_BINARY) if isinstance(value, (bytes, memoryview)) else by_value(value)


def _padded(width: int) -> Natural:
    """CHAR(n) holds n characters; SQLite does not pad it."""
    return lambda value: (value.ljust(width), STRING) if isinstance(value, str) else by_value(value)


def _json(value: Any) -> Lexical:
    return json.dumps(value, ensure_ascii=False), STRING


_BY_TYPE: dict[type, Natural] = {
    str: lambda value: (value, STRING),
    int: _integer,
    float: _double,
    bool: _boolean,
    Decimal: _decimal,
    date: _temporal(DATE),
    time: _temporal(TIME),
    datetime: _temporal(DATE_TIME),
    bytes: _binary,
    memoryview: _binary,
    dict: _json,
    list: _json,
}
_BY_DECLARATION: dict[str, Natural] = {
    **dict.fromkeys(["int", "integer", "smallint", "bigint", "tinyint", "mediumint", "int2", "int4", "int8"], _integer),
    **dict.fromkeys(("float", "real", "double", "double precision"), _double),
    **dict.fromkeys(("numeric", "decimal", "dec"), _decimal),
    **dict.fromkeys(("boolean", "bool"), _boolean),
    **dict.fromkeys(("timestamp", "datetime"), _temporal(DATE_TIME)),
    **dict.fromkeys(("binary", "varbinary", "blob"), _binary),
    "date": _temporal(DATE),
    "time": _temporal(TIME),
}
