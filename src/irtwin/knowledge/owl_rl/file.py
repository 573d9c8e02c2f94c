"""What follows from a file, as a file."""

from __future__ import annotations

import io
from pathlib import Path

from pyoxigraph import RdfFormat, serialize

from irtwin.knowledge import engines
from irtwin.knowledge.engines import NATIVE
from irtwin.knowledge.store.rdf_input import format_of, read_triples
from irtwin.knowledge.vocabulary import PREFIXES
from irtwin.storage.files import check_place, write


def close_file(source: Path, out: Path, engine: str = NATIVE) -> int:
    """Write what a file says and all that an engine infers from it; return how many triples were inferred.

    The suffixes tell the formats. `owl:imports` are not followed. The file is there whole or not at all. Raises
    InputError on a file that cannot be read or is too much for the engine, Contradiction on one that contradicts
    itself.
    """
    form = format_of(out)
    check_place(out)
    given = dict.fromkeys(read_triples(source))
    engines.check(engine, len(given))
    inferred = sorted(engines.inferred(engine, given), key=str)
    prefixes = PREFIXES if form in (RdfFormat.TURTLE, RdfFormat.TRIG, RdfFormat.RDF_XML) else None
    content = io.BytesIO()
    serialize([*given, *inferred], content, form, prefixes=prefixes)
    write(out, content.getvalue())
    return len(inferred)
