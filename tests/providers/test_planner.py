"""The planner: what is run, in which order, and what never is."""

from types import SimpleNamespace

import pytest
from pyoxigraph import RdfFormat, parse
from tests.mapped import ontology_graph

from irtwin.errors import InputError
from irtwin.knowledge.explain.explain import explain
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.providers import planner, provider
from irtwin.providers.planner import ready

IRT = "https://w3id.org/irtwin#"
DECLARED = "SELECT ?name { ?one irt:applies_to ?class ; irt:Entry_Point ?name }"


@pytest.fixture
def graph() -> KnowledgeGraph:
    """Two robots: A with a twin, B without; run A.1 has its energy, A.2 lacks it."""
    graph = ontology_graph()
    quads = """
        @prefix irt: <https://w3id.org/irtwin#> . @prefix : <https://w3id.org/irtwin/id/> .
        <https://w3id.org/irtwin/graph/source/x> {
          :A a irt:Industrial_Robot ; irt:has_Joint :j ; irt:has_RunProcess :A.1, :A.2 ; irt:has_Twin :t .
          :B a irt:Industrial_Robot ; irt:has_Joint :k ; irt:has_RunProcess :B.1 .
          :A.1 a irt:IR_RunProcess ; irt:run_of :A ; irt:has_Series :s1 ; irt:Modelled_Energy 1.0e0 .
          :A.2 a irt:IR_RunProcess ; irt:run_of :A ; irt:has_Series :s2 .
          :B.1 a irt:IR_RunProcess ; irt:run_of :B ; irt:has_Series :s3 . }
    """
    graph.replace(parse(quads, format=RdfFormat.TRIG), "https://w3id.org/irtwin/graph/source/")
    return graph


def ends(iris: list[str]) -> list[str]:
    return [iri.rpartition("/")[2] for iri in iris]


def waiting(graph: KnowledgeGraph) -> set[tuple[str, str, str]]:
    asked = "SELECT ?one ?by ?lacks { ?one irt:waits_for ?by ; irt:lacks ?lacks . ?by irt:requires ?lacks }"
    return {
        tuple(value.rpartition("/")[2].removeprefix("irtwin#") for value in row.values()) for row in graph.query(asked)
    }


def test_the_ontology_declares_what_the_package_registers(graph):
    declared = {row["name"] for row in graph.query(DECLARED)}
    assert declared == set(provider.registered())


def test_only_what_lacks_the_result_and_has_the_premises_is_ready(graph):
    found = {name: ends(subjects) for name, subjects in ready(graph).items()}
    assert found == {"energy": ["A.2"], "identification": ["B"]}  # A.1 has its energy, B no twin yet


def test_what_is_said_by_an_inverse_counts(graph):
    graph.update("DELETE WHERE { GRAPH ?g { ?one irt:has_Twin ?twin } }")
    assert "energy" not in ready(graph)
    graph.update(f"INSERT DATA {{ GRAPH <{IRT}x> {{ id:t irt:twin_of id:A }} }}")
    assert ends(ready(graph)["energy"]) == ["A.2"]
    assert ends(ready(graph)["identification"]) == ["B"]


def test_what_waits_says_what_it_lacks_and_why(graph):
    reason(graph)
    assert waiting(graph) == {("B.1", "energy", "has_Twin")}
    (why,) = explain(graph, "id:B.1 irt:lacks irt:has_Twin")
    assert "provider:energy irt:requires irt:has_Twin" in str(why)
    assert {name: ends(some) for name, some in ready(graph).items()} == {"energy": ["A.2"], "identification": ["B"]}


def test_a_provider_that_nobody_offers_is_named():
    with pytest.raises(InputError, match='provider "oracle" is declared in the ontology, but no installed package'):
        provider.load_provider("oracle")


def test_each_runs_once_and_the_graph_is_refreshed_after_it(graph, monkeypatch):
    ran, kept, refreshed = [], [], []

    def made_by(name: str):
        def provide(workspace: object, key: str) -> provider.Made:
            ran.append((name, key))
            return provider.Made(key[0], [], [])

        return provide

    monkeypatch.setattr(planner, "load_provider", made_by)
    workspace = SimpleNamespace(replace_activity=lambda activity, *_, **__: kept.append(activity))
    planner.populate(workspace, graph, lambda: refreshed.append(len(ran)), lambda line: None)
    assert ran == [("energy", "A.2"), ("identification", "B")]
    assert len(ran) == len(set(ran)) == len(kept)
    assert all(activity.started <= activity.ended for activity in kept)
    assert refreshed[-1] == len(ran)


CIRCLE = """
    irt:Heat a owl:DatatypeProperty . irt:Cooling a owl:DatatypeProperty . irt:Fan a owl:DatatypeProperty .
    provider:heat a irt:Data_Provider ; irt:Entry_Point "heat" ; irt:applies_to irt:Industrial_Robot ;
        irt:requires irt:Cooling, irt:has_Joint ; irt:populates irt:Heat .
    provider:cooling a irt:Data_Provider ; irt:Entry_Point "cooling" ; irt:applies_to irt:IR_RunProcess ;
        irt:requires irt:Fan ; irt:populates irt:Cooling .
    provider:fan a irt:Data_Provider ; irt:Entry_Point "fan" ; irt:applies_to irt:Industrial_Robot ;
        irt:requires irt:Heat ; irt:populates irt:Fan ."""


def test_providers_in_a_circle_are_named_in_one_line_until_something_is_said_that_they_require(graph):
    assert planner.in_a_circle(graph) is None
    graph.update(f"INSERT DATA {{ GRAPH <{IRT}x> {{ {CIRCLE} }} }}")
    line = planner.in_a_circle(graph)
    assert line.startswith(
        "providers in a circle are not run: cooling requires Fan, which fan populates; "
        "fan requires Heat, which heat populates; heat requires Cooling, which cooling populates; have one of them"
    )
    assert {"energy", "identification"} <= ready(graph).keys()
    graph.update(f"INSERT DATA {{ GRAPH <{IRT}x> {{ provider:meter irt:populates irt:Fan }} }}")
    assert "cooling" not in planner.in_a_circle(graph).partition(",")[0]
    graph.update(f"INSERT DATA {{ GRAPH <{IRT}x> {{ id:A.1 irt:Fan 1 . id:A.2 irt:Fan 1 . id:B.1 irt:Fan 1 }} }}")
    assert set(ready(graph)) == {"cooling", "energy", "identification"}


def test_a_robot_that_a_provider_refuses_is_set_aside_and_others_go_on(graph, monkeypatch):
    refused, kept = [], []

    def provide(workspace: object, key: str) -> provider.Made:
        if key.startswith("B"):
            raise InputError("its torque is dead")
        return provider.Made(key[0], [], [])

    monkeypatch.setattr(planner, "load_provider", lambda name: provide)
    workspace = SimpleNamespace(
        replace_activity=lambda activity, *_, **__: kept.append(activity.subject.rpartition("/")[2])
    )

    def populate(*set_aside: planner.SetAside) -> bool:
        return planner.populate(workspace, graph, lambda: None, lambda line: None, *set_aside)

    assert populate(lambda robot_id, reason: refused.append((robot_id, str(reason))))
    assert refused == [("B", "its torque is dead")]  # once, though its run would be refused too
    assert "A.2" in kept
    with pytest.raises(InputError, match="its torque is dead"):
        populate()


def test_another_package_is_named_with_its_own_version(monkeypatch):
    other = SimpleNamespace(name="co2", dist=SimpleNamespace(name="irtwin-co2", version="2.3"))
    monkeypatch.setattr(provider, "registered", lambda: {"co2": other})
    assert provider.software_of("co2") == "irtwin-co2 2.3"
    monkeypatch.setattr(provider, "registered", lambda: {"co2": SimpleNamespace(dist=None)})
    assert provider.software_of("co2") == provider.software()
