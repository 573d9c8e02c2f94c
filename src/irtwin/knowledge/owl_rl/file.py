"""What follows from a file, as a file."""

from __future__ import annotations

import io
from pathlib import Path

from pyoxigraph import RdfFormat, Triple, parse, serialize

from irtwin.errors import InputError
from irtwin.knowledge import engines
from irtwin.knowledge.engines import NATIVE
from irtwin.knowledge.store.rdf_input import parsing, read_rdf
from irtwin.knowledge.vocabulary import PREFIXES
from irtwin.storage.files import check_place, write


def close_file(source: Path, out: Path, engine: str = NATIVE) -> int:
    """Write what a file says and all that an engine infers from it; return how many triples were inferred.

    The suffixes tell the formats. `owl:imports` are not followed. The file is there whole or not at all. Raises
    InputError on a file that cannot be read or is too much for the engine, Contradiction on one that contradicts
    itself.
    """
    form = _format(out)
    check_place(out)
    given = dict.fromkeys(_read(source))
    engines.check(engine, len(given))
    inferred = sorted(engines.inferred(engine, given), key=str)
    prefixes = PREFIXES if form in (RdfFormat.TURTLE, RdfFormat.TRIG, RdfFormat.RDF_XML) else None
    content = io.BytesIO()
    serialize([*given, *inferred], content, form, prefixes=prefixes)
    write(out, content.getvalue())
    return len(inferred)


def _read(source: Path) -> list[Triple]:
    form = _format(source)
    content = read_rdf(source, form)
    with parsing(source):
        return [quad.triple for quad in parse(content, format=form, base_iri=source.absolute().as_uri())]


def _format(path: Path) -> RdfFormat:
    form = RdfFormat.RDF_XML if path.suffix == ".owl" else RdfFormat.from_extension(path.suffix.removeprefix("."))
    if form is None:
        raise InputError(
            f"{path}: no RDF format has this suffix; use .ttl, .nt, .nq, .trig, .rdf, .owl, .n3 or .jsonld"
        )
    return form
