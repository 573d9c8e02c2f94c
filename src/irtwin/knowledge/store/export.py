"""The whole graph as one OWL file: ontology, individuals, conclusions and rules, for Protégé and other OWL tools."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from pyoxigraph import Literal, NamedNode, RdfFormat, Triple, serialize

from irtwin.knowledge.literals import to_milliseconds
from irtwin.knowledge.rules.as_swrl import as_swrl
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.rules.rule import Rule
from irtwin.knowledge.rules.value_rules import values_as_rules
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import (
    GRAPH_ACTIVITY,
    GRAPH_ASSERTED,
    GRAPH_INFERRED,
    GRAPH_ONTOLOGY,
    GRAPH_SOURCE,
    ONTOLOGY,
    OWL,
    RDFS,
    TYPE,
)
from irtwin.storage import files

_ONTOLOGY = NamedNode(ONTOLOGY)
_LABEL = NamedNode(RDFS + "label")
_COMMENT = NamedNode(RDFS + "comment")
_CLASS = NamedNode(OWL + "Class")
_INDIVIDUAL = NamedNode(OWL + "NamedIndividual")
_IMPORTS = NamedNode(OWL + "imports")


def export_owl(graph: KnowledgeGraph, path: Path) -> None:
    """Write RDF/XML; the file is there whole or not at all.

    The modules become one ontology that imports nothing, so that the file needs neither network nor catalogue. Rules
    stand in it in SWRL; of a rule that SWRL cannot say, a comment of the ontology tells why, and what it concluded
    stands there. Each individual has a label. The SHACL report stays out: it speaks about the graph, not about robots.
    Times are cut to milliseconds. What was edited in it can be taken back: see `asserted.edited`.
    """
    kept = exported(graph)
    with files.temporary_beside(path.parent) as temporary:
        serialize(sorted(kept, key=str), str(temporary), RdfFormat.RDF_XML, prefixes=graph.prefixes)
        files.put_in_place(temporary, path)


def exported(graph: KnowledgeGraph) -> set[Triple]:
    """Return the triples that an export of a graph holds."""
    triples = graph.triples(GRAPH_ONTOLOGY, GRAPH_SOURCE, GRAPH_ACTIVITY, GRAPH_ASSERTED, GRAPH_INFERRED)
    modules = _of_type(triples, NamedNode(OWL + "Ontology")) - {_ONTOLOGY}
    kept = {
        to_milliseconds(triple) for triple in triples if triple.subject not in modules and triple.predicate != _IMPORTS
    }
    kept |= _declarations(triples)
    kept |= _labels(kept, graph.base)
    rules = as_swrl(graph, all_rules(graph.resources))
    kept |= rules.triples
    kept |= {Triple(_ONTOLOGY, _COMMENT, _left_out(rule, why)) for rule, why in rules.left_out}
    return values_as_rules(kept)


def _left_out(rule: Rule, why: str) -> Literal:
    meaning = f" ({rule.comment.rstrip('.')})" if rule.comment else ""
    text = f'The rule "{rule.label}"{meaning} is not in this file: {why}. What irtwin concluded by it is.'
    return Literal(text, language="en")


def _declarations(triples: Iterable[Triple]) -> set[Triple]:
    """Declare each individual of a class: owlready2 lists no others."""
    classes = _of_type(triples, _CLASS)
    return {
        Triple(triple.subject, TYPE, _INDIVIDUAL)
        for triple in triples
        if triple.predicate == TYPE and triple.object in classes and isinstance(triple.subject, NamedNode)
    }


def _labels(triples: Iterable[Triple], base: str) -> set[Triple]:
    """Label each individual that has no label by its IRI below the base: "joint energy KUKA.palletising, joint_a1"."""
    labelled = {triple.subject for triple in triples if triple.predicate == _LABEL}
    return {
        Triple(individual, _LABEL, Literal(_label(individual.value, base)))
        for individual in _of_type(triples, _INDIVIDUAL) - labelled
    }


def _label(iri: str, base: str) -> str:
    path = iri.removeprefix(base).removeprefix(f"{ONTOLOGY}/")
    kind, *names = map(unquote, path.split("/")) if "://" not in path else [iri]
    return f"{kind.replace('_', ' ')} {', '.join(names)}" if names else kind


def _of_type(triples: Iterable[Triple], kind: NamedNode) -> set[Any]:
    return {triple.subject for triple in triples if triple.predicate == TYPE and triple.object == kind}
