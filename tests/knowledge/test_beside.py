"""Facts closed beside an ontology give what both give when they are closed together."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyoxigraph import Quad, Triple
from tests.knowledge.graphs import turtle
from tests.mapped import ontology_graph

from irtwin.knowledge.owl_rl.beside import Equality, FactsClosure
from irtwin.knowledge.owl_rl.closure import Closure, Contradiction
from irtwin.knowledge.owl_rl.schema import Schema

AXIOMS = [
    "ex:C rdfs:subClassOf ex:D .",
    "ex:D owl:equivalentClass ex:E .",
    "ex:p rdfs:domain ex:C .",
    "ex:q rdfs:range ex:D .",
    "ex:v rdfs:range xsd:integer .",
    "ex:p rdfs:subPropertyOf ex:q .",
    "ex:p owl:inverseOf ex:r .",
    "ex:q a owl:TransitiveProperty .",
    "ex:r a owl:SymmetricProperty .",
    "ex:p a owl:FunctionalProperty .",
    "ex:s owl:propertyChainAxiom (ex:p ex:q ex:r) .",
    "ex:F owl:intersectionOf (ex:C ex:E) .",
    "ex:G owl:unionOf (ex:C ex:F) .",
    "ex:H owl:onProperty ex:q ; owl:someValuesFrom ex:C .",
    "ex:I owl:onProperty ex:v ; owl:someValuesFrom xsd:integer .",
    "ex:D rdfs:subClassOf [ owl:onProperty ex:r ; owl:allValuesFrom ex:J ] .",
    "ex:K owl:onProperty ex:q ; owl:hasValue ex:o .",
    "ex:E rdfs:subClassOf ex:K .",
    "ex:L owl:disjointWith ex:C .",
    "ex:s a owl:AsymmetricProperty .",
    "ex:o a ex:C ; ex:p ex:o2 .",
    "ex:r a owl:InverseFunctionalProperty .",
    "ex:p a owl:AsymmetricProperty .",
    "ex:J owl:complementOf ex:G .",
    "ex:C rdfs:subClassOf [ owl:onProperty ex:q ; owl:maxCardinality 1 ] .",
    "[] a owl:AllDisjointClasses ; owl:members (ex:D ex:L ex:H) .",
]
FACTS = [f"ex:{one} ex:{name} ex:{other} ." for one in "abc" for name in "pqrs" for other in "abc"]
FACTS += [f"ex:{one} a ex:{kind} ." for one in "abc" for kind in "CDEFGHJL"]
FACTS += ["ex:a ex:v 1 .", "ex:b ex:v 1.0 .", 'ex:c ex:v "x" .', "ex:a ex:q ex:o .", "ex:b ex:p ex:o ."]


def together(ontology: set[Triple], facts: set[Triple]) -> set[Triple] | None:
    """Return what is concluded, None for a contradiction."""
    try:
        return Closure(ontology | facts).worth_keeping()
    except Contradiction:
        return None


def beside(ontology: set[Triple], facts: set[Triple]) -> set[Triple] | None:
    try:
        schema = Schema(ontology)
        if schema.unfit is not None:  # it makes terms of its own the same
            raise Equality
        return (FactsClosure(schema, facts).worth_keeping() | schema.kept) - facts
    except Contradiction:
        return None


@pytest.mark.slow
@settings(max_examples=25)
@given(st.lists(st.sampled_from(AXIOMS), unique=True), st.lists(st.sampled_from(FACTS), unique=True, max_size=12))
@example(
    ["ex:v rdfs:range xsd:integer .", "ex:I owl:onProperty ex:v ; owl:someValuesFrom xsd:integer ."],
    ['ex:c ex:v "x" .', *(f"ex:a ex:{p} ex:{o} ." for p in "pq" for o in "abc"), "ex:a ex:r ex:a ."],
)
def test_drawn_facts(axioms: list[str], said: list[str]) -> None:
    ontology, facts = turtle(" ".join(axioms)), turtle(" ".join(said))
    try:
        assert beside(ontology, facts) == together(ontology, facts)
    except Equality:
        found = together(ontology, facts)
        assert found is None or any(one.predicate.value.endswith("#sameAs") for one in found)


@pytest.mark.slow
def test_facts_that_come_later(two_robots: list[Quad]) -> None:
    ontology, facts = ontology_graph().triples(), sorted((quad.triple for quad in two_robots), key=str)
    schema = Schema(ontology)
    closure = FactsClosure(schema, facts[::2])
    closure.add(facts[1::2])
    assert closure.worth_keeping() | schema.kept == Closure([*ontology, *facts]).worth_keeping()


def test_terms_that_are_the_same_are_told() -> None:
    assert Schema(turtle("ex:C owl:sameAs ex:D .")).unfit is not None
    assert Schema(turtle("owl:sameAs rdfs:domain ex:C .")).unfit is not None
    with pytest.raises(Equality):
        FactsClosure(Schema(turtle("ex:p a owl:FunctionalProperty .")), turtle("ex:a ex:p ex:b , ex:c ."))
