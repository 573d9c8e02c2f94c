"""The OWL 2 RL closure of a file, as a file."""

from __future__ import annotations

import io
import re
from pathlib import Path

from pyoxigraph import RdfFormat, Triple, parse, serialize

from irtwin.errors import InputError
from irtwin.knowledge.owl_rl import Closure
from irtwin.knowledge.vocabulary import PREFIXES
from irtwin.storage.files import check_place, write

_ENTITY = re.compile(rb"""<!ENTITY\s+[^"'>]*(["'])(.*?)\1""", re.DOTALL)


def close_file(source: Path, out: Path) -> int:
    """Write what a file says and all that OWL 2 RL infers from it; return how many triples were inferred.

    The suffixes tell the formats. `owl:imports` are not followed. The file is there whole or not at all. Raises
    InputError on a file that cannot be read, Contradiction on one that contradicts itself.
    """
    form = _format(out)
    check_place(out)
    given = dict.fromkeys(_read(source))
    inferred = sorted(Closure(given).inferred(), key=str)
    prefixes = PREFIXES if form in (RdfFormat.TURTLE, RdfFormat.TRIG, RdfFormat.RDF_XML) else None
    content = io.BytesIO()
    serialize([*given, *inferred], content, form, prefixes=prefixes)
    write(out, content.getvalue())
    return len(inferred)


def _read(source: Path) -> list[Triple]:
    form = _format(source)
    try:
        content = source.read_bytes()
        if form == RdfFormat.RDF_XML:
            _refuse_entity_bomb(source, content)
        return [quad.triple for quad in parse(content, format=form, base_iri=source.absolute().as_uri())]
    except OSError as error:
        raise InputError(f"{source}: cannot be read ({error.strerror})") from error
    except SyntaxError as error:
        raise InputError(f"{source}, line {error.lineno}: {error.msg}") from error


def _refuse_entity_bomb(source: Path, content: bytes) -> None:
    """Allow entities that abbreviate namespaces, as Protégé writes them; no long ones, and none made of others."""
    for _, entity in _ENTITY.findall(content):
        if b"&" in entity or len(entity) > 1_000:
            raise InputError(
                f"{source}: an XML entity is long or made of others; only abbreviations of IRIs are allowed"
            )


def _format(path: Path) -> RdfFormat:
    form = RdfFormat.RDF_XML if path.suffix == ".owl" else RdfFormat.from_extension(path.suffix.removeprefix("."))
    if form is None:
        raise InputError(
            f"{path}: no RDF format has this suffix; use .ttl, .nt, .nq, .trig, .rdf, .owl, .n3 or .jsonld"
        )
    return form
