"""Rules written in SWRL say the same, without built-ins; a rule that SWRL has no words for is named with the reason."""

from __future__ import annotations

import pytest
from pyoxigraph import Literal, NamedNode, Quad, RdfFormat, Triple, parse, serialize
from tests.knowledge.graphs import EX, turtle

from irtwin.knowledge.rules import swrl
from irtwin.knowledge.rules.as_swrl import MOST_VALUES, Written, as_swrl
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.rules.rule import Rule
from irtwin.knowledge.rules.running import conclusions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import GRAPH_ONTOLOGY, GRAPH_SOURCE, LIMIT, term

IN_SWRL = {
    *("condition number beyond the limit", "energy error beyond the limit", "idle share beyond the limit"),
    *("standby share beyond the limit", "twin to identify again"),
}
MODEL = """@prefix : <https://example.org/> .
:C a owl:Class . :D a owl:Class . :p a owl:ObjectProperty . :limit a owl:DatatypeProperty ; rdfs:range xsd:double .
:double a owl:DatatypeProperty ; rdfs:range xsd:double . :count a owl:DatatypeProperty ; rdfs:range xsd:integer .
:when a owl:DatatypeProperty ; rdfs:range xsd:dateTime . :name a owl:DatatypeProperty ; rdfs:range xsd:string .
:limits :limit 5.0e0 .
:a a :C ; :double 7.0e0 ; :count 3 ; :when "2026-02-01T00:00:00Z"^^xsd:dateTime ; :name "a" ; :p :b .
:b a :C ; :double 3.0e0 ; :count 1 ; :when "2026-01-01T00:00:00Z"^^xsd:dateTime ; :name "b" ; :p :b .
"""


@pytest.fixture(scope="module")
def model() -> KnowledgeGraph:
    graph = KnowledgeGraph()
    graph.replace(in_graph(turtle(MODEL), GRAPH_ONTOLOGY), GRAPH_ONTOLOGY)
    return graph


def rule(where: str, head: str = "$this a :D") -> Rule:
    construct = f"PREFIX : <{EX}> CONSTRUCT {{ {head} }} WHERE {{ {where} }}"
    return Rule(EX + "odd", "odd", "It is odd.", (0, 0), construct)  # type: ignore[arg-type]


def read_back(written: Written) -> list[Rule]:
    """Return rules in SWRL as another tool's file has them."""
    text = serialize(written.triples, format=RdfFormat.N_TRIPLES)
    return list(swrl.rules_of({quad.triple for quad in parse(text, format=RdfFormat.N_TRIPLES)}, "exported"))


def said(found: dict[str, set[Triple]]) -> set[Triple]:
    return set().union(*found.values())


@pytest.mark.slow
def test_the_shipped_rules_say_the_same_in_swrl(graph: KnowledgeGraph) -> None:
    rules = all_rules(graph.resources)
    written = as_swrl(graph, rules)
    left_out = {rule.label: why for rule, why in written.left_out}
    in_swrl = [rule for rule in rules if rule.label not in left_out]
    assert {rule.label for rule in in_swrl} == IN_SWRL
    facts = graph.triples()
    assert said(conclusions(facts, read_back(written))) == said(conclusions(facts, in_swrl)) != set()
    assert not any("BuiltinAtom" in str(triple) for triple in written.triples)  # HermiT takes none
    assert left_out["returned share beyond the limit"] == "it reckons, and HermiT takes no built-ins"
    assert left_out["twin alarm"] == "SWRL has no BIND"
    assert left_out["dominant joint"] == "SWRL has no subqueries or VALUES"


def test_the_limits_are_those_of_the_graph(graph: KnowledgeGraph) -> None:
    limit, value = NamedNode(LIMIT + "idle_share"), NamedNode(term("Limit_Value"))
    said = (one for one in graph.triples(GRAPH_ONTOLOGY) if (one.subject, one.predicate) != (limit, value))
    own = Quad(limit, value, Literal(0.15), NamedNode(GRAPH_SOURCE + "own"))
    graph.replace(in_graph(list(said), GRAPH_ONTOLOGY), GRAPH_ONTOLOGY)
    idle = [rule for rule in all_rules(graph.resources) if rule.label == "idle share beyond the limit"]
    assert as_swrl(graph, idle).left_out[0][1] == "what it looks up has no values in the graph"
    graph.change((), {own})
    assert Literal(0.15) in {triple.object for triple in as_swrl(graph, idle).triples}


@pytest.mark.parametrize(
    ("where", "expected"),
    [
        ("$this a :C", "ab"),
        ("$this rdf:type/rdfs:subClassOf* :C ; :name 'a'", "a"),
        ("$this :double ?n . ?limits :limit ?limit FILTER(?n > ?limit)", "a"),
        ("$this :double ?n . ?limits :limit ?limit FILTER(?limit > ?n)", "b"),
        ("$this :double ?n FILTER(?n >= 3 && ?n < 7)", "b"),
        ("$this :count ?n FILTER(?n > 1.5)", "a"),
        ("$this :when ?t FILTER(?t < '2026-01-15T00:00:00Z'^^xsd:dateTime)", "b"),
        ("?other :p $this ; :double ?n FILTER(?n > 5)", "b"),
        ("$this :double ?n", "ab"),
    ],
)
def test_conjunctions_and_comparisons_say_the_same(model: KnowledgeGraph, where: str, expected: str) -> None:
    written = as_swrl(model, [rule(where)])
    assert written.left_out == []
    facts = model.triples()
    found = said(conclusions(facts, read_back(written)))
    assert found == said(conclusions(facts, [rule(where)]))
    assert "".join(sorted(triple.subject.value.removeprefix(EX) for triple in found)) == expected


@pytest.mark.parametrize(
    ("where", "head", "why"),
    [
        ("$this a :C OPTIONAL { $this :p ?o }", "$this a :D", "SWRL has no OPTIONAL"),
        ("{ $this a :C } UNION { $this :p :b }", "$this a :D", "SWRL has no UNION"),
        ("$this a :C FILTER NOT EXISTS { $this :p :b }", "$this a :D", "SWRL has no NOT EXISTS"),
        ("$this :double ?n ; :limit ?l FILTER(?n > ?l)", "$this a :D", "it compares two values"),
        ("$this :double ?n FILTER(?n > 2 * 2)", "$this a :D", "it reckons"),
        ("$this :double ?n FILTER(?n = 3)", "$this a :D", "no class compares by ="),
        ("$this :double ?n FILTER(?n > 3 || ?n < 1)", "$this a :D", "SWRL has no alternatives"),
        ("$this :name ?n FILTER(?n > 'a')", "$this a :D", "no data range compares xsd:string"),
        ("$this :double ?n ; :limit ?n", "$this a :D", "it looks for one value twice"),
        ("$this rdfs:label ?n", "$this a :D", "rdfs:label is no property of individuals or of data"),
        ("$this ^:p ?o", "$this a :D", "a path is no property"),
        ("$this a :C ; :double ?n", "$this :limit ?n", "it concludes values"),
        ("$this a :C . ?all :name ?n FILTER(?n > 'a')", "$this a :D", "it compares two values"),
        ("$this a :C . ?any ?relation ?all", "$this a :D", f"more than {MOST_VALUES} values"),
    ],
)
def test_what_swrl_has_no_words_for_is_told(model: KnowledgeGraph, where: str, head: str, why: str) -> None:
    ((_, reason),) = as_swrl(model, [rule(where, head)]).left_out
    assert why in reason
