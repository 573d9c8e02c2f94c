"""The closure against owlrl, which was written by others, and against the W3C's cases where these are at hand."""

from collections.abc import Iterable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyoxigraph import BlankNode, NamedNode, Quad, RdfFormat, Store, Triple, parse
from tests.knowledge.graphs import turtle

from irtwin.errors import InputError
from irtwin.knowledge.owl_rl import by_owlrl
from irtwin.knowledge.owl_rl import closure as owl_rl
from irtwin.knowledge.owl_rl.closure import Closure, Contradiction
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_ONTOLOGY, GRAPH_SOURCE, OWL

CASES = Path(__file__).parents[2] / "../shared/conformance/owl2rl"


def closure(given: Iterable[Triple]) -> set[Triple]:
    return Closure(given).worth_keeping()


@pytest.mark.parametrize(
    ("premise", "conclusion"),
    [
        ("ex:p rdfs:domain ex:C . ex:a ex:p ex:b .", "ex:a a ex:C ."),
        ("ex:p rdfs:range ex:C . ex:a ex:p ex:b .", "ex:b a ex:C ."),
        ("ex:p owl:inverseOf ex:q . ex:a ex:p ex:b . ex:c ex:q ex:d .", "ex:b ex:q ex:a . ex:d ex:p ex:c ."),
        ("ex:p a owl:TransitiveProperty . ex:a ex:p ex:b . ex:b ex:p ex:c . ex:c ex:p ex:d .", "ex:a ex:p ex:d ."),
        (
            "ex:p a owl:FunctionalProperty . ex:a ex:p ex:b, ex:c . ex:b ex:q ex:d .",
            "ex:b owl:sameAs ex:c . ex:c ex:q ex:d .",
        ),
        (
            "ex:C rdfs:subClassOf ex:D . ex:D rdfs:subClassOf ex:E . ex:a a ex:C .",
            "ex:a a ex:E . ex:C rdfs:subClassOf ex:E .",
        ),
        ("ex:C owl:intersectionOf (ex:D ex:E) . ex:a a ex:D, ex:E . ex:b a ex:D .", "ex:a a ex:C ."),
        ("ex:p owl:propertyChainAxiom (ex:q ex:r) . ex:a ex:q ex:b . ex:b ex:r ex:c .", "ex:a ex:p ex:c ."),
        (
            "ex:C owl:hasKey (ex:p ex:q) . ex:a a ex:C ; ex:p 1 ; ex:q 2 . ex:b a ex:C ; ex:p 1 ; ex:q 2 .",
            "ex:a owl:sameAs ex:b .",
        ),
        (
            "ex:R owl:hasValue ex:v ; owl:onProperty ex:p . ex:a ex:p ex:v . ex:b a ex:R .",
            "ex:a a ex:R . ex:b ex:p ex:v .",
        ),
    ],
)
def test_conclusion_is_drawn(premise: str, conclusion: str) -> None:
    assert turtle(conclusion) <= closure(turtle(premise))


@pytest.mark.parametrize(
    ("premise", "conclusion"),
    [
        (
            "ex:p owl:propertyChainAxiom (ex:q ex:q ex:q ex:q) . ex:a ex:q ex:a .",
            "ex:a ex:p ex:a .",
        ),
        ("ex:C owl:intersectionOf (ex:D ex:E ex:F) . ex:a a ex:D, ex:E, ex:F .", "ex:a a ex:C ."),
        ("ex:a owl:sameAs 1 . ex:b owl:sameAs 1.0 .", "ex:a owl:sameAs ex:b, 1.0 . ex:a a xsd:decimal ."),
        ("ex:a owl:sameAs 1 . ex:b owl:sameAs 1e0 .", "ex:a owl:differentFrom ex:b . ex:b a xsd:double ."),
        ("ex:p a owl:FunctionalProperty . ex:a ex:p 1, 1.0 .", "ex:a owl:sameAs ex:a ."),
        ("ex:a a [ owl:unionOf (ex:C) ] .", "ex:a owl:sameAs ex:a . owl:Thing a owl:Class ."),
        ("ex:R owl:someValuesFrom xsd:integer ; owl:onProperty ex:p . ex:a ex:p 7 .", "ex:a a ex:R ."),
        ("ex:same owl:sameAs owl:sameAs . ex:a ex:p ex:b .", "ex:a ex:same ex:a ."),
        ("owl:sameAs rdfs:domain ex:Known . ex:a ex:p ex:b .", "ex:a a ex:Known ."),
        ("ex:C a owl:Class .", "ex:C rdfs:subClassOf ex:C, owl:Thing . owl:Nothing rdfs:subClassOf ex:C ."),
    ],
)
def test_full_closure_draws_conclusion(premise: str, conclusion: str) -> None:
    said = turtle(premise)
    assert turtle(conclusion) <= {*said, *Closure(said).inferred()}


def test_literals_are_told_apart_by_their_values() -> None:
    with pytest.raises(Contradiction):
        closure(turtle("ex:p a owl:FunctionalProperty . ex:a ex:p 1, 1e0 ."))


def test_a_conclusion_names_its_rule_and_premises() -> None:
    closed = Closure(turtle("ex:C rdfs:subClassOf ex:D . ex:D rdfs:subClassOf ex:E . ex:a a ex:C ."))
    (conclusion,) = turtle("ex:a a ex:E .")
    derivation = closed.why(conclusion)
    assert derivation is not None
    assert derivation.rule == "cax-sco"
    premises = {Triple(*premise) for premise in derivation.premises}
    assert conclusion not in premises
    assert len(premises) == 2
    for premise in premises - turtle("ex:C rdfs:subClassOf ex:D . ex:D rdfs:subClassOf ex:E . ex:a a ex:C ."):
        assert closed.why(premise) is not None
    assert closed.why(*turtle("ex:a a ex:C .")) is None
    assert closed.why(*turtle("ex:a a ex:F .")) is None


def test_a_copy_is_added_to_apart() -> None:
    given = turtle("ex:p rdfs:domain ex:C . ex:a ex:p ex:b ; owl:sameAs ex:c .")
    more = turtle("ex:C rdfs:subClassOf ex:D . ex:c owl:sameAs ex:d .")
    closed = Closure(given)
    before = set(closed.inferred())
    other = closed.copy()
    other.add(more)
    assert turtle("ex:d a ex:D .") <= set(other.inferred()) == set(Closure(given | more).inferred())
    assert set(closed.inferred()) == before


def test_explosion_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(owl_rl, "MOST_CONCLUSIONS", 10_000)
    chain = " ".join(f"ex:a{i} owl:sameAs ex:a{i + 1} ." for i in range(100))
    with pytest.raises(InputError, match=r"more than 10,000 conclusions.*owl:sameAs"):
        closure(turtle(chain))


_TERMS = [f"ex:{name}" for name in "abcde"]
_WORDS = ["ex:a", "ex:p", "ex:q", "rdfs:subClassOf", "rdfs:subPropertyOf", "owl:sameAs", "a", "rdfs:domain"]
_MORE_WORDS = ["rdfs:range", "owl:inverseOf", "owl:equivalentClass", "owl:equivalentProperty"]
_STATEMENTS = st.tuples(
    st.sampled_from([*_TERMS, "ex:p", "ex:q"]),
    st.sampled_from(_WORDS + _MORE_WORDS),
    st.sampled_from([*_TERMS, "ex:p", "ex:q", "ex:q"]),
)
_KINDS = st.tuples(
    st.sampled_from(["ex:p", "ex:q"]),
    st.just("a"),
    st.sampled_from(["owl:TransitiveProperty", "owl:SymmetricProperty", "owl:FunctionalProperty"]),
)


@pytest.mark.slow
@settings(max_examples=20)
@given(st.lists(st.one_of(_STATEMENTS, _KINDS), min_size=3, max_size=9))
def test_agrees_with_owlrl_on_drawn_graphs(statements: list[tuple[str, str, str]]) -> None:
    premise = turtle(" ".join(f"{' '.join(statement)} ." for statement in statements))
    assert _own({*premise, *Closure(premise).inferred()}) == _own(_closed_by_owlrl(premise))


def test_what_an_individual_is_to_itself_is_kept() -> None:
    said = turtle("ex:p a owl:SymmetricProperty . ex:a ex:p ex:b . ex:b owl:sameAs ex:a .")
    assert turtle("ex:a ex:p ex:a . ex:b ex:p ex:b .") <= Closure(said).worth_keeping()


@pytest.mark.slow
@settings(max_examples=40)
@given(st.lists(st.one_of(_STATEMENTS, _KINDS), min_size=3, max_size=9))
def test_what_is_kept_is_what_owlrl_finds(statements: list[tuple[str, str, str]]) -> None:
    premise = turtle(" ".join(f"{' '.join(statement)} ." for statement in statements))
    kept = by_owlrl.worth_keeping(premise)
    assert _of_examples(Closure(premise).worth_keeping()) == _of_examples(kept)


def _of_examples(found: Iterable[Triple]) -> set[Triple]:
    return {one for one in found if "example.org" in one.subject.value and "example.org" in one.object.value}


def _own(found: Iterable[Triple]) -> set[Triple]:
    """Leave out what is said of the W3C's own words, and what anything is to itself, where owlrl tells only some."""
    return {one for one in _of_examples(found) if one.subject != one.object}


def _closed_by_owlrl(premise: Iterable[Triple]) -> set[Triple]:
    closed = {*premise, *by_owlrl.inferred(premise)}
    return {
        triple for triple in closed if isinstance(triple.subject, NamedNode) and isinstance(triple.object, NamedNode)
    }


def test_nothing_follows_from_half_of_the_premises() -> None:
    assert closure(turtle("ex:C owl:intersectionOf (ex:D ex:E) . ex:b a ex:D .")) <= turtle(
        "ex:C rdfs:subClassOf ex:D, ex:E ."
    )
    keyed = "ex:C owl:hasKey (ex:p ex:q) . ex:a a ex:C ; ex:p 1 ; ex:q 2 . ex:b a ex:C ; ex:p 1 ; ex:q 3 ."
    assert closure(turtle(keyed)) == set()
    same = [triple for triple in by_owlrl.inferred(turtle(keyed)) if triple.predicate.value == OWL + "sameAs"]
    assert all(triple.subject == triple.object for triple in same)


@pytest.mark.parametrize(
    ("premise", "rule"),
    [
        ("ex:C owl:disjointWith ex:D . ex:a a ex:C, ex:D .", "cax-dw"),
        ("[] a owl:AllDisjointClasses ; owl:members (ex:C ex:D) . ex:a a ex:C, ex:D .", "cax-adc"),
        ("ex:p a owl:FunctionalProperty . ex:a ex:p 1, 2 .", "prp-fp, dt-diff"),
        ("ex:p a owl:IrreflexiveProperty . ex:a ex:p ex:a .", "prp-irp"),
        ("ex:p a owl:AsymmetricProperty . ex:a ex:p ex:b . ex:b ex:p ex:a .", "prp-asyp"),
        ("ex:a owl:differentFrom ex:b ; owl:sameAs ex:b .", "eq-diff1"),
        ("ex:a owl:differentFrom ex:a .", "eq-diff1"),
        ("ex:a a owl:Nothing .", "cls-nothing2"),
        ("[] a owl:AllDifferent ; owl:distinctMembers (ex:a ex:b ex:a) .", "eq-diff3-twice"),
        ("[] a owl:AllDifferent ; owl:members (ex:a ex:b ex:c) . ex:c owl:sameAs ex:a .", "eq-diff2"),
        ("[] a owl:AllDisjointProperties ; owl:members (ex:p ex:q ex:r) . ex:a ex:p 1 ; ex:r 1 .", "prp-adp"),
        ("ex:p owl:propertyDisjointWith ex:q . ex:a ex:p 1.0 ; ex:q 1 .", "prp-pdw"),
        ("ex:p rdfs:range xsd:integer . ex:a ex:p 1.5 .", "dt-not-type"),
        ('ex:a ex:p "example"^^xsd:double .', "dt-not-type"),
        (
            "ex:C rdfs:subClassOf [ owl:onProperty ex:p ; owl:maxCardinality 0 ] . ex:a a ex:C ; ex:p ex:b .",
            "cls-maxc1",
        ),
    ],
)
def test_contradiction_is_refused_by_the_name_of_its_rule(premise: str, rule: str) -> None:
    with pytest.raises(InputError, match=rf"contradict each other \(OWL 2 RL rule {rule}\).*example"):
        closure(turtle(premise))


@pytest.mark.nightly
@pytest.mark.slow
def test_agrees_with_owlrl_on_two_robots(graph: KnowledgeGraph) -> None:
    """Apart from what is true of everything, and what is said of anonymous classes or literals."""
    premise = graph.triples(GRAPH_ONTOLOGY, GRAPH_SOURCE, GRAPH_ACTIVITY)
    expected = _closed_by_owlrl(premise)
    found = closure(premise)
    of_everything = {triple for triple in expected if _is_known_of_everything(triple)}
    assert {triple for triple in found if isinstance(triple.object, NamedNode)} <= expected
    assert expected - premise - of_everything <= found


def _is_known_of_everything(triple: Triple) -> bool:
    """Tell triples about the W3C's own vocabulary, about owl:Thing and owl:Nothing, and reflexive ones."""
    subject, object = triple.subject.value, triple.object.value
    own = subject == object or subject.startswith(("http://www.w3.org/", "http://www.daml.org/"))
    return own or object.startswith(OWL)


@pytest.mark.system
@pytest.mark.skipif(not CASES.exists(), reason="the W3C's OWL 2 RL cases are absent")
def test_every_case_of_the_w3c_holds() -> None:
    assert [case.name for case in sorted(CASES.iterdir()) if not _holds(case)] == []


def _holds(case: Path) -> bool:
    files = {file.name.split(".")[-2]: file for file in case.iterdir()}
    premise = next(file for name, file in files.items() if "conclusion" not in name)
    said = {quad.triple for quad in parse(path=str(premise), format=RdfFormat.TURTLE)}
    try:
        store = Store()
        store.extend(in_graph({*said, *Closure(said).inferred()}))
    except Contradiction:
        return "conclusiongraph" not in files
    if "conclusiongraph" not in files:
        return False
    wanted = (quad for quad in parse(path=str(files["conclusiongraph"]), format=RdfFormat.TURTLE))
    return bool(store.query(f"ASK {{ {' '.join(_pattern(quad) for quad in wanted)} }}"))


def _pattern(quad: Quad) -> str:
    terms = (quad.subject, quad.predicate, quad.object)
    return " ".join(f"?b{term.value}" if isinstance(term, BlankNode) else str(term) for term in terms) + " ."
