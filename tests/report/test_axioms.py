"""Axioms in words."""

import pytest
from pyoxigraph import NamedNode, RdfFormat, Store

from irtwin.report.ontology.axioms import axioms

PREFIXES = """@prefix : <urn:> . @prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> ."""


@pytest.mark.parametrize(
    ("axiom", "words"),
    [
        ("owl:equivalentClass :b", "equivalent to b"),
        ("rdfs:subClassOf :b", None),
        ("rdfs:range [ owl:unionOf ( :b :c ) ]", None),
        (
            "rdfs:subClassOf [ owl:onProperty :p ; owl:allValuesFrom [ owl:complementOf :b ] ]",
            "subclass of p only not b",
        ),
        (
            "owl:equivalentClass [ owl:intersectionOf ( :b [ owl:unionOf ( :c :d ) ] ) ]",
            "equivalent to b and ( c or d )",
        ),
        (
            "rdfs:subClassOf [ owl:onProperty [ owl:inverseOf :p ] ; owl:qualifiedCardinality 2 ; owl:onClass :c ]",
            "subclass of exactly 2 inverse of p of c",
        ),
        ('rdfs:range [ owl:oneOf ( "x" "y" ) ]', 'range "x" or "y"'),
        ("owl:propertyChainAxiom ( :p :q )", "follows from p then q"),
        ("rdfs:subClassOf [ owl:onProperty :p ; owl:hasValue 1 ]", "subclass of p is 1"),
        ("rdfs:range [ owl:onDatatype xsd:double ]", "range …"),
    ],
)
def test_what_an_axiom_says(axiom: str, words: str | None) -> None:
    store = Store()
    store.load(f"{PREFIXES} :a {axiom} .".encode(), format=RdfFormat.TURTLE)
    said = [
        " ".join([name, *(it.value.removeprefix("urn:") if isinstance(it, NamedNode) else it for it in said)])
        for term, name, said in axioms(store)
        if term == "urn:a"
    ]
    assert said == ([] if words is None else [words])
