"""Whether a SPARQL text holds a clause that reads from elsewhere: told by the parser that will run it.

A keyword is told from the same word in a string, IRI, comment or name by one changed letter: `SERVICE` as a clause
is a syntax error when it is spelt `SERAICE`, and anywhere else it is as good a word as before. So no lexer of ours
has to agree with Oxigraph's; see `docs/decisions/security.md`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from contextlib import suppress
from string import ascii_lowercase

from pyoxigraph import Store

from irtwin.errors import InputError
from irtwin.knowledge.store.sparql_text import after_prologue
from irtwin.knowledge.vocabulary import PREFIXES

Parse = Callable[[str, str | None], None]

_CODE_POINT = re.compile(r"\\u([0-9A-Fa-f]{4})|\\U([0-9A-Fa-f]{8})")
_ABSENT = "CLEAR GRAPH <urn:x-irtwin:absent> ;"  # fails on an empty store before anything after it is done


def refuse_service(
    text: str, base: str | None, code_points_first: bool = False, services: Collection[str] = ()
) -> None:
    """Raise InputError where a query asks another server than `services`, or may.

    One of those is written as it stands there, `SERVICE <IRI>`: by no prefix, variable or escape.
    `code_points_first` is for servers, which may take `\\u0053` for a letter anywhere. Oxigraph does so in strings and
    IRIs alone.
    """
    for service in services:
        text = _as_graph(text, service)
    why = "SERVICE asks another server, which is not allowed here: ask this graph alone (where SERVICE is no clause"
    _refuse(text, ("service",), parse_query, base, code_points_first, why)


def refuse_service_and_load(text: str, base: str | None, code_points_first: bool = False) -> None:
    """Raise InputError where an update reads from elsewhere, or may; otherwise as `refuse_service`."""
    why = "LOAD and SERVICE read from elsewhere, which is not allowed here: use INSERT DATA (where they are no clauses"
    _refuse(text, ("service", "load"), parse_update, base, code_points_first, why)


def _refuse(
    text: str, words: tuple[str, ...], parse: Parse, base: str | None, code_points_first: bool, why: str
) -> None:
    for form in [text, _CODE_POINT.sub(_character, text)] if code_points_first else [text]:
        fault = fault_without(form, words, parse, base)
        if fault is not None:
            raise InputError(f"{why}, the rest is no SPARQL: {fault})")


def fault_without(text: str, words: tuple[str, ...], parse: Parse, base: str | None) -> str | None:
    """Return why a text is no SPARQL once none of some words can be a keyword; None where it is, or has none of them.

    A text that is SPARQL before and is not after holds one of the words as a keyword.
    """
    changed = text
    for word in words:
        spelt = _misspelt(changed, word)
        if spelt is None:
            return f"{word!r} is there in too many spellings"
        changed = spelt
    if changed == text:
        return None
    try:
        parse(changed, base)
    except SyntaxError as error:
        return str(error)
    return None


def parse_query(text: str, base: str | None) -> None:
    """Raise SyntaxError where a text is no query. An ASK is answered on an empty store, nothing else is."""
    with suppress(RuntimeError):  # it is one, with a function that Oxigraph has not
        Store().query(text, base_iri=base, prefixes=PREFIXES)


def parse_update(text: str, base: str | None) -> None:
    """Raise SyntaxError where a text is no update. Nothing of it is done."""
    start = after_prologue(text)
    with suppress(RuntimeError):
        Store().update(f"{text[:start]}{_ABSENT}{text[start:]}", base_iri=base, prefixes=PREFIXES)


def is_update(text: str, base: str | None) -> bool:
    """Whether a text is an update. Nothing of it is done."""
    try:
        parse_update(text, base)
    except SyntaxError:
        return False
    return True


def _as_graph(text: str, service: str) -> str:
    """Return the text with GRAPH for SERVICE before an IRI: it may stand wherever that may, and asks nobody."""
    clause = rf"(?i:service)(?:[ \t\r\n]+(?i:silent))?(?=[ \t\r\n]*<{re.escape(service)}>)"
    return re.sub(clause, "GRAPH", text, flags=re.ASCII)


def _misspelt(text: str, word: str) -> str | None:
    """Return the text with one letter of the word changed, to a spelling that is not there yet; None if all are.

    Letters at other places stay, and so does the text's length.
    """
    there = text.lower()
    if word not in there:
        return text
    start, end = word[: len(word) // 2], word[len(word) // 2 + 1 :]
    letter = next((letter for letter in ascii_lowercase if start + letter + end not in there), None)
    if letter is None:
        return None
    written = f"({start}){word[len(start)]}({end})"
    return re.sub(written, rf"\g<1>{letter}\g<2>", text, flags=re.IGNORECASE | re.ASCII)


def _character(escape: re.Match[str]) -> str:
    number = int(escape[1] or escape[2], 16)
    return chr(number) if number <= 0x10FFFF and not 0xD800 <= number <= 0xDFFF else escape[0]
