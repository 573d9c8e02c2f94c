"""Which triples map of which R2RML mapping says a triple, and from which table."""

from __future__ import annotations

import re
from functools import lru_cache

from pyoxigraph import NamedNode, Triple

from irtwin.knowledge.mapping.document import LogicalTable, TermMap, TriplesMap
from irtwin.knowledge.mapping.reader import read_document
from irtwin.knowledge.mapping.terms import values_in
from irtwin.knowledge.vocabulary import TYPE
from irtwin.resources import Files


def says(triple: Triple, files: Files, base: str) -> str | None:
    """Return, in words, the first triples map of the mappings that may have made a triple of a graph with a base.

    None where no mapping makes such a triple.
    """
    for where, triples_map in maps_of(files):
        if _says(triples_map, triple, base):
            return f"mapping {where}, {_table(triples_map.table)}"
    return None


@lru_cache(maxsize=16)
def maps_of(files: Files) -> tuple[tuple[str, TriplesMap], ...]:
    """Return the triples maps of mappings, each with its name beside that of its file."""
    return tuple(
        (f"{file} #{re.split('[#/]', getattr(node, 'value', ''))[-1]}", triples_map)
        for file in files
        for node, triples_map in read_document(file.path).triples_maps.items()
    )


def _says(triples_map: TriplesMap, triple: Triple, base: str) -> bool:
    if not _fits(triples_map.subject, triple.subject, base):
        return False
    if triple.predicate == TYPE and triple.object in triples_map.classes:
        return True
    return any(_fits(each, triple.predicate, base) for pair in triples_map.properties for each in pair.predicates)


def _fits(term_map: TermMap, name: object, base: str) -> bool:
    if term_map.constant is not None:
        return name == term_map.constant
    return isinstance(name, NamedNode) and values_in(name.value, term_map.template, base) is not None


def _table(table: LogicalTable) -> str:
    if table.query is not None:
        return f"from {' '.join(table.query.split())}"
    return f"from table {'.'.join(part.name for part in table.table)}"
