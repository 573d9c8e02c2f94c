"""SWRL rules become CONSTRUCTs: built-ins are reckoned, classes of values compared, and what is not run is refused."""

from __future__ import annotations

import pytest
from pyoxigraph import NamedNode, Triple
from tests.knowledge.graphs import EX, turtle

from irtwin.errors import InputError
from irtwin.knowledge.explain.rules import premises
from irtwin.knowledge.rules.rule import Rule
from irtwin.knowledge.rules.running import conclusions
from irtwin.knowledge.rules.swrl import rules_of
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_SWRL, RDF

PREFIXES = "@prefix var: <urn:swrl:var#> . @prefix other: <urn:other#> .\n"
VARIABLES = "var:x a swrl:Variable . var:y a swrl:Variable . var:n a swrl:Variable . other:n a swrl:Variable .\n"
FACTS = """
ex:a a ex:C ; ex:n 7.0e0 ; ex:m 2.0e0 ; ex:p ex:b . ex:b a ex:C ; ex:n 3.0e0 ; ex:m 2.0e0 ; ex:p ex:b .
"""
MARKED = "[ a swrl:ClassAtom ; swrl:classPredicate ex:Marked ; swrl:argument1 var:x ]"


def is_a(kind: str) -> str:
    return f"[ a swrl:ClassAtom ; swrl:classPredicate {kind} ; swrl:argument1 var:x ]"


def has(name: str, value: str, atom: str = "DatavaluedPropertyAtom") -> str:
    return f"[ a swrl:{atom} ; swrl:propertyPredicate ex:{name} ; swrl:argument1 var:x ; swrl:argument2 {value} ]"


def built_in(name: str, arguments: str) -> str:
    return f"[ a swrl:BuiltinAtom ; swrl:builtin {name} ; swrl:arguments ( {arguments} ) ]"


def rule(*body: str, head: str = MARKED, label: str = 'rdfs:label "odd" ;') -> Rule:
    text = f"{VARIABLES} [] a swrl:Imp ; {label} swrl:body ( {' '.join(body)} ) ; swrl:head ( {head} ) ."
    (found,) = rules_of(turtle(PREFIXES + text), "my.swrl.ttl")
    return found


def marked(*body: str) -> str:
    found = conclusions(turtle(FACTS), [rule(*body)])
    return "".join(sorted(triple.subject.value.removeprefix(EX) for triple in found[f"{GRAPH_SWRL}odd"]))


MORE_THAN_FIVE = "[ a rdfs:Datatype ; owl:onDatatype xsd:double ; owl:withRestrictions ( [ xsd:minExclusive 5.0e0 ] ) ]"


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ([is_a("ex:C")], "ab"),
        ([has("n", "3.0e0")], "b"),
        ([has("n", "var:n"), built_in("swrlb:greaterThan", "var:n 5.0e0")], "a"),
        ([has("n", "var:n"), built_in("swrlb:lessThanOrEqual", "var:n 3")], "b"),
        ([has("n", "var:n"), has("m", "other:n"), built_in("swrlb:greaterThan", "var:n other:n")], "ab"),
        (
            [
                built_in("swrlb:greaterThan", "var:n var:y"),  # atoms in any order
                built_in("swrlb:multiply", "var:y other:n 2.0e0"),
                has("n", "var:n"),
                has("m", "other:n"),
            ],
            "a",
        ),
        (
            [has("n", "var:n"), f"[ a swrl:DataRangeAtom ; swrl:dataRange {MORE_THAN_FIVE} ; swrl:argument1 var:n ]"],
            "a",
        ),
        ([has("n", "var:n"), "[ a swrl:DataRangeAtom ; swrl:dataRange xsd:double ; swrl:argument1 var:n ]"], "ab"),
        ([is_a(f"[ a owl:Restriction ; owl:onProperty ex:n ; owl:someValuesFrom {MORE_THAN_FIVE} ]")], "a"),
        ([is_a("[ a owl:Restriction ; owl:onProperty ex:n ; owl:someValuesFrom rdfs:Literal ]")], "ab"),
        ([is_a("[ a owl:Restriction ; owl:onProperty ex:n ; owl:hasValue 3.0e0 ]")], "b"),
        (
            [
                has("p", "var:y", "IndividualPropertyAtom"),
                "[ a swrl:DifferentIndividualsAtom ; swrl:argument1 var:x ; swrl:argument2 var:y ]",
            ],
            "a",
        ),
        (
            [
                has("p", "var:y", "IndividualPropertyAtom"),
                "[ a swrl:SameIndividualAtom ; swrl:argument1 var:x ; swrl:argument2 var:y ]",
            ],
            "b",
        ),
    ],
)
def test_each_kind_of_atom_holds_where_it_should(body: list[str], expected: str) -> None:
    assert marked(*body) == expected


def test_a_conclusion_has_its_premises_and_the_rule_its_name() -> None:
    found = rule(has("n", "var:n"), built_in("swrlb:greaterThan", "var:n 5.0e0"))
    assert (found.name, found.language) == ("odd", "SWRL")
    graph = KnowledgeGraph()
    graph.update(f"PREFIX ex: <{EX}> INSERT DATA {{ ex:a ex:n 7.0e0 ; a ex:Marked . ex:b ex:n 3.0e0 ; a ex:Marked }}")
    kind = NamedNode(RDF + "type"), NamedNode(EX + "Marked")
    facts, are_all = premises(graph, found, Triple(NamedNode(EX + "a"), *kind)) or ([], False)
    assert [fact.predicate.value for fact in facts] == [EX + "n"] and are_all
    assert premises(graph, found, Triple(NamedNode(EX + "b"), *kind)) is None


CLASS = is_a("ex:C")


@pytest.mark.parametrize(
    ("body", "head", "said"),
    [
        (
            [CLASS, built_in("swrlb:abs", "var:n var:n")],
            MARKED,
            "uses swrlb:abs as irtwin does not run it: it runs equal",
        ),
        ([CLASS, built_in("ex:near", "var:x")], MARKED, "uses https://example.org/near, which is no built-in of SWRL"),
        ([], MARKED, "has no list of atoms for its swrl:body"),
        ([CLASS], "", "has no list of atoms for its swrl:head"),
        ([CLASS], built_in("swrlb:equal", "var:x 1"), "concludes more than classes and properties"),
        ([CLASS, "[ a swrl:SoundAtom ]"], MARKED, "has a swrl:SoundAtom that lacks an argument"),
        ([is_a("[ a owl:Class ; owl:complementOf ex:C ]")], MARKED, "has a class expression that irtwin does not run"),
        (
            [has("n", "var:n"), "[ a swrl:DataRangeAtom ; swrl:dataRange [ owl:oneOf ( 1 ) ] ; swrl:argument1 var:n ]"],
            MARKED,
            "has a data range that is none of minExclusive",
        ),
    ],
)
def test_what_is_not_run_is_refused(body: list[str], head: str, said: str) -> None:
    with pytest.raises(InputError, match=r"^my\.swrl\.ttl: the rule 'odd' ") as error:
        rule(*body, head=head)
    assert said in str(error.value)


def test_a_rule_without_label_is_refused() -> None:
    with pytest.raises(InputError, match="has no rdfs:label"):
        rule(CLASS, label="")
