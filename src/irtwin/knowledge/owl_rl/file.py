"""What follows from a file, as a file."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path

from pyoxigraph import RdfFormat, Triple, parse, serialize

from irtwin.errors import InputError
from irtwin.knowledge.owl_rl.closure import Closure
from irtwin.knowledge.store.rdf_input import read_rdf, refuse
from irtwin.knowledge.vocabulary import PREFIXES
from irtwin.storage.files import check_place, write


def close_file(source: Path, out: Path, *, dl: bool = False) -> int:
    """Write what a file says and all that OWL 2 RL infers from it; return how many triples were inferred.

    With `dl`, what HermiT infers in OWL 2 DL: the nearest classes of classes and individuals. The suffixes tell the
    formats. `owl:imports` are not followed. The file is there whole or not at all. Raises InputError on a file that
    cannot be read, Contradiction on one that contradicts itself.
    """
    form = _format(out)
    check_place(out)
    given = dict.fromkeys(_read(source))
    inferred = sorted(_classified(given) if dl else Closure(given).inferred(), key=str)
    prefixes = PREFIXES if form in (RdfFormat.TURTLE, RdfFormat.TRIG, RdfFormat.RDF_XML) else None
    content = io.BytesIO()
    serialize([*given, *inferred], content, form, prefixes=prefixes)
    write(out, content.getvalue())
    return len(inferred)


def _classified(given: Iterable[Triple]) -> set[Triple]:
    from irtwin.knowledge import owl_dl  # starts Java: only where it is needed

    return owl_dl.classify(given) - set(given)


def _read(source: Path) -> list[Triple]:
    form = _format(source)
    content = read_rdf(source, form)
    try:
        return [quad.triple for quad in parse(content, format=form, base_iri=source.absolute().as_uri())]
    except (SyntaxError, MemoryError) as error:
        refuse(source, error)


def _format(path: Path) -> RdfFormat:
    form = RdfFormat.RDF_XML if path.suffix == ".owl" else RdfFormat.from_extension(path.suffix.removeprefix("."))
    if form is None:
        raise InputError(
            f"{path}: no RDF format has this suffix; use .ttl, .nt, .nq, .trig, .rdf, .owl, .n3 or .jsonld"
        )
    return form
