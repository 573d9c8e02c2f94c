"""Terms made of rows (W3C R2RML, section 11.2)."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any
from urllib.parse import quote, unquote

from pyoxigraph import BlankNode, Literal, NamedNode

from irtwin.errors import InputError
from irtwin.knowledge.mapping.document import Template, TermMap, TermType
from irtwin.knowledge.mapping.identifiers import Identifier
from irtwin.knowledge.mapping.natural import STRING, Lexical, Natural, is_lexical

Term = NamedNode | BlankNode | Literal
Row = Sequence[Any]
TermMaker = Callable[[Row], Term | None]
_Text = Callable[[Row], Lexical | None]

# All that RFC 3987 does not leave unreserved.
_RESERVED = re.compile(
    "[^A-Za-z0-9._~\u00a0-\ud7ff\uf900-\ufdcf\ufdf0-\uffef"
    + "".join(f"{chr(plane << 16)}-{chr((plane << 16) + 0xFFFD)}" for plane in range(1, 14))
    + f"{chr(0xE1000)}-{chr(0xEFFFD)}-]"
)

_RELATIVE = re.compile("[^:/?#]+/")  # no scheme can come any more


RowColumn = tuple[int, Natural]  # where a row holds a column, and how its values read
Columns = Mapping[Identifier, RowColumn]


def term_maker(term_map: TermMap, columns: Columns, base_iri: str) -> TermMaker:
    """Return the function that makes the map's term of a row, None where a column is NULL.

    It raises InputError where a value does not fit: no valid IRI, outside the datatype's lexical space.
    """
    if term_map.constant is not None:
        constant = term_map.constant
        return lambda row: constant
    text, term = _text(term_map, columns, base_iri), _of_text(term_map, base_iri)

    def make(row: Row) -> Term | None:
        lexical = text(row)
        return None if lexical is None else term(*lexical)

    return make


def _text(term_map: TermMap, columns: Columns, base_iri: str) -> _Text:
    if term_map.column is None:
        return _template_text(term_map, columns, base_iri)
    index, natural = columns[term_map.column]

    def text(row: Row) -> Lexical | None:
        value = row[index]
        return None if value is None else natural(value)

    return text


def _template_text(term_map: TermMap, columns: Columns, base_iri: str) -> _Text:
    template = term_map.template if term_map.term_type is not TermType.IRI else absolute(term_map.template, base_iri)
    parts = [part if isinstance(part, str) else columns[part] for part in template]
    encoded = term_map.term_type is TermType.IRI

    def text(row: Row) -> Lexical | None:
        result = ""
        for part in parts:
            if isinstance(part, str):
                result += part
                continue
            index, natural = part
            value = row[index]
            if value is None:
                return None
            lexical = natural(value)[0]
            result += _RESERVED.sub(lambda match: quote(match[0], safe=""), lexical) if encoded else lexical
        return result, STRING

    return text


def absolute(template: Template, base_iri: str) -> Template:
    """Return a template of IRIs with the base before it, where it is relative whatever a row holds."""
    first = template[0] if template else ""
    return (base_iri + first, *template[1:]) if isinstance(first, str) and _RELATIVE.match(first) else template


def values_in(iri: str, template: Template, base_iri: str) -> dict[str, str] | None:
    """Return the values of the columns that a template makes an IRI of; None where it makes no such IRI."""
    parts = absolute(template, base_iri)
    form = "".join(re.escape(part) if isinstance(part, str) else "([^/]+)" for part in parts)
    fits = re.fullmatch(form, iri)
    names = [part.name for part in parts if isinstance(part, Identifier)]
    return None if fits is None else dict(zip(names, map(unquote, fits.groups()), strict=True))


def _of_text(term_map: TermMap, base_iri: str) -> Callable[[str, NamedNode], Term]:
    """Return the function that makes the map's term of a text and its natural datatype."""
    language, datatype = term_map.language, term_map.datatype

    def iri(text: str, _: NamedNode) -> NamedNode:
        try:
            return NamedNode(text)
        except ValueError:  # not absolute
            pass
        try:
            return NamedNode(base_iri + text)
        except ValueError:
            message = f"{term_map.where}: the value {text!r} makes no valid IRI; use a template, which encodes it"
            raise InputError(message) from None

    def typed(text: str, natural: NamedNode) -> Literal:
        assert datatype is not None
        if natural != datatype and not is_lexical(text, datatype):
            raise InputError(f"{term_map.where}: the value {text!r} is no {datatype.value}")
        return Literal(text, datatype=datatype)

    if term_map.term_type is TermType.IRI:
        return iri
    if term_map.term_type is TermType.BLANK_NODE:
        return lambda text, _: BlankNode(f"b{text.encode().hex()}")
    if language:
        return lambda text, _: Literal(text, language=language)
    return typed if datatype else lambda text, natural: Literal(text, datatype=natural)
