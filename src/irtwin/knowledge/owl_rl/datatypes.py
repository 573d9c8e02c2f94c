"""The datatypes of OWL 2 RL: which value a literal has, and which datatypes contain that value.

Values are told apart as OWL 2 does, by identity: 1 and 1.0 are one decimal, 1 and 1e0 are two values, and so are
the same instant told in two time zones (W3C OWL 2 Structural Specification, section 4).
"""

from __future__ import annotations

import base64
import re
import struct
from collections.abc import Callable, Hashable, Iterator
from datetime import datetime, timedelta
from decimal import Decimal
from xml.etree.ElementTree import ParseError, canonicalize

from irtwin.knowledge.vocabulary import RDF, RDFS, XSD

Value = tuple[str, Hashable]  # the value space, and the value in it
Reader = Callable[[str], Value]  # ValueError, OverflowError or ParseError for a text that is not of the datatype

_INTEGER = re.compile(r"[+-]?[0-9]+")
_DECIMAL = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)")
_FLOAT = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?INF|NaN")
_TIME = re.compile(
    r"(-?[0-9]{4,})-([0-9]{2})-([0-9]{2})T([0-9]{2}):([0-9]{2}):([0-9]{2}(?:\.[0-9]+)?)(Z|[+-][0-9]{2}:[0-9]{2})?"
)
_URI = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*:|(?![^/?#]*:))[^\s<>\"{}|\\^`]*")
_LANGUAGE = re.compile(r"[a-zA-Z]{1,8}(?:-[a-zA-Z0-9]{1,8})*")
_TOKEN = re.compile(r"([^\t\n\r ]+( [^\t\n\r ]+)*)?")
_PLAIN = re.compile(rf"(.*)@((?:{_LANGUAGE.pattern})?)", re.DOTALL)
_BOOLEAN = re.compile(r"true|false|1|0")
_HEXADECIMAL = re.compile(r"([0-9a-fA-F]{2})*")

_WHOLE: dict[str, tuple[int | None, int | None]] = {
    "integer": (None, None),
    "nonNegativeInteger": (0, None),
    "positiveInteger": (1, None),
    "nonPositiveInteger": (None, 0),
    "negativeInteger": (None, -1),
    "long": (-(2**63), 2**63 - 1),
    "int": (-(2**31), 2**31 - 1),
    "short": (-(2**15), 2**15 - 1),
    "byte": (-(2**7), 2**7 - 1),
    "unsignedLong": (0, 2**64 - 1),
    "unsignedInt": (0, 2**32 - 1),
    "unsignedShort": (0, 2**16 - 1),
    "unsignedByte": (0, 2**8 - 1),
}
_TEXTS = {
    "string": re.compile(r".*", re.DOTALL),
    "normalizedString": re.compile(r"[^\t\n\r]*"),
    "token": _TOKEN,
    "language": _LANGUAGE,
    "Name": re.compile(r"(:|[^\W\d])[\w.\-:\u00b7]*"),  # letters and digits of any script
    "NCName": re.compile(r"[^\W\d][\w.\-\u00b7]*"),
    "NMTOKEN": re.compile(r"[\w.\-:\u00b7]+"),
}


class IllTyped(ValueError):
    """The text of a literal is not in the lexical space of its datatype."""


def value(text: str, datatype: str, language: str | None = None) -> Value | None:
    """Return the value that a literal denotes, None where OWL 2 RL does not know its datatype.

    Raises IllTyped where the datatype is known and does not allow the text.
    """
    if language is not None:
        return ("text", (text, language.lower()))
    read = _READERS.get(datatype)
    try:
        return None if read is None else read(text)
    except (ValueError, OverflowError, ParseError) as error:
        raise IllTyped(f"{text} is no {datatype}: {error}") from error


def datatypes_of(known: Value) -> frozenset[str]:
    """Return the IRIs of all datatypes that contain a value."""
    return frozenset(_datatypes_of(*known))


_OTHERS = (RDF + "langString", RDFS + "Literal")


def is_datatype(iri: str) -> bool:
    """Tell whether an IRI is a datatype whose values are known here."""
    return iri in _READERS or iri in _OTHERS


def _datatypes_of(space: str, content: Hashable) -> Iterator[str]:
    yield RDFS + "Literal"
    if isinstance(content, Decimal):
        yield XSD + "decimal"
        if content == content.to_integral_value():
            yield from (XSD + name for name, bounds in _WHOLE.items() if _within(content, *bounds))
    elif space == "text" and isinstance(content, tuple):
        text, language = content
        yield RDF + "PlainLiteral"
        if language is not None:
            yield RDF + "langString"
        else:
            yield from (XSD + name for name, form in _TEXTS.items() if form.fullmatch(text))
    elif space == "time" and isinstance(content, tuple):
        yield XSD + "dateTime"
        if content[1] is not None:
            yield XSD + "dateTimeStamp"
    else:
        yield space


def _within(number: Decimal, lowest: int | None, highest: int | None) -> bool:
    return (lowest is None or lowest <= number) and (highest is None or number <= highest)


def _read_whole(lowest: int | None, highest: int | None) -> Reader:
    def read(text: str) -> Value:
        number = Decimal(_demand(_INTEGER, text)[0])
        if not _within(number, lowest, highest):
            raise ValueError("out of range")
        return _decimal(number)

    return read


def _decimal(number: Decimal) -> Value:
    return ("decimal", number + 0 if number == 0 else number)


def _read_binary_fraction(space: str, form: str) -> Reader:
    def read(text: str) -> Value:
        number = float(_demand(_FLOAT, text)[0])
        bits = struct.pack(form, number)
        held = struct.unpack(form, bits)[0]
        if (held == 0 and re.match(r"[^eE]*[1-9]", text)) or (abs(held) == float("inf") and "INF" not in text):
            raise ValueError("out of range")
        return (space, bits)

    return read


def _read_as(form: re.Pattern[str], space: str, content: Callable[[str], Hashable] = str) -> Reader:
    """Return a reader of texts of a form; `content` makes the value within its space."""
    return lambda text: (space, content(_demand(form, text)[0]))


def _read_plain(text: str) -> Value:
    content, language = _demand(_PLAIN, text).groups()
    return ("text", (content, language.lower() or None))


def _read_time(*, zoned: bool) -> Reader:
    def read(text: str) -> Value:
        year, month, day, hour, minute, second, zone = _demand(_TIME, text).groups()
        if zoned and zone is None:
            raise ValueError("no time zone")
        return ("time", (_instant(year, month, day, hour, minute, second), _offset(zone)))

    return read


def _instant(year: str, month: str, day: str, hour: str, minute: str, second: str) -> Hashable:
    """Return a time on the calendar; years that Python's calendar lacks are moved by whole cycles of 400."""
    midnight = hour == "24" and minute == "00" and not second.strip("0.")
    cycles, in_cycle = divmod(int(year), 400)
    moment = datetime(in_cycle + 400, int(month), int(day), 0 if midnight else int(hour), int(minute))
    if Decimal(second) >= 60:
        raise ValueError("a minute has 60 seconds")
    return (cycles, moment + timedelta(days=midnight), Decimal(second))


def _offset(zone: str | None) -> int | None:
    if zone is None or zone == "Z":
        return None if zone is None else 0
    minutes = int(zone[1:3]) * 60 + int(zone[4:6])
    if minutes > 14 * 60 or int(zone[4:6]) > 59:
        raise ValueError("no such time zone")
    return -minutes if zone[0] == "-" else minutes


def _demand(form: re.Pattern[str], text: str) -> re.Match[str]:
    match = form.fullmatch(text)
    if match is None:
        raise ValueError("not in the form of its datatype")
    return match


_READERS: dict[str, Reader] = {
    **{XSD + name: _read_whole(*bounds) for name, bounds in _WHOLE.items()},
    **{XSD + name: _read_as(form, "text", lambda text: (text, None)) for name, form in _TEXTS.items()},
    XSD + "decimal": lambda text: _decimal(Decimal(_demand(_DECIMAL, text)[0])),
    XSD + "double": _read_binary_fraction(XSD + "double", "<d"),
    XSD + "float": _read_binary_fraction(XSD + "float", "<f"),
    XSD + "boolean": _read_as(_BOOLEAN, XSD + "boolean", lambda text: text in ("true", "1")),
    XSD + "anyURI": _read_as(_URI, XSD + "anyURI"),
    XSD + "hexBinary": _read_as(_HEXADECIMAL, XSD + "hexBinary", bytes.fromhex),
    XSD + "base64Binary": lambda text: (XSD + "base64Binary", base64.b64decode(text.replace(" ", ""), validate=True)),
    XSD + "dateTime": _read_time(zoned=False),
    XSD + "dateTimeStamp": _read_time(zoned=True),
    RDF + "PlainLiteral": _read_plain,
    RDF + "XMLLiteral": lambda text: (RDF + "XMLLiteral", canonicalize(f"<x>{text}</x>")),
}
