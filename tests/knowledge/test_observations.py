"""Observations as SOSA has them: what was mapped of a signal and of an energy, and the shape that holds it."""

from __future__ import annotations

from collections.abc import Iterable

import pyshacl
import pytest
import rdflib
from pyoxigraph import RdfFormat, Triple, serialize
from tests import small_fleet
from tests.mapped import map_into, ontology_graph

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import ID
from irtwin.resources import folder, shipped
from irtwin.storage.database import Workspace

FILES = ("observation", "robot_structure", "robot", "run_process")
SOSA = rdflib.Namespace("http://www.w3.org/ns/sosa/")
SIGNAL, ENERGY = f"{ID}observation/Arm_A.fit_1/q_j1", f"{ID}observation/Arm_A.fit_1/energy"
SHAPE = rdflib.URIRef("https://w3id.org/irtwin/shapes/observation")


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory) -> KnowledgeGraph:
    with Workspace(tmp_path_factory.mktemp("fleet")) as workspace:
        small_fleet.fill(workspace)
        return map_into(ontology_graph(), workspace, [folder("mappings") / f"{name}.r2rml.ttl" for name in FILES])


def said(graph: KnowledgeGraph, iri: str) -> set[tuple[str, str]]:
    rows = graph.query("SELECT ?p ?o { ?s ?p ?o }", {"s": iri}).rows
    return {(row["p"].rpartition("/")[2].rpartition("#")[2], str(row["o"]).removeprefix(ID)) for row in rows}


def test_a_signal_of_a_run_is_one_observation_whose_result_is_the_series(graph: KnowledgeGraph) -> None:
    assert said(graph, SIGNAL) == {
        ("type", f"{SOSA}Observation"), ("observedProperty", "channel/Arm_A/q_j1"),
        ("hasFeatureOfInterest", "joint/Arm_A/j1"), ("madeBySensor", "device/Arm_A/encoder.j1"),
        ("phenomenonTime", "interval/Arm_A.fit_1"),
        ("hasResult", f"series/{small_fleet.digest('measured Arm_A.fit_1')}/Arm_A.fit_1"),
    }  # fmt: skip


def test_what_is_measured_of_the_whole_robot_is_about_the_robot(graph: KnowledgeGraph) -> None:
    assert ("hasFeatureOfInterest", "robot/Arm_A") in said(graph, SIGNAL.replace("q_j1", "power"))


def test_the_energy_of_a_meter_is_a_number_with_a_unit(graph: KnowledgeGraph) -> None:
    found = said(graph, ENERGY)
    assert {("hasSimpleResult", "1000.0"), ("madeBySensor", "device/Arm_A/power_meter")} <= found
    assert ("hasUnit", "http://qudt.org/vocab/unit/J") in found
    assert ("wasGeneratedBy", "activity/energy.Arm_A.fit_1") in found


def test_only_what_was_logged_was_observed(graph: KnowledgeGraph) -> None:
    assert not said(graph, SIGNAL.replace("q_j1", "q_j2"))  # a column that this series does not have
    assert not said(graph, SIGNAL.replace("q_j1", "time"))
    rows = graph.query("SELECT ?o { ?o a <http://www.w3.org/ns/sosa/Observation> FILTER(CONTAINS(STR(?o), 'pick')) }")
    assert not rows.rows  # nobody measured a plan


def test_a_run_whose_log_says_no_time_has_an_interval_without_beginning(graph: KnowledgeGraph) -> None:
    begun = graph.query("SELECT ?i { ?i a <http://www.w3.org/2006/time#ProperInterval> }").rows
    assert len(begun) == len(small_fleet.RUNS) + len(small_fleet.LIVE)


def violations(triples: Iterable[Triple], focus: str) -> list[str]:
    data, shapes = rdflib.Graph(), rdflib.Graph().parse(shipped().path("shapes", "shapes.ttl"))
    data.parse(data=(serialize(triples, format=RdfFormat.N_TRIPLES) or b"").decode(), format="nt")
    _, report, _ = pyshacl.validate(data, shacl_graph=shapes, focus_nodes=[focus], use_shapes=[SHAPE])
    assert isinstance(report, rdflib.Graph)
    return sorted(map(str, report.objects(None, rdflib.SH.resultMessage)))


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        (SIGNAL, "", None),
        (ENERGY, "", None),
        (SIGNAL, "DELETE WHERE {{ <{0}> sosa:observedProperty ?o }}", "an observation is of one property"),
        (SIGNAL, "DELETE WHERE {{ <{0}> sosa:madeBySensor ?o }}", "an observation is made by one device"),
        (SIGNAL, "DELETE WHERE {{ <{0}> sosa:phenomenonTime ?o }}", "an observation is of one time"),
        (SIGNAL, "INSERT DATA {{ <{0}> sosa:hasSimpleResult 1 }}", "an observation has one result"),
        (ENERGY, "DELETE WHERE {{ <{0}> sosa:hasSimpleResult ?o }}", "an observation has one result"),
        (
            SIGNAL,
            "INSERT DATA {{ <{0}> sosa:hasFeatureOfInterest <urn:x> }}",
            "an observation is of one joint or robot",
        ),
    ],
)
def test_the_shape_holds_it(graph: KnowledgeGraph, name: str, change: str, message: str | None) -> None:
    near = "CONSTRUCT { ?s ?p ?o } { { BIND(<ITEM> AS ?s) ?s ?p ?o } UNION { <ITEM> ?leads ?s . ?s a ?o . ?s ?p ?o } }"
    other = KnowledgeGraph()
    triples = graph.construct(near.replace("ITEM", name)) | graph.construct(
        "CONSTRUCT { ?s rdfs:subClassOf ?o } { ?s rdfs:subClassOf ?o FILTER(isIRI(?o)) }"
    )
    other.update("INSERT DATA { " + " .\n".join(map(str, triples)) + " }")
    if change:
        other.update(f"PREFIX sosa: <{SOSA}> {change.format(name)}")
    assert set(violations(other.triples(), name)) == ({message} if message else set())
