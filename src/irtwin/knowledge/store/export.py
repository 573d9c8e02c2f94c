"""The whole graph as one OWL file: ontology, individuals and inferences, for Protégé and other OWL tools."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pyoxigraph import NamedNode, RdfFormat, Triple, serialize

from irtwin.knowledge.literals import to_milliseconds
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import (
    GRAPH_ACTIVITY,
    GRAPH_INFERRED,
    GRAPH_ONTOLOGY,
    GRAPH_SOURCE,
    ONTOLOGY,
    OWL,
    RDF,
)

_ONTOLOGY = NamedNode(ONTOLOGY)
_TYPE = NamedNode(RDF + "type")
_CLASS = NamedNode(OWL + "Class")
_INDIVIDUAL = NamedNode(OWL + "NamedIndividual")
_IMPORTS = NamedNode(OWL + "imports")


def export_owl(graph: KnowledgeGraph, path: Path) -> None:
    """Write RDF/XML; the file is there whole or not at all.

    The modules become one ontology that imports nothing, so that the file needs neither network nor catalogue.
    The SHACL report stays out: it speaks about the graph, not about robots. Times are cut to milliseconds.
    """
    triples = graph.triples(GRAPH_ONTOLOGY, GRAPH_SOURCE, GRAPH_ACTIVITY, GRAPH_INFERRED)
    modules = _of_type(triples, NamedNode(OWL + "Ontology")) - {_ONTOLOGY}
    kept = {
        to_milliseconds(triple) for triple in triples if triple.subject not in modules and triple.predicate != _IMPORTS
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    serialize(sorted(kept | _declarations(triples), key=str), str(part), RdfFormat.RDF_XML, prefixes=graph.prefixes)
    part.replace(path)


def _declarations(triples: Iterable[Triple]) -> set[Triple]:
    """Declare each individual of a class: owlready2 lists no others."""
    classes = _of_type(triples, _CLASS)
    return {
        Triple(triple.subject, _TYPE, _INDIVIDUAL)
        for triple in triples
        if triple.predicate == _TYPE and triple.object in classes and isinstance(triple.subject, NamedNode)
    }


def _of_type(triples: Iterable[Triple], kind: NamedNode) -> set[Any]:
    return {triple.subject for triple in triples if triple.predicate == _TYPE and triple.object == kind}
