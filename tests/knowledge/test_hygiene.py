"""Hygiene rules: each finds nothing in the ontology, and what it is there for in a bad one."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyoxigraph import RdfFormat, Store
from tests.knowledge.graphs import TURTLE

from irtwin.resources import folder

RULES = sorted((Path(folder("rules")) / "hygiene").glob("*.rq"))
PREFIXES = f"""{TURTLE}
@prefix : <https://w3id.org/irtwin#> . @prefix dcterms: <http://purl.org/dc/terms/> .
"""
MODULE = "<https://w3id.org/irtwin/x> a owl:Ontology ."
BAD = {  # a small ontology in which :Bad, or :bad, is what the rule is there to find; :Good it must not find
    "label": ":Bad a owl:Class . :Good a owl:Class ; rdfs:label 'good'@en .",
    "definition": ":Bad a owl:Class . :Good a owl:Class ; skos:definition 'Good.'@en .",
    "defined_by": f""":Bad a owl:Class ; rdfs:isDefinedBy :nothing . {MODULE}
        :Good a owl:Class ; rdfs:isDefinedBy <https://w3id.org/irtwin/x> .""",
    "definition_style": """:Bad rdfs:label 'bad thing'@en ; skos:definition 'Bad thing.'@en .
        :Good rdfs:label 'good'@en ; skos:definition 'What one likes.'@en .""",
    "language_tag": ":Bad rdfs:label 'bad' . :Good rdfs:label 'good'@en .",
    "one_label": ":Bad rdfs:label 'bad'@en, 'worse'@en . :Good rdfs:label 'good'@en, 'gut'@de .",
    "own_label": """:Bad a owl:Class ; rdfs:label 'bad'@en . :bad a owl:ObjectProperty ; rdfs:label 'bad'@en .
        :Good a owl:Class ; rdfs:label 'good'@en .""",
    "domain": ":bad a owl:ObjectProperty . :Good a owl:DatatypeProperty ; rdfs:domain :C .",
    "range": ":bad a owl:ObjectProperty ; rdfs:range :C, :D . :Good a owl:DatatypeProperty ; rdfs:range xsd:string .",
    "unit": """:Bad a owl:DatatypeProperty ; rdfs:range xsd:double .
        :Good a owl:DatatypeProperty ; rdfs:range xsd:double ; qudt:hasUnit :metre .""",
    "unit_declared": ":Bad qudt:hasUnit :cubit . :Good qudt:hasUnit :metre . :metre a qudt:Unit ; qudt:symbol 'm' .",
    "orphan": ":Bad a owl:Class . :Good a owl:Class . :p rdfs:domain [ owl:unionOf ( :Other :Good ) ] .",
    "unused_individual": ":Bad a owl:NamedIndividual . :Good a owl:NamedIndividual, :C . :C a owl:Class .",
    "punning": ":Bad a owl:Class, owl:NamedIndividual . :Good a owl:Class .",
    "individual_punning": ":Bad a owl:Class, :C . :C a owl:Class . :Good a owl:Class .",
    "naming": ":bad a owl:Class . :Good a owl:Class .",
    "cycle": ":Bad rdfs:subClassOf [ rdfs:subClassOf :Bad ] . :Good rdfs:subClassOf :Other .",
    "undeclared": ":Good a owl:Class ; rdfs:subClassOf :Bad .",
    "inverse": """:bad owl:inverseOf :back ; rdfs:domain :C ; rdfs:range :D . :back rdfs:domain :D ; rdfs:range :D .
    :Good owl:inverseOf :good_back ; rdfs:domain :C ; rdfs:range :D . :good_back rdfs:domain :D ; rdfs:range :C .""",
    "disjoint": ":Bad a owl:Class . :Good a owl:Class . [] a owl:AllDisjointClasses ; owl:members ( :Other :Good ) .",
    "example": """:Bad a owl:DatatypeProperty ; rdfs:range xsd:string ; skos:definition 'Words.'@en .
        :Good a owl:DatatypeProperty ; rdfs:range xsd:string ; skos:definition 'It is "yes" or "no".'@en .""",
    "header": ":Bad a owl:Ontology ; owl:versionInfo '1' ; dcterms:license <http://example.com> .",
}


@pytest.fixture(scope="module")
def ontology() -> Store:
    store = Store()
    for module in sorted(folder("ontology").glob("*.ttl")):
        store.load(path=str(module), format=RdfFormat.TURTLE)
    return store


def found(store: Store, rule: Path) -> set[str]:
    return {row["term"].value.rsplit("#")[-1] for row in store.query(rule.read_text(encoding="utf-8"))}


@pytest.mark.slow
@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.stem)
def test_the_ontology_keeps_the_rule(ontology: Store, rule: Path) -> None:
    assert found(ontology, rule) == set(), rule.read_text(encoding="utf-8").splitlines()[0]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.stem)
def test_the_rule_finds_what_breaks_it(rule: Path) -> None:
    bad = Store()
    bad.load(PREFIXES + BAD[rule.stem], format=RdfFormat.TURTLE)
    names = {name for name in found(bad, rule) if name in ("Bad", "bad", "Good")}
    assert names & {"Bad", "bad"}
    assert "Good" not in names


def test_every_rule_is_tried_and_says_what_it_wants() -> None:
    assert {rule.stem for rule in RULES} == set(BAD)
    assert all(rule.read_text(encoding="utf-8").startswith("# rule: ") for rule in RULES)
