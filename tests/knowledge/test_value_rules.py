"""Axioms of a class and an individual become rules that draw the same, and no other axiom changes."""

from __future__ import annotations

import pytest
from pyoxigraph import NamedNode, Triple
from tests.knowledge.graphs import turtle

from irtwin.knowledge.engines import NATIVE, worth_keeping
from irtwin.knowledge.rules.running import conclusions
from irtwin.knowledge.rules.swrl import rules_of
from irtwin.knowledge.rules.value_rules import values_as_rules
from irtwin.knowledge.vocabulary import OWL

MODEL = """
ex:Run a owl:Class . ex:Heavy a owl:Class ; rdfs:label "heavy run" . ex:exceeds a owl:ObjectProperty .
ex:Gear a owl:Class . ex:sits_in a owl:ObjectProperty . ex:name a owl:DatatypeProperty .
ex:Heavy owl:equivalentClass [ a owl:Class ; owl:intersectionOf (
    ex:Run [ a owl:Restriction ; owl:onProperty ex:exceeds ; owl:hasValue ex:limit ] ) ] .
ex:Gear rdfs:subClassOf [ a owl:Restriction ; owl:onProperty ex:sits_in ; owl:hasValue ex:arm ] .
ex:Named rdfs:subClassOf [ a owl:Restriction ; owl:onProperty ex:name ; owl:hasValue "a" ] .
ex:Overhaul owl:equivalentClass [ a owl:Class ; owl:unionOf (
    [ a owl:Restriction ; owl:onProperty ex:by ; owl:hasValue ex:wear ]
    [ a owl:Restriction ; owl:onProperty ex:by ; owl:hasValue ex:play ] ) ] .
"""
FACTS = """
ex:one a ex:Run ; ex:exceeds ex:limit . ex:other a ex:Run ; ex:exceeds ex:another . ex:third a ex:Heavy .
ex:fourth a ex:Gear . ex:worn ex:by ex:wear . ex:loose ex:by ex:play . ex:fifth a ex:Overhaul . ex:sixth a ex:Named .
"""


def drawn(model: set[Triple]) -> set[Triple]:
    """Return what follows of the facts' individuals, by OWL 2 RL and SWRL in turn."""
    rules, facts = list(rules_of(model, "the model")), turtle(FACTS)
    known = model | facts
    while more := worth_keeping(NATIVE, known).union(*conclusions(known, rules).values()) - known:
        known |= more
    return {one for one in known - facts if one.subject in {fact.subject for fact in facts}}


def test_rules_draw_what_the_axioms_do() -> None:
    by_rules = drawn(values_as_rules(turtle(MODEL)))
    assert by_rules == drawn(turtle(MODEL))
    assert by_rules == turtle("""ex:one a ex:Heavy . ex:third a ex:Run ; ex:exceeds ex:limit .
        ex:fourth ex:sits_in ex:arm . ex:worn a ex:Overhaul . ex:loose a ex:Overhaul . ex:sixth ex:name "a" .""")


def test_no_individual_is_left_in_a_class() -> None:
    values = {one.object for one in values_as_rules(turtle(MODEL)) if one.predicate == NamedNode(OWL + "hasValue")}
    assert not any(isinstance(value, NamedNode) for value in values)
    assert len(values) == 1  # the name, which is no individual


def test_rules_are_named_by_their_class() -> None:
    labels = {rule.label for rule in rules_of(values_as_rules(turtle(MODEL)), "the model")}
    assert labels == {
        f"definition of {name}" for name in ("heavy run", "https://example.org/Gear", "https://example.org/Overhaul")
    }


@pytest.mark.parametrize(
    "axiom",
    [
        "ex:A rdfs:subClassOf ex:B .",
        "ex:A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty ex:p ; owl:someValuesFrom ex:B ] .",
        "ex:A owl:equivalentClass [ a owl:Class ; owl:intersectionOf ( [ a owl:Restriction ; owl:onProperty ex:p ;"
        " owl:someValuesFrom ex:B ] [ a owl:Restriction ; owl:onProperty ex:p ; owl:hasValue ex:b ] ) ] .",
    ],
)
def test_other_axioms_stay(axiom: str) -> None:
    given = turtle(axiom)
    assert values_as_rules(given) == given
