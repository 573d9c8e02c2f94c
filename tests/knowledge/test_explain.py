"""How a triple is known, on two robots whose every fact has a known source."""

import json
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyoxigraph import Literal, NamedNode, Triple

from irtwin.errors import InputError
from irtwin.knowledge.explain import explain as explaining
from irtwin.knowledge.explain.explain import explain
from irtwin.knowledge.explain.explanation import Explanation, to_json
from irtwin.knowledge.explain.rules import premises
from irtwin.knowledge.owl_rl.closure import show
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.rules.rule import Rule
from irtwin.knowledge.store.graph import KnowledgeGraph

pytestmark = pytest.mark.slow


def only(graph: KnowledgeGraph, pattern: str) -> Explanation:
    (found,) = explain(graph, pattern)
    return found


def all_within(explanation: Explanation) -> Iterator[Explanation]:
    yield explanation
    for each in explanation.because:
        yield from all_within(each)


def test_rules_conclusion_is_followed_down_to_files(reasoned: KnowledgeGraph) -> None:
    found = only(reasoned, "id:twin/Arm_A.t1 irt:fails_on ?")
    assert found.by == 'the rule "twin to identify again", in SHACL'
    assert found.meaning is not None and "energy it misses by more than the limit" in found.meaning
    assert {each.what for each in found.because} == {
        "id:run/Arm_A.check_1 irt:exceeds limit:energy_error",
        "id:run/Arm_A.check_1 irt:modelled_by id:twin/Arm_A.t1",
    }
    assert {
        'id:run/Arm_A.check_1 irt:Energy_Error "12"^^xsd:double',
        'limit:energy_error irt:Limit_Value "10"^^xsd:double',
    } <= {each.what for each in all_within(found)}
    files = {each.file: each.checksum for each in all_within(found) if each.file}
    assert files == {
        "twins/Arm_A.t1.json": "bbArm_A",
        "series/aafit_1.parquet": "aafit_1",
        "ontology/energy.ttl": None,
    }
    assert any("provider:identification of irtwin 0.1.0, finished 2026-03-05" in each.by for each in all_within(found))
    assert "id:run/Arm_A.fit_1" in {each.what for each in all_within(found)}


def test_rule_with_an_aggregate_names_what_it_took(reasoned: KnowledgeGraph) -> None:
    found = only(reasoned, "id:run/Arm_A.fit_1 irt:dominant_Joint ?")
    assert found.by == 'the rule "dominant joint", in SHACL'
    assert 'id:joint_energy/Arm_A.fit_1/j1 irt:Energy "300"^^xsd:double' in {each.what for each in found.because}


def test_totals_are_the_sums_of_what_explains_them(plant_place: Path) -> None:
    plant = KnowledgeGraph(plant_place / "graph", read_only=True)
    totals = plant.query("""SELECT ?total ?name ?value {
        ?name irt:worked_out_of ?property . ?total ?name ?value
        FILTER(?name NOT IN (irt:Least_Payload, irt:Greatest_Payload, irt:Total_Idle_Energy, irt:Total_Idle_Time)) }""")
    for row in totals:
        found = only(plant, f"<{row['total']}> <{row['name']}> ?")
        parts = [float(each.what.split('"')[1]) for each in found.because]
        assert parts and sum(parts) == pytest.approx(row["value"]), found.what
    kinds = {row["total"].removeprefix(plant.base).partition("/")[0] for row in totals}
    assert kinds == {"robot_total", "day_total", "fleet_day_total", "ledger_total", "joint_total"}


@pytest.mark.parametrize(
    ("inner", "taken"),
    [
        ("SELECT ?x (SUM(?y) AS ?sum) WHERE { ?x <urn:has> ?y } GROUP BY ?x", {"1", "2"}),
        ("SELECT ?x { ?x <urn:has> ?y }", {"1", "2"}),
        ("SELECT * WHERE { ?x <urn:has> ?y FILTER(?y > 1) }", {"2"}),
    ],
)
def test_a_subquery_is_followed_for_the_individual_that_the_conclusion_is_of(inner: str, taken: set[str]) -> None:
    graph = KnowledgeGraph()
    graph.update("INSERT DATA { <urn:a> <urn:has> 1, 2 . <urn:b> <urn:has> 3 }")
    order = Decimal(0), Decimal(0)
    rule = Rule("urn:r", "r", "", order, f"CONSTRUCT {{ ?x <urn:is> true }} WHERE {{ {{ {inner} }} }}")
    concluded = Triple(NamedNode("urn:a"), NamedNode("urn:is"), Literal(True))
    facts, are_all = premises(graph, rule, concluded) or ([], False)
    assert are_all and {one.object.value for one in facts} == taken


def test_closure_names_rule_and_premises(reasoned: KnowledgeGraph) -> None:
    found = only(reasoned, "id:robot/Arm_A irt:has_Joint id:joint/Arm_A/j1")
    assert found.by == "OWL 2 RL, rule prp-inv1"
    axiom, fact = found.because
    assert (axiom.what, axiom.file) == ("irt:joint_of owl:inverseOf irt:has_Joint", "ontology/robot.ttl")
    assert fact.by == "mapping mappings/robot.r2rml.ttl #Joint, from table joint"


def test_source_names_triples_map_and_table(reasoned: KnowledgeGraph) -> None:
    found = only(reasoned, "id:run/Arm_A.fit_1 irt:Run_Role")
    assert found.by == "mapping mappings/run_process.r2rml.ttl #Run, from table run"
    measured = only(reasoned, "id:series/aa/Arm_A.fit_1 irt:Series_Kind")
    assert "SELECT * FROM series WHERE kind = 'measured'" in measured.by
    assert (measured.file, measured.checksum) == ("series/aafit_1.parquet", "aafit_1")


@pytest.mark.parametrize("step", [9, pytest.param(1, marks=pytest.mark.nightly)])
def test_every_inferred_triple_is_explained(reasoned: KnowledgeGraph, step: int) -> None:
    explainer = explaining.Explainer(reasoned)
    for triple in sorted(reasoned.triples("https://w3id.org/irtwin/graph/inferred/"), key=str)[::step]:
        found = explainer.triple(triple)
        assert found.because or found.by == "what is said above", found


def test_premises_far_from_the_triple_are_found() -> None:
    graph = KnowledgeGraph()
    links = " ".join(f"ex:a{i} ex:next ex:a{i + 1} ." for i in range(9))
    graph.update("PREFIX ex: <https://example.org/> INSERT DATA { ex:next a owl:TransitiveProperty . " + links + "}")
    reason(graph)
    found = only(graph, "<https://example.org/a0> <https://example.org/next> <https://example.org/a9>")
    assert found.by == "OWL 2 RL, rule prp-trp"
    stated = {each.what for each in all_within(found) if each.by.startswith("what was written into")}
    assert len(stated) == 10


def test_class_expressions_and_lists_are_walked() -> None:
    graph = KnowledgeGraph()
    graph.update(
        """PREFIX ex: <https://example.org/> INSERT DATA {
            ex:D owl:equivalentClass [ owl:intersectionOf ( ex:A ex:B ex:C ) ] . ex:x a ex:A, ex:B, ex:C . }"""
    )
    reason(graph)
    found = only(graph, "https://example.org/x a https://example.org/D")
    said = {each.what for each in all_within(found)}
    assert {f"https://example.org/x rdf:type https://example.org/{name}" for name in "ABC"} <= said
    assert not any("urn:irtwin" in what for what in said)


def test_written_as_outline_and_as_json(reasoned: KnowledgeGraph) -> None:
    found = only(reasoned, "id:robot/Arm_A irt:has_Joint id:joint/Arm_A/j1")
    text = str(found)
    assert text.splitlines()[:3] == [
        "id:robot/Arm_A irt:has_Joint id:joint/Arm_A/j1",
        "    by OWL 2 RL, rule prp-inv1",
        "    - irt:joint_of owl:inverseOf irt:has_Joint",
    ]
    document = json.loads(json.dumps(to_json(found)))
    assert document["because"][0]["file"] == "ontology/robot.ttl"
    assert "checksum" not in document


def test_a_definition_without_a_name_is_found_by_what_leads_to_it(reasoned: KnowledgeGraph) -> None:
    found = only(reasoned, "irt:Wasteful_Run owl:equivalentClass ?")
    assert (found.by, found.file) == ("the ontology", "ontology/energy.ttl")
    node = found.what.split()[-1]
    kind = only(reasoned, f"{node} rdf:type ?")
    assert (kind.what, kind.because) == (f"{node} rdf:type owl:Class", (found,))


@pytest.mark.parametrize(
    ("pattern", "message"),
    [
        ("id:run/nobody irt:Payload ?", "has no triple id:run/nobody"),
        ("? ? ?", "more than 100 triples fit"),
        ("irt:a irt:b irt:c irt:d", "more than subject, predicate and object"),
        ("irt:a { irt:c", "not a SPARQL query"),
        ("nobody:a irt:b irt:c", "not a SPARQL query"),
    ],
)
def test_pattern_that_cannot_be_explained_is_refused(reasoned: KnowledgeGraph, pattern: str, message: str) -> None:
    with pytest.raises(InputError, match=message.replace("?", r"\?")):
        explain(reasoned, pattern)


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_every_triple_of_the_graph_is_found_as_it_is_written(reasoned: KnowledgeGraph, data: st.DataObject) -> None:
    quads = sorted((quad for name in reasoned.graphs() for quad in reasoned.store.quads_in(name)), key=str)
    triple = data.draw(st.sampled_from(quads)).triple
    as_shown = " ".join(show(term, reasoned.base) for term in triple)
    for written in (f"{triple.subject} {triple.predicate} {triple.object}", f"{triple} .", as_shown):
        assert triple in explaining._matching(reasoned, written), written


@pytest.mark.parametrize(
    "object",
    [
        '"5.0"^^<http://www.w3.org/2001/XMLSchema#double>',
        '"5"^^xsd:double',
        "5",
        "5.0e0",
        '"two\nlines, \\"quoted\\""',
        '"two\\nlines, \\"quoted\\""',
        '"Hose"@en',
        "'single'",
    ],
)
def test_a_literal_is_found_however_it_is_written(object: str) -> None:
    graph = KnowledgeGraph()
    graph.update(
        """INSERT DATA { <urn:a> <urn:p> "5.0"^^xsd:double, "Hose"@en, "single", "two\\nlines, \\"quoted\\"" }"""
    )
    assert len(explaining._matching(graph, f"<urn:a> <urn:p> {object}")) == 1
