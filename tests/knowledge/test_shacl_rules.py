"""SHACL-AF rules run set-wise, against pySHACL, which runs them node by node."""

from collections.abc import Callable
from pathlib import Path

import pytest
import rdflib
from hypothesis import given, settings
from hypothesis import strategies as st
from pyoxigraph import Triple
from tests.knowledge.graphs import TURTLE, by_pyshacl, turtle

from irtwin.errors import InputError
from irtwin.knowledge.owl_rl.closure import Closure
from irtwin.knowledge.rules.files import read_rules
from irtwin.knowledge.rules.running import conclusions
from irtwin.knowledge.rules.shacl import rules_of
from irtwin.knowledge.shacl.shapes import Shapes

DECLARED = """
<https://example.org> a owl:Ontology ; sh:declare [ sh:prefix "ex" ; sh:namespace "https://example.org/"^^xsd:anyURI ] .
"""
DATA = """
ex:D rdfs:subClassOf ex:C .
ex:a a ex:C ; ex:p ex:b, ex:c ; ex:n 1 . ex:b a ex:D ; ex:p ex:c ; ex:n 2, 3 . ex:c ex:q "x", "yy" ; ex:n 4 .
ex:d a ex:E ; ex:q "WHERE {" ; ex:p ex:d, ex:a .
"""
FLAG = """sh:rule [ a sh:SPARQLRule ; sh:prefixes <https://example.org> ;
    sh:construct "CONSTRUCT { $this ex:is ex:flagged } WHERE { }\""""


def by_others(data: set[Triple], shapes: str) -> set[Triple]:
    made = by_pyshacl(data, rdflib.Graph().parse(data=TURTLE + DECLARED + shapes, format="turtle"))
    return {triple for triple in made - data if "example.org/" in triple.predicate.value}


def by_us(data: set[Triple], shapes: str, folder: Path) -> set[Triple]:
    file = folder / "rules.ttl"
    file.write_text(TURTLE + DECLARED + shapes)
    return set().union(*conclusions(data, read_rules(file)).values()) - data


@pytest.mark.parametrize(
    "shapes",
    [
        f"ex:S a sh:NodeShape ; sh:targetClass ex:C ; {FLAG} ] .",
        f"ex:S a sh:NodeShape ; sh:targetNode ex:a, ex:nowhere ; {FLAG} ] .",
        f"ex:S a sh:NodeShape ; sh:targetSubjectsOf ex:q ; {FLAG} ] .",
        f"ex:S a sh:NodeShape ; sh:targetObjectsOf ex:p ; {FLAG} ] .",
        f"ex:S a sh:NodeShape ; sh:targetObjectsOf ex:p ; sh:targetClass ex:E ; {FLAG} ] .",
        f"ex:C a sh:NodeShape, rdfs:Class ; {FLAG} ] .",
        f"ex:S a sh:NodeShape ; sh:targetClass ex:C ; {FLAG} ; sh:deactivated true ] .",
        f"ex:S a sh:NodeShape ; sh:targetClass ex:C ; {FLAG} ; sh:deactivated false ] .",
        # what one rule concludes is what another one starts from
        "ex:S a sh:NodeShape ; sh:targetClass ex:C ; sh:rule [ a sh:SPARQLRule ; sh:prefixes <https://example.org> ;"
        ' sh:construct "CONSTRUCT { ?other ex:p $this } WHERE { $this ex:p ?other }" ] .',
        # in turn
        "ex:S a sh:NodeShape ; sh:targetClass ex:C ; sh:rule [ a sh:SPARQLRule ; sh:order 2 ;"
        ' sh:prefixes <https://example.org> ; sh:construct "CONSTRUCT { $this ex:r ex:late } WHERE '
        '{ FILTER NOT EXISTS { $this ex:r ex:early } }" ] , [ a sh:SPARQLRule ; sh:order 1 ;'
        ' sh:prefixes <https://example.org> ; sh:construct "CONSTRUCT { $this ex:r ex:early } { $this ex:p ex:b }" ] .',
        # words in strings and comments
        "ex:S a sh:NodeShape ; sh:targetSubjectsOf ex:q ; sh:rule [ a sh:SPARQLRule ;"
        ' sh:prefixes <https://example.org> ; sh:construct """# CONSTRUCT { } WHERE {\n'
        'CONSTRUCT { $this ex:r "WHERE {" } WHERE { $this ex:q "WHERE {" }""" ] .',
    ],
)
def test_agrees_with_pyshacl(shapes: str, tmp_path: Path) -> None:
    data = turtle(DATA)
    expected = by_others(data, shapes)
    assert by_us(data, shapes, tmp_path) == expected
    assert expected or "deactivated true" in shapes


NAMES = st.sampled_from(["ex:a", "ex:b", "ex:c", "ex:d"])
LINKS = st.tuples(NAMES, st.sampled_from(["ex:p", "ex:q"]), NAMES)
KINDS = st.tuples(NAMES, st.just("a"), st.sampled_from(["ex:C", "ex:D"]))


@pytest.mark.slow
@settings(max_examples=25)
@given(st.lists(st.one_of(LINKS, KINDS), max_size=10))
def test_recursive_rules_agree_with_pyshacl_on_drawn_data(statements: list[tuple[str, str, str]]) -> None:
    shapes = """
    ex:S a sh:NodeShape ; sh:targetClass ex:C ; sh:rule [ a sh:SPARQLRule ; sh:prefixes <https://example.org> ;
        sh:construct "CONSTRUCT { $this ex:p ?z } WHERE { $this ex:p ?y . ?y ex:p|ex:q ?z }" ] ,
        [ a sh:SPARQLRule ; sh:prefixes <https://example.org> ; sh:construct
          "CONSTRUCT { ?y ex:q $this } WHERE { $this ex:p ?y, ?z FILTER(?y != ?z) }" ] ."""
    data = turtle("ex:D rdfs:subClassOf ex:C . " + " ".join(f"{' '.join(it)} ." for it in statements))
    rules = rules_of(Shapes(turtle(DECLARED + shapes), "drawn"))
    assert set().union(*conclusions(data, rules).values()) - data == by_others(data, shapes)


@pytest.mark.parametrize(
    ("shapes", "message"),
    [
        (f"ex:S {FLAG} ] .", "https://example.org/S: its rule needs sh:targetClass"),
        (
            f"ex:S sh:targetNode ex:a ; {FLAG} ; sh:condition [ sh:class ex:C ] ] .",
            "no sh:condition: write that in SPARQL",
        ),
        (f"ex:S sh:targetNode ex:a ; {FLAG} ; sh:order 'x' ] .", "is no number"),
        ("ex:S sh:targetNode ex:a ; sh:rule [ sh:subject sh:this ] .", "a sh:SPARQLRule with one sh:construct"),
        ("ex:S sh:targetNode ex:a ; sh:rule [ sh:construct 'ASK {}' ] .", "is no CONSTRUCT"),
        ("ex:S sh:targetNode ex:a ; sh:rule [ sh:construct 'CONSTRUCT { $this } WHERE { }' ] .", "is not SPARQL"),
        (
            "ex:S sh:targetNode ex:a ; sh:rule [ sh:construct 'CONSTRUCT { [] a <x:y> } WHERE { }' ] .",
            "still find something new after 100 rounds",
        ),
    ],
)
def test_rule_that_cannot_be_run_is_refused(shapes: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        by_us(turtle(DATA), shapes, tmp_path)


def test_rules_and_owl_go_on_in_turn_and_a_higher_order_waits_for_both() -> None:
    """A rule starts from a superclass of what another one made; one of a higher order asks what that did not reach."""
    rules = """
    ex:One a sh:NodeShape ; sh:targetSubjectsOf ex:p ; sh:rule [ a sh:SPARQLRule ; sh:prefixes <https://example.org> ;
        sh:construct "CONSTRUCT { $this a ex:Low } WHERE { $this ex:p ?any }" ] .
    ex:Two a sh:NodeShape ; sh:targetClass ex:High ; sh:rule [ a sh:SPARQLRule ; sh:prefixes <https://example.org> ;
        sh:construct "CONSTRUCT { $this ex:q ex:found } WHERE { }" ] .
    ex:Three a sh:NodeShape ; sh:targetSubjectsOf ex:n ; sh:rule [ a sh:SPARQLRule ; sh:order 1 ;
        sh:prefixes <https://example.org> ;
        sh:construct "CONSTRUCT { $this a ex:Left } WHERE { FILTER NOT EXISTS { $this a ex:Reached } }" ] ."""
    model = "ex:Low rdfs:subClassOf ex:High . ex:q rdfs:domain ex:Reached . ex:a ex:p 1 ; ex:n 1 . ex:b ex:n 1 ."
    closure = Closure(turtle(model))
    found = conclusions(
        turtle(model) | closure.worth_keeping(), rules_of(Shapes(turtle(DECLARED + rules), "drawn")), closing(closure)
    )
    said = {" ".join(str(one.value).rpartition("/")[2] for one in it) for it in set().union(*found.values())}
    assert said == {"a 22-rdf-syntax-ns#type Low", "a q found", "b 22-rdf-syntax-ns#type Left"}


def closing(closure: Closure) -> Callable[[set[Triple]], set[Triple]]:
    def close(found: set[Triple]) -> set[Triple]:
        closure.add(found)
        return closure.worth_keeping()

    return close
