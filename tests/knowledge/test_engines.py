"""The engines that conclude from OWL agree where they cover the same, and say what they cannot do."""

from __future__ import annotations

import pytest
from pyoxigraph import Literal, NamedNode, Triple
from tests.knowledge.graphs import DRAWN, graph_of, turtle

from irtwin.errors import InputError
from irtwin.knowledge import engines, owl_dl
from irtwin.knowledge.engines import HERMIT, NATIVE, OWLRL
from irtwin.knowledge.explain.explain import explain
from irtwin.knowledge.owl_rl import by_owlrl
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.knowledge.reasoning import asserted, engine_of, reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import GRAPH_INFERRED, GRAPH_ONTOLOGY, GRAPH_OWL_RL, OWL, RDF, RDFS, TYPE, XSD

SUBCLASS = NamedNode(RDFS + "subClassOf")
# That ex:x belongs to ex:E needs an unnamed individual, of which OWL 2 RL knows nothing.
DL = """
ex:p a owl:ObjectProperty . ex:C a owl:Class . ex:D a owl:Class . ex:x a ex:C .
ex:E a owl:Class ; owl:equivalentClass [ a owl:Restriction ; owl:onProperty ex:p ; owl:minCardinality 1 ] .
ex:E rdfs:subClassOf ex:F . ex:F a owl:Class .
ex:C rdfs:subClassOf [ a owl:Restriction ; owl:onProperty ex:p ; owl:someValuesFrom ex:D ] .
"""


@pytest.fixture
def no_java(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (engines, owl_dl):
        monkeypatch.setattr(module, "java", lambda: None)


@pytest.mark.slow
@pytest.mark.nightly
def test_owlrl_concludes_what_the_native_engine_does_and_the_graph_says_which(graph: KnowledgeGraph) -> None:
    reason(graph)
    native = graph.triples(GRAPH_OWL_RL)
    assert engine_of(graph) == NATIVE
    reason(graph, OWLRL)
    assert graph.triples(GRAPH_OWL_RL) == native
    assert engine_of(graph) == OWLRL
    reason(graph)
    assert graph.triples(GRAPH_OWL_RL) == native
    assert engine_of(graph) == NATIVE


@pytest.mark.nightly
@pytest.mark.system
def test_hermit_concludes_what_the_native_engine_does(graph: KnowledgeGraph) -> None:
    premises = asserted(graph)
    assert engines.worth_keeping(HERMIT, premises) >= engines.worth_keeping(NATIVE, premises)


@pytest.mark.nightly
@pytest.mark.system
def test_hermit_alone_finds_every_type_that_the_native_engine_finds(graph: KnowledgeGraph) -> None:
    premises = asserted(graph)
    said = premises | owl_dl.classify(premises)
    native = {one for one in engines.worth_keeping(NATIVE, premises) if one.predicate == TYPE}
    above: dict[object, set[object]] = {}
    for one in said:
        if one.predicate in (SUBCLASS, NamedNode(OWL + "equivalentClass")):
            above.setdefault(one.subject, set()).add(one.object)
    types: dict[object, set[object]] = {}
    for one in said:
        if one.predicate == TYPE:
            todo, known = [one.object], types.setdefault(one.subject, set())
            while todo:
                kind = todo.pop()
                if kind not in known:
                    known.add(kind)
                    todo += above.get(kind, ())
    individuals = {one for one in native if not one.object.value.startswith((OWL, RDF, RDFS))}
    assert {one for one in individuals if one.object not in types[one.subject]} == set()


@pytest.mark.nightly
@pytest.mark.system
def test_hermit_finds_more_and_the_graph_says_who_did() -> None:
    graph = graph_of(in_graph(turtle(DL), DRAWN))
    (nearest, farther) = (next(iter(turtle(f"ex:x a ex:{name} ."))) for name in "EF")
    reason(graph)
    assert not graph.holds(nearest)
    reason(graph, HERMIT)
    assert graph.holds(nearest)
    assert graph.holds(farther)
    assert engine_of(graph) == HERMIT
    (found,) = explain(graph, "<https://example.org/x> a <https://example.org/E>")
    assert found.by == "OWL 2 DL, by HermiT: no rule of OWL 2 RL concludes it"
    reason(graph)
    assert not graph.holds(nearest)


def test_owlrl_finds_a_contradiction() -> None:
    with pytest.raises(Contradiction, match=r"owlrl finds: .*example.org/a"):
        engines.inferred(OWLRL, turtle("ex:C owl:disjointWith ex:D . ex:a a ex:C, ex:D ."))


def test_owlrl_leaves_a_zero_as_it_is_written() -> None:
    zero = Literal("0", datatype=NamedNode(XSD + "double"))
    a, b, p = (NamedNode(f"https://example.org/{name}") for name in "abp")
    same = turtle("ex:a owl:sameAs ex:b .")
    assert Triple(b, p, zero) in engines.inferred(OWLRL, {Triple(a, p, zero), *same})


def test_owlrl_says_how_long_it_would_take(graph: KnowledgeGraph, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"owlrl would take 17 minutes or more for 1,000,000 triples"):
        engines.check(OWLRL, 1_000_000)
    monkeypatch.setattr(by_owlrl, "MOST_TRIPLES", 1000)
    before = graph.triples(GRAPH_ONTOLOGY)
    with pytest.raises(InputError, match="1,000 are the most"):
        reason(graph, OWLRL)
    assert graph.triples(GRAPH_ONTOLOGY) == before


def test_hermit_says_what_memory_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    def die(*arguments, **options):
        raise owl_dl.owlready2.base.OwlReadyJavaError("java.lang.OutOfMemoryError: Java heap space")

    monkeypatch.setattr(owl_dl.owlready2, "sync_reasoner_hermit", die)
    with pytest.raises(InputError, match="HermiT needs more than the 2,000 MB"):
        owl_dl.classify(turtle("ex:a a owl:Class ."))


def test_without_java_hermit_is_refused_and_what_was_concluded_stays(graph: KnowledgeGraph, no_java: None) -> None:
    reason(graph)
    before = graph.triples(GRAPH_INFERRED)
    with pytest.raises(InputError, match=r'HermiT needs Java 25 or newer and finds none: `pip install "irtwin\[dl\]"`'):
        reason(graph, HERMIT)
    assert graph.triples(GRAPH_INFERRED) == before
