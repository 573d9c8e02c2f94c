"""RDF files as somebody else wrote them: held to what parsers take in bounded time and memory.

Oxigraph's parsers open no other file and follow no address, but they expand XML entities without a bound, take the
square of the depth for nested XML, and overflow the stack on triples that are nested too deeply.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.parsers.expat import ErrorString, ExpatError, ParserCreate

from pyoxigraph import RdfFormat, Triple, parse

from irtwin.errors import InputError
from irtwin.input_file import read_input
from irtwin.knowledge.store.blank_nodes import named_by_content

_LARGEST = 1_000_000_000  # bytes
_LONGEST_ENTITY = 200  # characters; Protégé abbreviates IRIs by entities
_DEEPEST = 500  # XML elements, or triples in triples
_NESTED_TRIPLE = re.compile(rb"<<|>>")


def read_rdf(path: Path, form: RdfFormat) -> bytes:
    """Return an RDF file's content. Raises InputError where it cannot be read or would be too much for the parser."""
    content = read_input(path, _LARGEST)
    if form == RdfFormat.RDF_XML:
        _check_xml(path, content)
    else:
        _check_triples(path, content)
    return content


def read_turtle(file: Path) -> Iterator[Triple]:
    """Read a Turtle file; InputError names the file and the line where it is broken."""
    content = read_rdf(file, RdfFormat.TURTLE)
    with parsing(file):
        yield from named_by_content((quad.triple for quad in parse(content, format=RdfFormat.TURTLE)), content)


def read_triples(file: Path) -> Iterator[Triple]:
    """Read an RDF file, whose suffix tells the format; what is not absolute lies below its place.

    Raises InputError where no format has the suffix, and as `read_turtle`.
    """
    form = format_of(file)
    content = read_rdf(file, form)
    with parsing(file):
        yield from (quad.triple for quad in parse(content, format=form, base_iri=file.absolute().as_uri()))


def format_of(file: Path) -> RdfFormat:
    """Return the RDF format that a file's suffix tells. Raises InputError where none has it."""
    suffix = file.suffix.lower()
    form = RdfFormat.RDF_XML if suffix == ".owl" else RdfFormat.from_extension(suffix.removeprefix("."))
    if form is None:
        raise InputError(
            f"{file}: no RDF format has this suffix; use .ttl, .nt, .nq, .trig, .rdf, .owl, .n3 or .jsonld"
        )
    return form


@contextmanager
def parsing(path: Path) -> Iterator[None]:
    """Turn what a parser says of a file into an InputError."""
    try:
        yield
    except MemoryError:
        raise InputError(f"{path}: has a term of more than 16 MB; keep such content in a separate file") from None
    except SyntaxError as error:
        line = f", line {error.lineno}" if error.lineno else ""
        raise InputError(f"{path}{line}: {error.msg}") from error


def _check_triples(path: Path, content: bytes) -> None:
    depth = 0
    for bracket in _NESTED_TRIPLE.finditer(content):
        depth = depth + 1 if bracket[0] == b"<<" else max(0, depth - 1)
        if depth > _DEEPEST:
            raise InputError(f"{path}: triples are nested more than {_DEEPEST} deep")


def _check_xml(path: Path, content: bytes) -> None:
    """Walk through XML before Oxigraph does, which takes a file that was cut off for a whole one."""
    depth = 0

    def start(name: str, attributes: object) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise InputError(f"{path}: elements are nested more than {_DEEPEST} deep")

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    def entity(name: str, is_parameter: bool, value: str | None, *outside: str | None) -> None:
        if value is None or is_parameter or "&" in value or len(value) > _LONGEST_ENTITY:
            raise InputError(
                f"{path}: the XML entity {name!r} is long, made of others or outside; only abbreviations are allowed"
            )

    parser = ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler, parser.EntityDeclHandler = start, end, entity
    try:
        parser.Parse(content, True)
    except ExpatError as error:
        where = f"{path}, line {error.lineno}, column {error.offset + 1}"
        raise InputError(f"{where}: not well-formed XML ({ErrorString(error.code)})") from error
